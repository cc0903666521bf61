//! MoveSmoothlyTo where the joints rule: the curve of the tool and the spare joint are searched under the limits of the
//! joints, near a motion that is known.

use std::ops::RangeInclusive;

use kinematics::follow::{self, NullMotion};
use nalgebra::{SVector, Vector3};
use trajectory::Trajectory;
use trajectory::smooth::{self, ArmMotion, ArmState, JointBounds, JointState};

use super::smooth_joints::SmoothPath;
use super::{PlannedMove, Planner};
use crate::task::Move;

/// Most searches, each from the fastest motion so far, and the share of its time that one has to save for another like it.
const ROUNDS: usize = 3;
const GAIN: f64 = 0.01;

/// How far the linear function of the joints that says where the spare joint is may be from that of the known motion, at first and
/// where that leads nowhere.
const FAR: f64 = 0.6;
const NEAR: f64 = 0.15;

/// Poses of a list for which it is not too dear; one pose is reached straight.
const POSES: RangeInclusive<usize> = 2..=60;

/// Gap to its optimum at which a search ends: the joints are timed once more after it.
const GAP: f64 = 0.1;

/// Distance from a limit (rad) and smallest singular value from which a spare joint is well where it is, as in the
/// search of a null-space motion along a curve.
const ROOM: f64 = 0.1;
const NIMBLE: f64 = 0.05;

/// Places along a motion at which its ease is looked at.
const LOOKS: u32 = 24;

/// Joint positions along a motion, its ends with them.
fn places<const N: usize>(trajectory: &Trajectory<N>) -> impl Iterator<Item = SVector<f64, N>> {
    let step = trajectory.duration() / f64::from(LOOKS);
    (0..=LOOKS).map(move |k| trajectory.sample(step * f64::from(k)).position)
}

impl<const N: usize> Planner<N> {
    /// The fastest motion of searches with the joints that begin at a known one; `None` if none is faster, and for arms of
    /// other than six or seven joints.
    pub(super) fn with_joints(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        known: &PlannedMove<N>,
    ) -> Option<PlannedMove<N>> {
        let has_inverse = N == 6 || N == 7;
        if !has_inverse || !POSES.contains(&motion.poses.len()) {
            return None;
        }
        let (mut best, mut near): (Option<PlannedMove<N>>, _) = (None, FAR);
        let time = |planned: &PlannedMove<N>| planned.trajectory.duration();
        for _ in 0..ROUNDS {
            let from = best.as_ref().unwrap_or(known);
            let before = time(from);
            let found = self.searched_from(motion, start, (from, near));
            let found = found.filter(|found| time(found) < before);
            let gains = found
                .as_ref()
                .is_some_and(|found| time(found) <= (1.0 - GAIN) * before);
            best = found.or(best);
            if gains {
                continue;
            }
            if N <= 6 || near <= NEAR {
                break;
            }
            // The joints were perhaps too far from where they were looked at.
            near = NEAR;
        }
        best
    }

    /// The motion with which a search ends that begins at a known one.
    fn searched_from(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (known, near): (&PlannedMove<N>, f64),
    ) -> Option<PlannedMove<N>> {
        let trajectory = &known.trajectory;
        let middle = trajectory.sample(0.5 * trajectory.duration()).position;
        let direction = follow::spare_direction(self.chain(), &middle);
        let spare = direction.unwrap_or_else(SVector::zeros);
        let at = |time: f64| self.state(&trajectory.sample(time).position, &spare);
        let passes: Vec<f64> = known
            .certificate
            .poses
            .iter()
            .map(|pass| pass.time_s)
            .collect();
        let arm = ArmMotion {
            duration: trajectory.duration(),
            at: &at,
            passes: &passes,
            bounds: &self.joint_bounds(trajectory),
            spare: direction.map(|_| near),
        };
        let poses = self.through(motion, start);
        let mut options = smooth::SmoothOptions::new(motion.tolerance, motion.limits);
        options.gap = GAP;
        let found = smooth::plan_for_arm(&poses, &options, &arm).ok()??;
        let course = found
            .spare
            .zip(direction)
            .map(|(course, direction)| NullMotion::given(direction, move |time| course.at(time)));
        let path = SmoothPath::new(found.plan, motion.tolerance, &poses);
        let followed = self.joints_on(path, start, course.as_ref()).ok()?;
        let along = self.on(&followed, motion, (start, trajectory.duration()));
        let found = along.ok()?.planned;
        let eased = N <= 6 || self.ease_along(&found.trajectory) >= self.ease_along(trajectory);
        eased.then_some(found)
    }

    /// The arm at joint positions, with the linear function `spare` of its joints as the spare coordinate.
    fn state(&self, q: &SVector<f64, N>, spare: &SVector<f64, N>) -> Option<ArmState> {
        let pose = self.chain().forward(q);
        let changes = follow::joint_changes(self.chain(), q, spare)?;
        let joints = (0..N).map(|j| {
            let [along, about] =
                [0, 3].map(|first| Vector3::from_fn(|d, _| changes[(j, first + d)]));
            let about = pose.rotation.inverse() * about;
            let with_spare = changes[(j, 6)];
            JointState {
                position: q[j],
                changes: [
                    along.x, along.y, along.z, about.x, about.y, about.z, with_spare,
                ],
            }
        });
        Some(ArmState {
            pose,
            joints: joints.collect(),
            spare: spare.dot(q),
        })
    }

    /// What the joints may do. With a spare joint they may be no nearer to limits than in the known motion, up to what counts as
    /// well inside.
    fn joint_bounds(&self, known: &Trajectory<N>) -> Vec<JointBounds> {
        let (limits, chain) = (&self.limits, self.chain());
        let places: Vec<_> = places(known).collect();
        let joint = |j: usize| {
            let [low, high] = [chain.lower()[j], chain.upper()[j]];
            let room = |q: &SVector<f64, N>| (high - q[j]).min(q[j] - low);
            let room = places.iter().map(room).fold(ROOM, f64::min);
            let room = if N > 6 { room.max(0.0) } else { 0.0 };
            JointBounds {
                position: [low + room, high - room],
                rates: [limits.velocity[j], limits.acceleration[j], limits.jerk[j]],
            }
        };
        (0..N).map(joint).collect()
    }

    /// The least ease along a motion.
    fn ease_along(&self, trajectory: &Trajectory<N>) -> f64 {
        let all = places(trajectory).map(|q| self.ease_within(&q, [ROOM, NIMBLE]));
        all.fold(f64::INFINITY, f64::min)
    }
}
