//! From the numbers of a program to a pose.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::units::{AngleUnit, LengthUnit};
use crate::command_error::CommandError;

/// Largest |x . z| of two unit axes that still count as perpendicular.
///
/// # Source
/// NIST's KittingViewer (2013) refuses poses beyond 1e-7.
const PERPENDICULAR: f64 = 1e-7;

/// The pose of a program as an isometry in metres, in the frame the program means.
///
/// Axes are made unit; roll, pitch and yaw are read as `Rz(yaw) Ry(pitch) Rx(roll)`.
///
/// # Errors
/// A range error when a number is not finite, an axis has no length, or the
/// axes are not perpendicular within 1e-7.
pub fn isometry(
    pose: &crcl::Pose,
    length: LengthUnit,
    angle: AngleUnit,
) -> Result<Isometry3<f64>, CommandError> {
    let (point, rotation) = match pose {
        crcl::Pose::Axes { point, z_axis, x_axis } => (point, from_axes(z_axis, x_axis)?),
        crcl::Pose::RollPitchYaw { point, roll, pitch, yaw } => {
            let unit = angle.radians();
            finite("angle", &[*roll, *pitch, *yaw])?;
            let rotation =
                UnitQuaternion::from_euler_angles(roll * unit, pitch * unit, yaw * unit);
            (point, rotation)
        }
    };
    finite("coordinate", point)?;
    let position = Vector3::from(*point) * length.meters();
    finite("coordinate", position.as_slice())?;
    Ok(Isometry3::from_parts(Translation3::from(position), rotation))
}

fn from_axes(z_axis: &[f64; 3], x_axis: &[f64; 3]) -> Result<UnitQuaternion<f64>, CommandError> {
    let z = unit("z", z_axis)?;
    let x = unit("x", x_axis)?;
    let cosine = x.dot(&z);
    if cosine.abs() > PERPENDICULAR {
        let degrees = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        return Err(CommandError::range(format!(
            "x axis and z axis of a pose must be perpendicular, they are at {degrees:.6} degrees"
        ))
        .with_help("give the x axis without its part along the z axis"));
    }
    let x = (x - z * cosine).normalize();
    let matrix = Matrix3::from_columns(&[x, z.cross(&x), z]);
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)))
}

fn unit(name: &str, axis: &[f64; 3]) -> Result<Vector3<f64>, CommandError> {
    finite("axis component", axis)?;
    let vector = Vector3::from(*axis);
    let largest = vector.amax();
    if largest == 0.0 {
        return Err(CommandError::range(format!("{name} axis of a pose has no length")));
    }
    // Scaled first, so that neither tiny nor huge components lose the direction.
    Ok((vector / largest).normalize())
}

fn finite(what: &str, values: &[f64]) -> Result<(), CommandError> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(value) => Err(CommandError::range(format!("{what} must be finite, got {value}"))),
        None => Ok(()),
    }
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
        assert!((got * Vector3::y() + Vector3::y()).norm() < 1e-15);
    }

    #[test]
    fn leaning_axes_are_refused_with_their_angle() {
        let pose = crcl::Pose::Axes {
            point: [0.0; 3],
            z_axis: [0.0, 0.0, 1.0],
            x_axis: [1.0, 0.0, 1.0],
        };
        let error = isometry(&pose, LengthUnit::Meter, AngleUnit::Degree).unwrap_err();
        assert!(error.message.contains("45.0"), "{error}");
    }

    #[test]
    fn tiny_axes_keep_their_direction() {
        let pose = crcl::Pose::Axes {
            point: [0.0; 3],
            z_axis: [0.0, 0.0, 1e-300],
            x_axis: [0.0, 1e300, 0.0],
        };
        let got = isometry(&pose, LengthUnit::Meter, AngleUnit::Degree).unwrap();
        assert!((got * Vector3::x() - Vector3::y()).norm() < 1e-15);
    }
}
