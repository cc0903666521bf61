//! A motion of an arm that is known, and what its joints may do.

use nalgebra::Isometry3;

use super::seed::Seed;

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
    /// By how much each joint may differ from this motion (rad or m): farther away the joints are others than to first order.
    pub far: f64,
    /// Whether the arm has a joint more than the tool needs, and the states a spare coordinate.
    pub has_spare: bool,
    /// Whether the plan is no more than the known motion of a further search: it may exceed the tolerances by a little, and the
    /// corridor by more, as its certificate then says.
    pub rough: bool,
    /// Where the search of the plan ended that this motion follows in the time of the tool, if it does: the next goes on from there, on
    /// knots at half the distance where the tool turns and the search is not rough. Of a plan for the same poses.
    pub onward: Option<&'a Seed>,
}

impl ArmMotion<'_> {
    /// The arm at the time nearest to `time` (s) that the motion has, with all joints.
    pub(super) fn state(&self, time: f64) -> Option<ArmState> {
        let state = (self.at)(time.clamp(0.0, self.duration));
        state.filter(|state| state.joints.len() == self.bounds.len())
    }
}

impl std::fmt::Debug for ArmMotion<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ArmMotion")
            .field("duration", &self.duration)
            .field("passes", &self.passes)
            .field("bounds", &self.bounds)
            .field("far", &self.far)
            .field("has_spare", &self.has_spare)
            .field("rough", &self.rough)
            .finish_non_exhaustive()
    }
}
