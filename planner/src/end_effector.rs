//! End effectors of an arm, their grippers, and the tool changer.

use kinematics::Inertia;
use nalgebra::Isometry3;

/// How long a gripper takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gripper {
    /// Time to open, s.
    pub opening: f64,
    /// Time to close, s.
    pub closing: f64,
    /// Opening when open, m; unknown where it only opens and closes.
    pub width: Option<f64>,
}

/// Something that the flange can carry.
#[derive(Clone, Debug, PartialEq)]
pub struct EndEffector {
    /// Name.
    pub name: String,
    /// Pose of the tool centre point in the flange.
    pub flange_from_tcp: Isometry3<f64>,
    /// Present when it opens and closes.
    pub gripper: Option<Gripper>,
    /// Mass, centre and inertia in the flange's frame, where they are known.
    pub inertia: Option<Inertia>,
    /// Where it is kept in the changing station, in the workstation.
    pub workstation_from_holder: Option<Isometry3<f64>>,
}

/// The part of the flange that takes end effectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolChanger {
    /// Time to release, s.
    pub opening: f64,
    /// Time to take hold, s.
    pub closing: f64,
}
