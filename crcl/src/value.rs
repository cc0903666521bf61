//! Why a value is refused: the range rules of the language, the same for text, JSON and
//! commands made in memory.

use thiserror::Error;

use crate::code;
use crate::joint::{JointTarget, MOST_JOINTS};

/// Why the value of a command is refused.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ValueError {
    /// A number is NaN or infinite.
    #[error("{quantity} must be a finite number, got {value}")]
    NotFinite {
        /// What the number means.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// A number is below zero that cannot be.
    #[error("{quantity} cannot be negative, got {}", short(*value))]
    Negative {
        /// What the number means.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// A number is larger than the largest that is accepted.
    #[error("{quantity} must be at most {most}, got {}", short(*value))]
    TooLarge {
        /// What the number means.
        quantity: &'static str,
        /// The number.
        value: f64,
        /// The largest magnitude that is accepted.
        most: f64,
    },
    /// A percentage is outside 0 to 100.
    #[error("{quantity} must be 0 to 100 percent, got {}", short(*value))]
    Percent {
        /// What the number means.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// An axis has no direction.
    #[error("the {axis} axis has length zero")]
    ZeroAxis {
        /// `Z` or `X`.
        axis: char,
    },
    /// The axes of a pose are not perpendicular.
    #[error("the Z axis and the X axis must be perpendicular, but are {} degrees apart", angle(*degrees))]
    NotOrthogonal {
        /// Angle between the two axes (degrees).
        degrees: f64,
    },
    /// A move through no pose at all.
    #[error("a list needs at least one pose")]
    NoPoses,
    /// A move of no joint at all.
    #[error("a list needs at least one joint")]
    NoJoints,
    /// The name of a sensor is empty, too long, or no name.
    #[error("the name of a sensor has 1 to 24 bytes and no control characters, got {length} bytes")]
    Sensor {
        /// Its length (bytes).
        length: usize,
    },
    /// Two targets for one joint.
    #[error("joint {joint} has two targets")]
    SameJoint {
        /// Number of the joint, from 1.
        joint: i64,
    },
}

/// A number in a message: with an exponent where the digits would fill the line.
fn short(value: f64) -> String {
    if value != 0.0 && !(1e-9..1e12).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// Enough digits of an angle to tell it from 90 degrees, and no more.
fn angle(degrees: f64) -> String {
    let off = (degrees - 90.0).abs();
    let digits = if off >= 1.0 {
        1
    } else {
        (1.0 - off.max(1e-12).log10().floor()) as usize
    };
    format!("{degrees:.digits$}")
}

impl ValueError {
    /// The stable code of the finding that this error becomes.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => code::NOT_FINITE,
            Self::Negative { .. } => code::NEGATIVE,
            Self::TooLarge { .. } => code::TOO_LARGE,
            Self::Percent { .. } => code::PERCENT,
            Self::ZeroAxis { .. } => code::ZERO_AXIS,
            Self::NotOrthogonal { .. } => code::NOT_ORTHOGONAL,
            Self::NoPoses => code::NO_POSES,
            Self::NoJoints | Self::SameJoint { .. } => code::JOINTS,
            Self::Sensor { .. } => code::GUARD,
        }
    }

    /// What to do about it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "write a plain decimal number",
            Self::Negative { .. } => "write zero or more",
            Self::TooLarge { .. } => "check the number and its unit",
            Self::Percent { .. } => "100 is all that the robot can do, 50 is half of it",
            Self::ZeroAxis { .. } => {
                "an axis is a direction, such as {0, 0, -1} for straight down; \
                                      its length does not matter, but must not be zero"
            }
            Self::NotOrthogonal { .. } => {
                "write the axes with more digits, or choose an X axis at \
                                           90 degrees to the Z axis"
            }
            Self::NoPoses => "give the pose to stop at",
            Self::Sensor { .. } => "write a name that the driver gives, such as `wrench.Fz`",
            Self::NoJoints | Self::SameJoint { .. } => "give one target for each joint that moves",
        }
    }
}

/// Checks that a number is finite.
pub(crate) fn finite(quantity: &'static str, value: f64) -> Result<f64, ValueError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(ValueError::NotFinite { quantity, value })
    }
}

/// Checks that a number is finite and not below zero.
pub(crate) fn not_negative(quantity: &'static str, value: f64) -> Result<f64, ValueError> {
    let value = finite(quantity, value)?;
    if value >= 0.0 {
        Ok(value)
    } else {
        Err(ValueError::Negative { quantity, value })
    }
}

/// Checks that a number is finite and that its magnitude is at most `most`.
pub(crate) fn within(quantity: &'static str, value: f64, most: f64) -> Result<f64, ValueError> {
    let value = finite(quantity, value)?;
    if value.abs() <= most {
        Ok(value)
    } else {
        Err(ValueError::TooLarge {
            quantity,
            value,
            most,
        })
    }
}

/// The largest position, speed or acceleration of a joint, in units of the program.
const LARGEST_OF_JOINT: f64 = 1e9;

/// Checks the targets of one command: at least one, and none for the same joint twice.
pub(crate) fn check_targets(targets: &[JointTarget]) -> Result<(), ValueError> {
    if targets.is_empty() {
        return Err(ValueError::NoJoints);
    }
    for (index, target) in targets.iter().enumerate() {
        check_target(target)?;
        let before = targets.get(..index).unwrap_or_default();
        if before.iter().any(|other| other.joint == target.joint) {
            let joint = target.joint;
            return Err(ValueError::SameJoint { joint });
        }
    }
    Ok(())
}

/// Checks every number of a target that can be judged without settings and robot.
fn check_target(target: &JointTarget) -> Result<(), ValueError> {
    let joint = not_negative("the number of a joint", target.joint as f64 - 1.0)?;
    within("the number of a joint", joint + 1.0, MOST_JOINTS as f64)?;
    within("the position of a joint", target.position, LARGEST_OF_JOINT)?;
    for (noun, value) in [
        ("the speed of a joint", target.speed),
        ("the acceleration of a joint", target.acceleration),
    ] {
        within(noun, not_negative(noun, value)?, LARGEST_OF_JOINT)?;
    }
    Ok(())
}

/// Checks that a number is a percentage from 0 to 100.
pub(crate) fn percent(quantity: &'static str, value: f64) -> Result<f64, ValueError> {
    let value = finite(quantity, value)?;
    let inside = (0.0..=100.0).contains(&value);
    if inside {
        Ok(value)
    } else {
        Err(ValueError::Percent { quantity, value })
    }
}
