//! Converts the numbers of a program into a pose.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::command_error::CommandError;
use crcl::{AngleUnit, LengthUnit, ValueError};

/// The pose of a program as an isometry in metres, in the frame the program means.
///
/// # Errors
/// A range error when a number is not finite, an axis has no length, or the
/// axes are not perpendicular.
pub fn isometry(
    pose: &crcl::Pose,
    length: LengthUnit,
    angle: AngleUnit,
) -> Result<Isometry3<f64>, CommandError> {
    let axes = pose.axes(angle)?.map(Vector3::from);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
    let position = Vector3::from(pose.point()) * length.metres();
    if let Some(&value) = position.iter().find(|value| !value.is_finite()) {
        return Err(ValueError::NotFinite {
            quantity: "a coordinate in metres",
            value,
        }
        .into());
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Ok(Isometry3::from_parts(
        Translation3::from(position),
        rotation,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_become_columns() {
        let pose = crcl::Pose::Axes {
            point: [1000.0, 0.0, 0.0],
            z_axis: [0.0, 0.0, -2.0],
            x_axis: [3.0, 0.0, 0.0],
        };
        let got = isometry(&pose, LengthUnit::Millimeter, AngleUnit::Degree).unwrap();
        assert_eq!(got.translation.vector, Vector3::x());
        assert!((got * Vector3::z() + Vector3::z()).norm() < 1e-15);
        assert!((got.rotation * Vector3::y() + Vector3::y()).norm() < 1e-15);
    }
}
