//! A motion of an arm that is known, and what its joints may do.

use nalgebra::Isometry3;

/// What one joint may do; all finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointBounds {
    /// Least and greatest position, rad or m.
    pub position: [f64; 2],
    /// Greatest speed, acceleration and jerk, rad/s^k or m/s^k.
    pub rates: [f64; 3],
}

/// One joint at a moment of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointState {
    /// Its position, rad or m.
    pub position: f64,
    /// By how much it moves, to first order, with the tool along x, y and z of the frame of the poses (per m), about x, y
    /// and z of the tool (per rad), and with the spare coordinate.
    pub changes: [f64; 7],
}

/// An arm at a moment of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmState {
    /// Pose of the tool.
    pub pose: Isometry3<f64>,
    /// Its joints.
    pub joints: Vec<JointState>,
    /// The coordinate that says where a spare joint is, whatever its unit; 0 without one.
    pub spare: f64,
}

/// A motion of an arm through a list of poses, from rest to rest.
#[derive(Clone, Copy)]
pub struct ArmMotion<'a> {
    /// Its time, s.
    pub duration: f64,
    /// The arm at a time between 0 and [`ArmMotion::duration`], with a joint for each of the bounds; `None` where it is
    /// singular.
    pub at: &'a dyn Fn(f64) -> Option<ArmState>,
    /// The times at which it passes the poses between the first and the last, s.
    pub passes: &'a [f64],
    /// What the joints may do.
    pub bounds: &'a [JointBounds],
    /// For an arm with a joint more than the tool needs, by how much the spare coordinate may differ from that of this motion:
    /// farther away the joints are others than to first order.
    pub spare: Option<f64>,
}

impl std::fmt::Debug for ArmMotion<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ArmMotion")
            .field("duration", &self.duration)
            .field("passes", &self.passes)
            .field("bounds", &self.bounds)
            .field("spare", &self.spare)
            .finish_non_exhaustive()
    }
}
