//! A pose of the controlled point, as a program gives it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::units::AngleUnit;
use crate::value::{ValueError, finite, within};

/// How far the axes of a pose may be from perpendicular: `1 - |x cross z|` of the unit axes.
///
/// # Source
/// The rule of NIST's kitting viewer (2013): the cross product has length 1 within 1e-7.
pub const ORTHOGONALITY: f64 = 1e-7;

/// The largest coordinate that is accepted, in length units of the program. No arm reaches a
/// thousandth of it, and its square does not overflow.
pub const LARGEST_COORDINATE: f64 = 1e9;

/// The largest roll, pitch or yaw that is accepted, in angle units of the program. The digits of a
/// larger number no longer determine the angle within a turn.
pub const LARGEST_ANGLE: f64 = 1e6;

/// Position and orientation of the controlled point, in raw numbers of the program: the length and
/// angle units are those that apply when the command is executed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum Pose {
    /// A point and two axes of the tool: `{{x, y, z}, {z axis}, {x axis}}`.
    Axes {
        /// The point (length units).
        point: [f64; 3],
        /// Direction of the tool's Z axis; any length but zero.
        z_axis: [f64; 3],
        /// Direction of the tool's X axis, perpendicular to the Z axis; any length but zero.
        x_axis: [f64; 3],
    },
    /// A point and three angles: `Pose(Point(x, y, z), RollPitchYaw(roll, pitch, yaw))`.
    RollPitchYaw {
        /// The point (length units).
        point: [f64; 3],
        /// Turn about the fixed X axis, the first of the three (angle units).
        roll: f64,
        /// Turn about the fixed Y axis, the second (angle units).
        pitch: f64,
        /// Turn about the fixed Z axis, the last (angle units).
        yaw: f64,
    },
}

/// The part of a pose that a fault is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PosePart {
    /// The point.
    Point,
    /// The Z axis.
    ZAxis,
    /// The X axis.
    XAxis,
    /// Both axes together.
    Axes,
    /// Roll, pitch and yaw.
    Angles,
}

impl Pose {
    /// The point, in length units of the program.
    pub fn point(&self) -> [f64; 3] {
        match *self {
            Self::Axes { point, .. } | Self::RollPitchYaw { point, .. } => point,
        }
    }

    /// All errors of the pose, with the part that each is in.
    pub fn faults(&self) -> Vec<(PosePart, ValueError)> {
        let mut faults = Vec::new();
        let mut keep = |part, result: Result<(), ValueError>| {
            faults.extend(result.err().map(|error| (part, error)));
        };
        let point = self.point();
        keep(
            PosePart::Point,
            all_within("a coordinate", &point, LARGEST_COORDINATE),
        );
        match *self {
            Self::Axes { z_axis, x_axis, .. } => {
                let (z, x) = (direction('Z', z_axis), direction('X', x_axis));
                if let (Ok(z), Ok(x)) = (&z, &x) {
                    keep(PosePart::Axes, perpendicular(z, x));
                }
                keep(PosePart::ZAxis, z.map(drop));
                keep(PosePart::XAxis, x.map(drop));
            }
            Self::RollPitchYaw {
                roll, pitch, yaw, ..
            } => {
                keep(
                    PosePart::Angles,
                    all_within("an angle", &[roll, pitch, yaw], LARGEST_ANGLE),
                );
            }
        }
        faults
    }

    /// The axes X, Y, Z of the pose as unit vectors in the frame that the pose is given in: the
    /// columns of its rotation matrix, right-handed and perpendicular to rounding.
    ///
    /// The Z axis is kept as written; the X axis is turned onto its normal plane, which moves it
    /// by less than 0.03 degrees within [`ORTHOGONALITY`]. `unit` is the unit of roll, pitch, yaw.
    ///
    /// # Errors
    /// The first of [`Pose::faults`].
    ///
    /// # Source
    /// Roll, pitch, yaw as fixed axes X, Y, Z in that order: R = Rz(yaw) Ry(pitch) Rx(roll).
    /// J. J. Craig, "Introduction to Robotics", 3rd ed., 2005, eq. (2.64).
    ///
    /// ```
    /// use crcl::{AngleUnit, Pose};
    /// let down = Pose::RollPitchYaw { point: [0.0; 3], roll: 180.0, pitch: 0.0, yaw: 0.0 };
    /// let [_, _, z] = down.axes(AngleUnit::Degree)?;
    /// assert!((z[2] + 1.0).abs() < 1e-15);
    /// # Ok::<(), crcl::ValueError>(())
    /// ```
    pub fn axes(&self, unit: AngleUnit) -> Result<[[f64; 3]; 3], ValueError> {
        if let Some((_, error)) = self.faults().into_iter().next() {
            return Err(error);
        }
        match *self {
            Self::Axes { z_axis, x_axis, .. } => {
                let (z, x) = (direction('Z', z_axis)?, direction('X', x_axis)?);
                let along = dot(&x, &z);
                let across = [
                    x[0] - along * z[0],
                    x[1] - along * z[1],
                    x[2] - along * z[2],
                ];
                let x = direction('X', across)?;
                Ok([x, cross(&z, &x), z])
            }
            Self::RollPitchYaw {
                roll, pitch, yaw, ..
            } => Ok(turned(
                roll * unit.radians(),
                pitch * unit.radians(),
                yaw * unit.radians(),
            )),
        }
    }
}

/// Columns of Rz(yaw) Ry(pitch) Rx(roll), angles in rad.
fn turned(roll: f64, pitch: f64, yaw: f64) -> [[f64; 3]; 3] {
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    [
        [cy * cp, sy * cp, -sp],
        [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr],
        [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr],
    ]
}

fn all_finite(quantity: &'static str, numbers: &[f64; 3]) -> Result<(), ValueError> {
    numbers
        .iter()
        .try_for_each(|&number| finite(quantity, number).map(drop))
}

fn all_within(quantity: &'static str, numbers: &[f64; 3], most: f64) -> Result<(), ValueError> {
    numbers
        .iter()
        .try_for_each(|&number| within(quantity, number, most).map(drop))
}

/// The unit vector along an axis; scaled first, so that no size over- or underflows.
fn direction(axis: char, vector: [f64; 3]) -> Result<[f64; 3], ValueError> {
    all_finite("an axis component", &vector)?;
    let largest = vector
        .iter()
        .fold(0.0_f64, |largest, number| largest.max(number.abs()));
    if largest == 0.0 {
        return Err(ValueError::ZeroAxis { axis });
    }
    let scaled = vector.map(|number| number / largest);
    let length = dot(&scaled, &scaled).sqrt();
    Ok(scaled.map(|number| number / length))
}

fn perpendicular(z: &[f64; 3], x: &[f64; 3]) -> Result<(), ValueError> {
    let across = cross(x, z);
    let sine = dot(&across, &across).sqrt();
    if sine >= 1.0 - ORTHOGONALITY {
        return Ok(());
    }
    Err(ValueError::NotOrthogonal {
        degrees: sine.atan2(dot(x, z)).to_degrees(),
    })
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
