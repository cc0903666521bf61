//! A motion that is not certified yet.

use trajectory::smooth::{RestCause, SmoothPlan};
use trajectory::{MotionBounds, Trajectory};

/// How a motion passes an intermediate pose of a smooth move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// When, s.
    pub time: f64,
    /// Why the motion rests at the pose, if it does.
    pub rests: Option<RestCause>,
}

impl Crossing {
    /// How a motion of the tool passes the poses of its list.
    pub(super) fn of(plan: &SmoothPlan) -> Vec<Self> {
        let pass = |time| Self { time, rests: None };
        let times = plan.crossings().iter().map(|pass| pass.time);
        let mut all: Vec<_> = times.map(pass).collect();
        for rest in plan.rests() {
            // The start of the list is pose 0.
            let at = rest.pose.checked_sub(1);
            if let Some(pass) = at.and_then(|at| all.get_mut(at)) {
                pass.rests = Some(rest.cause);
            }
        }
        all
    }

    /// The same poses at other times (s).
    pub(super) fn at(all: &[Self], time: impl Fn(f64) -> f64) -> Vec<Self> {
        let moved = |pass: &Self| Self {
            time: time(pass.time),
            ..*pass
        };
        all.iter().map(moved).collect()
    }
}

/// A motion of the joints, with the data known about it.
#[derive(Clone, Debug)]
pub(super) struct Draft<const N: usize> {
    /// The motion.
    pub trajectory: Trajectory<N>,
    /// How it passes each intermediate pose of a smooth move; the times never decrease.
    pub crossings: Vec<Crossing>,
    /// Its bounds, once they were computed: then it keeps every limit.
    pub bounds: Option<MotionBounds<N>>,
    /// Lower bound of the time along its path, s; 0 if not known.
    pub least: f64,
}

impl<const N: usize> Draft<N> {
    /// A motion of which nothing else is known.
    pub(super) fn of(trajectory: Trajectory<N>) -> Self {
        Self {
            trajectory,
            crossings: Vec::new(),
            bounds: None,
            least: 0.0,
        }
    }

    /// The motion and its bounds, slowed down if they exceed a limit.
    pub(super) fn bounded(self, bounds: MotionBounds<N>) -> (Self, MotionBounds<N>) {
        let slower = bounds.slower() * (1.0 + 1e-12);
        // The certificate refuses NaN.
        if slower.is_nan() || slower <= 1.0 + 1e-12 || self.trajectory.duration() <= 0.0 {
            return (self, bounds);
        }
        (self.stretched(slower), bounds.stretched(slower))
    }

    /// The same motion in `slower` times the time.
    pub(super) fn stretched(self, slower: f64) -> Self {
        Self {
            trajectory: self.trajectory.stretched(slower),
            crossings: Crossing::at(&self.crossings, |time| time * slower),
            ..self
        }
    }
}
