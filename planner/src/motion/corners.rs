//! Smooth moves with poses on straight legs: only the corners between the legs shape the motion.
//!
//! A motion through the corners that stays in the corridor passes the poses on the legs in place. Where the tool turns along a leg it may
//! pass them turned too far; such a list is planned through all its poses.

use nalgebra::{Isometry3, SVector};
use trajectory::Trajectory;
use trajectory::smooth::{self, RESOLUTION};

use super::certificate::closest;
use super::draft::{Crossing, Draft};
use super::{Blend, PlannedMove, Planner};
use crate::task::{Move, Shape};

/// Steps in which the first approach to a pose is looked for, in the mean from one pose of a leg to the next.
const STEPS: f64 = 4.0;

/// Most corners of a list that is planned as a whole through them, however many poses it has.
const FEW: usize = 200;

/// Whether a move with many poses has few corners.
pub(super) fn has_few(motion: &Move) -> bool {
    smooth::corners(&motion.poses).take(FEW + 1).count() <= FEW
}

/// The corners of a move.
pub(super) struct Corners {
    /// The move through them.
    pub(super) motion: Move,
    /// Which poses of the whole move they are.
    at: Vec<usize>,
}

impl<const N: usize> Planner<N> {
    /// The corners of a smooth move with a tolerance; `None` if all its poses are corners.
    pub(super) fn corners(&self, motion: &Move, start: &SVector<f64, N>) -> Option<Corners> {
        if motion.shape != Shape::Smooth || motion.tolerance <= RESOLUTION {
            return None;
        }
        // The first one is the start.
        let poses = self.through(motion, start);
        let kept = smooth::corners(&poses).skip(1);
        let at: Vec<_> = kept.map(|pose| pose - 1).collect();
        (at.len() < motion.poses.len()).then(|| Corners {
            motion: Move {
                shape: motion.shape,
                poses: at.iter().map(|pose| motion.poses[*pose]).collect(),
                tolerance: motion.tolerance,
                limits: motion.limits,
            },
            at,
        })
    }

    /// A motion through the corners of a move as one through all its poses; `None` if it misses one of these.
    pub(super) fn through_all(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (planned, corners): (PlannedMove<N>, &Corners),
    ) -> Option<PlannedMove<N>> {
        let draft = Draft {
            crossings: self.passes_of_all(motion, (&planned, corners)),
            ..Draft::of(planned.trajectory)
        };
        let exact_stop = self.least_of_legs(motion, start).iter().sum();
        let mut whole = self.certify(motion, start, draft).ok()?;
        whole.blend = planned.blend.map(|blend| Blend {
            exact_stop,
            ..blend
        });
        whole.certificate.lower_bound_s = planned.certificate.lower_bound_s;
        Some(whole)
    }

    /// When a motion through the corners passes each intermediate pose of the whole move: between two corners at the first approach
    /// to a pose after the pass of the pose before.
    fn passes_of_all(
        &self,
        motion: &Move,
        (planned, corners): (&PlannedMove<N>, &Corners),
    ) -> Vec<Crossing> {
        let trajectory = &planned.trajectory;
        let (mut passes, mut since) = (Vec::with_capacity(motion.poses.len()), 0.0);
        let known = planned.certificate.poses.iter().map(|pass| pass.crossing());
        let end = Crossing {
            time: trajectory.duration(),
            rests: None,
        };
        for (corner, at) in known.chain([end]).zip(&corners.at) {
            let on_the_leg = &motion.poses[passes.len()..*at];
            let step = (corner.time - since) / (STEPS * (on_the_leg.len() + 1) as f64);
            for pose in on_the_leg {
                let at = (pose, motion.tolerance);
                since = self.first_approach(trajectory, at, ([since, corner.time], step));
                passes.push(Crossing {
                    time: since,
                    rests: None,
                });
            }
            since = corner.time;
            passes.push(corner);
        }
        // The last pose is reached.
        passes.pop();
        passes
    }

    /// The first time (s) of an interval at which the controlled point is locally nearest to a pose, as steps of a length (s) show it;
    /// the begin of the interval counts if it is within the tolerance (m) there.
    fn first_approach(
        &self,
        trajectory: &Trajectory<N>,
        (pose, tolerance): (&Isometry3<f64>, f64),
        ([since, until], step): ([f64; 2], f64),
    ) -> f64 {
        let off = |time: f64| {
            let tool = self.chain().forward(&trajectory.sample(time).position);
            (tool.translation.vector - pose.translation.vector).norm()
        };
        let (mut time, mut least) = (since, off(since));
        let mut nearer = least <= tolerance;
        while time < until {
            let next = (time + step).min(until);
            let here = off(next);
            // A step may be too short to be seen.
            if here >= least && nearer || next <= time {
                break;
            }
            nearer |= here < least;
            (time, least) = (next, here);
        }
        let around = (time - step).max(since)..(time + step).min(until);
        closest(around, off).0
    }
}
