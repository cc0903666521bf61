//! Where an object is: a link of its location chain.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::ObjectId;

/// What a location says about its reference object.
///
/// # Source
/// NIST kitting ontology 2012: `Pose`, `RelativeLocationIn`, `RelativeLocationOn`; the workstation
/// schema of 2013 adds poses that also say "in" or "on".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// A pose only.
    Pose,
    /// A pose, and the object is in the reference object.
    PoseIn,
    /// A pose, and the object is on the reference object.
    PoseOn,
    /// In the reference object, at an unknown place: a chain through this link cannot be computed.
    In,
    /// On the reference object, at an unknown place: a chain through this link cannot be computed.
    On,
}

impl Relation {
    /// Name in the database and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::PoseIn => "pose_in",
            Self::PoseOn => "pose_on",
            Self::In => "in",
            Self::On => "on",
        }
    }

    /// The relation of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Pose, Self::PoseIn, Self::PoseOn, Self::In, Self::On]
            .into_iter()
            .find(|relation| relation.name() == name)
    }

    /// Whether the location has a pose.
    #[must_use]
    pub fn has_pose(self) -> bool {
        !matches!(self, Self::In | Self::On)
    }
}

/// One link of a location chain: the object's pose (m) in the frame of its reference object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// The object that the location is relative to; the workstation refers to itself.
    pub reference: ObjectId,
    /// What is said.
    pub relation: Relation,
    /// `reference_from_object`; the identity where the relation has no pose.
    pub pose: Isometry3<f64>,
}

impl Location {
    /// A plain pose (m) relative to `reference`.
    #[must_use]
    pub fn pose(reference: ObjectId, pose: Isometry3<f64>) -> Self {
        Self {
            reference,
            relation: Relation::Pose,
            pose,
        }
    }
}

/// Rotation from fixed-axis roll, pitch and yaw (rad): `Rz(yaw) Ry(pitch) Rx(roll)`.
#[must_use]
pub fn from_roll_pitch_yaw(roll: f64, pitch: f64, yaw: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll, pitch, yaw)
}

/// A pose from a point (m) and the directions of its X and Z axes.
///
/// The X axis is made orthogonal to the Z axis.
///
/// # Errors
/// A text that names the axis that is zero, not finite, or parallel to the other.
///
/// ```
/// let pose = plan::world::from_axes([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]).unwrap();
/// assert!((pose.rotation * nalgebra::Vector3::y() + nalgebra::Vector3::y()).norm() < 1e-12);
/// ```
pub fn from_axes(
    point: [f64; 3],
    x_axis: [f64; 3],
    z_axis: [f64; 3],
) -> Result<Isometry3<f64>, String> {
    let z = Vector3::from(z_axis)
        .try_normalize(1e-9)
        .filter(|v| v.iter().all(|c| c.is_finite()))
        .ok_or_else(|| format!("the Z axis {z_axis:?} has no direction"))?;
    let x = Vector3::from(x_axis);
    let x = (x - z * x.dot(&z))
        .try_normalize(1e-9)
        .filter(|v| v.iter().all(|c| c.is_finite()))
        .ok_or_else(|| format!("the X axis {x_axis:?} has no direction across the Z axis"))?;
    if !point.iter().all(|c| c.is_finite()) {
        return Err(format!("the point {point:?} is not finite"));
    }
    let matrix = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Ok(Isometry3::from_parts(
        Translation3::from(Vector3::from(point)),
        rotation,
    ))
}

/// The rotation that points the tool down: X kept, Z along -Z.
#[must_use]
pub fn pointing_down() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
}
