//! Options of a smooth motion, and why one cannot be planned.

use nalgebra::Isometry3;
use thiserror::Error;

use crate::ToolLimits;

/// Lever arm (m) that turns a length tolerance into the default angular one.
const LEVER: f64 = 0.05;

/// Greatest default angular tolerance, rad.
const WIDEST_ANGLE: f64 = 0.2;

/// The orientation rule: how far (rad) the tool may be turned away from an intermediate pose while
/// it passes that pose within `tolerance` (m). It is the tolerance divided by 50 mm, at most 0.2
/// rad; 0 if the tolerance is 0.
///
/// ```
/// use trajectory::smooth::angular_tolerance;
/// assert_eq!(angular_tolerance(0.0), 0.0);
/// assert!((angular_tolerance(0.001) - 0.02).abs() < 1e-15);
/// assert_eq!(angular_tolerance(0.02), 0.2);
/// ```
#[must_use]
pub fn angular_tolerance(tolerance: f64) -> f64 {
    (tolerance / LEVER).min(WIDEST_ANGLE)
}

/// What a smooth motion may do.
///
/// ```
/// use trajectory::{ToolLimits, smooth::SmoothOptions};
/// let limits = ToolLimits {
///     speed: 0.5, acceleration: 5.0, jerk: 100.0,
///     angular_speed: 2.0, angular_acceleration: 20.0, angular_jerk: 400.0,
/// };
/// let options = SmoothOptions::new(0.001, limits);
/// assert_eq!(options.corridor(), 0.001);
/// assert!((options.angular_tolerance() - 0.02).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SmoothOptions {
    /// Greatest distance at which an intermediate pose may be passed, m. Zero:
    /// exact stop at every pose.
    pub tolerance: f64,
    /// Greatest distance of the controlled point from the leg it travels, m;
    /// `None` means the tolerance, infinity means no corridor. A corridor
    /// narrower than the tolerance narrows the tolerance too.
    pub corridor: Option<f64>,
    /// Greatest angle to the orientation of an intermediate pose at its
    /// closest approach, rad; `None` means [`angular_tolerance`] of the
    /// tolerance.
    pub angular_tolerance: Option<f64>,
    /// Limits of the controlled point; infinity means no limit.
    pub limits: ToolLimits,
    /// Poses planned at once in a long list, at least as many as braking needs.
    pub window: usize,
    /// Whether a curve may be fitted through a dense list; otherwise it is planned as any other.
    pub fit: bool,
    /// Gap to the optimum at which the search for a spline ends, as a share of the cube of its time. With a larger one than
    /// the usual 0.0024 the search is shorter, the curve stays farther from its bounds, and nothing else is tried.
    pub gap: f64,
}

/// The usual gap: a time within 0.1 % of the optimum.
const GAP: f64 = 2.4e-3;
/// The smallest gap that rounding leaves.
const LEAST_GAP: f64 = 1e-6;

impl SmoothOptions {
    /// Options with the defaults that follow from a tolerance (m) and limits.
    #[must_use]
    pub fn new(tolerance: f64, limits: ToolLimits) -> Self {
        Self {
            tolerance,
            corridor: None,
            angular_tolerance: None,
            limits,
            window: 25,
            fit: true,
            gap: GAP,
        }
    }

    /// Whether a curve is wanted that is no more than near the optimum.
    pub(crate) fn is_rough(&self) -> bool {
        self.gap > GAP
    }

    /// Half width of the corridor in force, m.
    #[must_use]
    pub fn corridor(&self) -> f64 {
        self.corridor.unwrap_or(self.tolerance)
    }

    /// Angular tolerance in force, rad.
    #[must_use]
    pub fn angular_tolerance(&self) -> f64 {
        self.angular_tolerance
            .unwrap_or_else(|| angular_tolerance(self.tolerance))
    }

    /// The options with each infinite limit replaced by a very large one, so that ratios to it are
    /// finite.
    pub(crate) fn finite(&self) -> Self {
        let mut options = self.clone();
        let limits = &mut options.limits;
        for value in [&mut limits.speed, &mut limits.angular_speed] {
            *value = value.min(1e6);
        }
        for value in [&mut limits.acceleration, &mut limits.angular_acceleration] {
            *value = value.min(1e8);
        }
        for value in [&mut limits.jerk, &mut limits.angular_jerk] {
            *value = value.min(1e10);
        }
        options.gap = options.gap.max(LEAST_GAP);
        options
    }

    /// Checks every number of the options and of the poses.
    pub(crate) fn check(&self, poses: &[Isometry3<f64>]) -> Result<(), SmoothError> {
        if poses.is_empty() {
            return Err(SmoothError::NoPose);
        }
        for (index, pose) in poses.iter().enumerate() {
            let numbers = pose
                .translation
                .vector
                .iter()
                .chain(pose.rotation.coords.iter());
            if let Some(value) = numbers.copied().find(|x| x.is_nan() || x.abs() > 1e6) {
                return Err(SmoothError::BadPose { index, value });
            }
        }
        let limits = &self.limits;
        for (quantity, value) in [
            ("speed", limits.speed),
            ("acceleration", limits.acceleration),
            ("jerk", limits.jerk),
            ("angular speed", limits.angular_speed),
            ("angular acceleration", limits.angular_acceleration),
            ("angular jerk", limits.angular_jerk),
        ] {
            if value.is_nan() || value < 1e-9 {
                return Err(SmoothError::BadLimit { quantity, value });
            }
        }
        for (quantity, value) in [
            ("tolerance", self.tolerance),
            ("corridor", self.corridor()),
            ("angular tolerance", self.angular_tolerance()),
            ("gap", self.gap),
        ] {
            if value.is_nan() || value < 0.0 {
                return Err(SmoothError::BadTolerance { quantity, value });
            }
        }
        Ok(())
    }
}

/// Why no smooth motion was planned. Each is an error of the input; a list of valid poses always
/// has a motion.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SmoothError {
    /// The list is empty; the first pose is the start.
    #[error("expected the start pose at least, got no pose")]
    NoPose,
    /// A pose has a number that is not finite, or beyond 1e6 m.
    #[error("pose {index}: expected numbers within 1e6 of zero, got {value}")]
    BadPose {
        /// Which pose, the start being 0.
        index: usize,
        /// The number at fault.
        value: f64,
    },
    /// A limit is below 1e-9 (SI) or not a number.
    #[error("{quantity} limit: expected 1e-9 or more, got {value}")]
    BadLimit {
        /// Which limit.
        quantity: &'static str,
        /// The value at fault, SI.
        value: f64,
    },
    /// A tolerance or the gap is negative or not a number.
    #[error("{quantity}: expected zero or more, got {value}")]
    BadTolerance {
        /// Which tolerance.
        quantity: &'static str,
        /// The value at fault, m or rad; that of a gap has no unit.
        value: f64,
    },
}
