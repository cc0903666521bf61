//! MoveSmoothlyTo where the joints rule: the curve of the tool and the spare joint are searched under the limits of the
//! joints, near a motion that is known.
//!
//! The joints are looked at to first order, so a search may go only so far; the joints are followed along its curve, and the next
//! search begins there.

use std::ops::RangeInclusive;

use kinematics::follow::{self, NullMotion};
use nalgebra::{SVector, Vector3};
use trajectory::Trajectory;
use trajectory::smooth::{self, ArmMotion, ArmState, JointState};

use super::cartesian::pieces;
use super::course::Course;
use super::region::{Region, places};
use super::smooth_joints::{Followed, SmoothPath};
use super::{PlannedMove, Planner};
use crate::task::Move;

/// Most searches before the last.
const ROUNDS: usize = 12;

/// Gaps to its optimum at which a search ends: before the last, and the last where the tool turns or does not.
const ROUGH: f64 = 0.4;
const TURNING: f64 = 0.2;
const GAP: f64 = 0.1;

/// Angle (rad) from which on the tool turns, as a search sees it.
const TURN: f64 = 1e-12;

/// Poses of a list that is searched as a whole; one pose is reached straight.
const POSES: RangeInclusive<usize> = 2..=1000;

/// Parts of the known motion at whose ends the spare joint is looked at.
const LOOKS: u32 = 64;

/// What a search has found.
struct Found<const N: usize> {
    followed: Followed<N>,
    course: Course<N>,
}

/// What is the same in all searches of a move.
#[derive(Clone, Copy)]
struct Task<'a, const N: usize> {
    motion: &'a Move,
    start: &'a SVector<f64, N>,
    /// The linear function of the joints that says where a spare joint is, all along the known motion.
    spare: Option<SVector<f64, N>>,
    /// Gap to its optimum at which the last search ends.
    gap: f64,
}

impl<const N: usize> Planner<N> {
    /// The motion with which searches with the joints end that begin at a known one; `None` if it is not faster, and for arms of
    /// other than six or seven joints.
    pub(super) fn with_joints(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        known: Course<N>,
    ) -> Option<PlannedMove<N>> {
        let (most, region) = (known.time, self.region(&known.trajectory));
        let mut all = self.searches(motion, start, (known, &region));
        all.find_map(|followed| {
            let planned = self.on(&followed, motion, (start, most)).ok()?.planned;
            let trajectory = &planned.trajectory;
            let eased = self.is_eased(trajectory, &region);
            let taken = trajectory.duration() < most && eased;
            taken.then_some(planned)
        })
    }

    /// The joints along the curve with which such searches end, if they need about less time for it.
    pub(super) fn searched_along(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        known: Course<N>,
    ) -> Option<Followed<N>> {
        let (most, region) = (known.time, self.region(&known.trajectory));
        let mut all = self.searches(motion, start, (known, &region));
        all.find(|followed| {
            let trajectory = Trajectory::new(pieces(&followed.points));
            let eased = self.is_eased(&trajectory, &region);
            self.about_time(&followed.points) < most && eased
        })
    }

    /// The joints along the curve with which searches end, and those along one that was found before and is certified.
    fn searches(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        known: (Course<N>, &Region),
    ) -> impl Iterator<Item = Followed<N>> + use<N> {
        let all = self
            .is_searched(motion)
            .then(|| self.search(motion, start, known));
        let [last, sure] = all.unwrap_or_default();
        last.into_iter().chain(sure)
    }

    /// The same, of a motion that is searched.
    fn search(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (known, region): (Course<N>, &Region),
    ) -> [Option<Followed<N>>; 2] {
        let joints = places(&known.trajectory, LOOKS);
        let task = Task {
            motion,
            start,
            spare: follow::spare_direction_along(self.chain(), joints),
            gap: if self.turns(motion, start) {
                TURNING
            } else {
                GAP
            },
        };
        let mut region = region.clone();
        let (course, sure) = self.last_course(task, known, &mut region);
        // It leads farther than those before it, so the joints are to be known as well as they ever were.
        let region = region.nearest();
        let last = self.searched(task, &course, (&region, task.gap));
        // On the knots of the searches before it may find no way inside of the bounds, on others it does.
        let last = if last.is_none() && course.seed.is_some() {
            self.searched(task, &course.anew(), (&region, task.gap))
        } else {
            last
        };
        [last.map(|found| found.followed), sure]
    }

    /// Whether a motion is searched with the joints, where they rule.
    fn is_searched(&self, motion: &Move) -> bool {
        Self::has_inverse() && POSES.contains(&motion.poses.len())
    }

    /// Whether the joints follow a tool, with one to spare or none.
    pub(super) fn has_inverse() -> bool {
        N == 6 || N == 7
    }

    /// Whether the tool turns from one pose to the next.
    pub(super) fn turns(&self, motion: &Move, start: &SVector<f64, N>) -> bool {
        let poses = self.through(motion, start);
        let mut pairs = poses.windows(2);
        pairs.any(|pair| pair[0].rotation.angle_to(&pair[1].rotation) > TURN)
    }

    /// The course with which the last of some rough searches ends, each of which begins where one before ended; and the joints
    /// along the fastest of their curves that is certified.
    fn last_course(
        &self,
        task: Task<'_, N>,
        mut course: Course<N>,
        region: &mut Region,
    ) -> (Course<N>, Option<Followed<N>>) {
        let (mut sure, mut lacked): (Option<(f64, Followed<N>)>, _) = (None, false);
        for _ in 0..ROUNDS {
            let found = self.searched(task, &course, (region, ROUGH));
            let before = course.begins();
            // Where the joints cannot follow, nothing is saved of what was hoped for.
            let foretold = found
                .as_ref()
                .map_or(0.0, |found| found.followed.path.plan.duration());
            let found = found.filter(|found| found.course.time < before);
            let lacks = found
                .as_ref()
                .is_some_and(|found| !self.is_admitted(&found.course.trajectory, region));
            if lacks && !lacked {
                // The limits that are farther away now are tried alone, once.
                lacked = true;
                continue;
            }
            let mut after = before;
            if let Some(found) = found.filter(|_| !lacks) {
                course = found.course;
                after = course.time;
                let holds = found.followed.path.plan.certificate().holds();
                if holds && sure.as_ref().is_none_or(|(time, _)| after < *time) {
                    sure = Some((after, found.followed));
                }
            }
            if !region.goes_on([before, foretold, after]) {
                break;
            }
        }
        (course, sure.map(|(_, followed)| followed))
    }

    /// The joints along the plan of a search that begins at a course and ends at a gap to its optimum.
    fn searched(
        &self,
        task: Task<'_, N>,
        from: &Course<N>,
        (region, gap): (&Region, f64),
    ) -> Option<Found<N>> {
        let (motion, start) = (task.motion, task.start);
        let along = task.spare.unwrap_or_else(SVector::zeros);
        let at = |time: f64| self.state(&from.joints(time), &along);
        let arm = ArmMotion {
            duration: from.duration(),
            at: &at,
            passes: &from.passes(),
            bounds: &self.joint_bounds(region),
            far: region.far(),
            has_spare: task.spare.is_some(),
            rough: gap > task.gap,
            onward: from.seed.as_ref(),
        };
        let poses = self.through(motion, start);
        let mut options = smooth::SmoothOptions::new(motion.tolerance, motion.limits);
        options.gap = gap;
        let smooth::ArmPlan { plan, spare, seed } =
            smooth::plan_for_arm(&poses, &options, &arm).ok()??;
        let spare = spare.map(|spare| NullMotion::given(along, move |t| spare.at(t)));
        let path = SmoothPath::new(plan, motion.tolerance, &poses);
        let followed = self.joints_on(path, start, spare.as_ref()).ok()?;
        let foretold = followed.path.plan.duration();
        let course = self.course_along(&followed).onward(seed, foretold);
        Some(Found { followed, course })
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
}
