//! MoveTo: moves in joint space to the configuration that is reached soonest.

use kinematics::{IkFailure, IkReport};
use nalgebra::{Isometry3, SVector};

use super::{Draft, MotionError, Planner};
use crate::task::Move;

/// How many configurations of a six-joint arm are compared, the most promising first.
const TRIED: usize = 4;
/// How many more of a seven-joint arm.
const TRIED_REDUNDANT: usize = 12;
/// Number of values of the free parameter of a seven-joint arm that are tried.
const SWEEP: usize = 48;
/// How much the ways of all joints count beside the longest one, so that of equal goals the nearer one comes first.
const OTHERS: f64 = 1e-4;
/// Configurations with no joint farther apart are the same, rad or m.
const SAME: f64 = 1e-6;
/// Configurations of a seven-joint arm count as equal if no joint differs by more, rad.
const ALIKE: f64 = 0.3;
/// Distance from a limit, rad, from which a seven-joint arm can move on well.
const ROOM: f64 = 0.35;
/// Smallest singular value (lengths in units of 0.3 m) from which it can move on well.
const NIMBLE: f64 = 0.15;
/// A seven-joint arm goes to no configuration with less ease, if there is another.
const EASY: f64 = 0.25;

/// Adds goals to those chosen, up to a number, if a joint differs enough from all others.
fn apart<const N: usize>(
    mut chosen: Vec<SVector<f64, N>>,
    goals: impl Iterator<Item = SVector<f64, N>>,
    (most, least): (usize, f64),
) -> Vec<SVector<f64, N>> {
    for goal in goals {
        if chosen.len() >= most {
            break;
        }
        if chosen.iter().all(|other| (other - goal).amax() > least) {
            chosen.push(goal);
        }
    }
    chosen
}

impl<const N: usize> Planner<N> {
    pub(super) fn plan_joint(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        let pose = motion.poses.first().copied().unwrap_or_default();
        let goals = self.configurations(&pose, start)?;
        if N > 6 {
            let (goals, sure) = self.easy(goals, motion, start);
            return self.soonest(motion, start, &goals, sure);
        }
        let goals = self.promising(goals, start);
        self.soonest(motion, start, &goals, goals.len())
    }

    /// The goals that need the least time at constant velocity, each once.
    pub(super) fn promising(
        &self,
        mut goals: Vec<SVector<f64, N>>,
        start: &SVector<f64, N>,
    ) -> Vec<SVector<f64, N>> {
        let least = |goal: &SVector<f64, N>| {
            let way = (goal - start).abs().component_div(&self.limits.velocity);
            way.max() + OTHERS * way.sum()
        };
        goals.sort_by(|a, b| least(a).total_cmp(&least(b)));
        apart(Vec::new(), goals.into_iter(), (TRIED, SAME))
    }

    /// First the goals with the least time at constant velocity for their ease, and their number;
    /// then those with enough ease that need the least time, by a lower bound. Of goals that are
    /// alike, the first.
    fn easy(
        &self,
        goals: Vec<SVector<f64, N>>,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> (Vec<SVector<f64, N>>, usize) {
        let rated = goals.into_iter().map(|goal| {
            let way = (goal - start).abs().component_div(&self.limits.velocity);
            let ease = self.ease(&goal);
            (way.max() / ease, ease, goal)
        });
        let mut rated: Vec<(f64, f64, SVector<f64, N>)> = rated.collect();
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all = rated.iter().map(|(_, _, goal)| *goal);
        let mut chosen = apart(Vec::new(), all, (TRIED, ALIKE));
        let sure = chosen.len();
        let most = |goal: &SVector<f64, N>| self.ease(goal);
        let enough = chosen.iter().map(most).fold(EASY, f64::min);
        rated.retain(|(_, ease, _)| *ease >= enough);
        for (least, _, goal) in &mut rated {
            *least = self.least_of_line(start, goal, &motion.limits);
        }
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all = rated.into_iter().map(|(_, _, goal)| goal);
        chosen = apart(chosen, all, (TRIED + TRIED_REDUNDANT, 0.5 * ALIKE));
        (chosen, sure)
    }

    /// All known configurations that reach a pose within the joint limits.
    pub(super) fn configurations(
        &self,
        pose: &Isometry3<f64>,
        start: &SVector<f64, N>,
    ) -> Result<Vec<SVector<f64, N>>, MotionError> {
        let mut goals: Vec<SVector<f64, N>> = self
            .solver
            .solve_all(pose)
            .iter()
            .map(|branch| branch.q)
            .collect();
        match self.solver.nearest(pose, start) {
            Ok(solution) => goals.push(solution.q),
            Err(report) if goals.is_empty() => return Err(self.refusal(1, &report)),
            Err(_) => {}
        }
        if N > 6 {
            for parameter in self.solver.parameters(SWEEP) {
                let branches = self.solver.solve_all_at(pose, parameter, start);
                goals.extend(branches.iter().map(|branch| branch.q));
            }
        }
        Ok(goals)
    }

    /// How well a seven-joint arm can move on from a configuration: 1 is well, near 0 at a limit or
    /// a singular pose.
    fn ease(&self, q: &SVector<f64, N>) -> f64 {
        self.ease_within(q, [ROOM, NIMBLE]).max(1e-3)
    }

    /// The same where 1 is a distance from each limit (rad, m) and a smallest singular value, and less than 0 beyond a limit.
    pub(super) fn ease_within(&self, q: &SVector<f64, N>, [well, nimble]: [f64; 2]) -> f64 {
        let chain = self.chain();
        let room = (0..N)
            .map(|i| chain.room(i, q[i]))
            .fold(f64::INFINITY, f64::min);
        let smallest = kinematics::measure::dexterity(chain, q).smallest;
        (room / well).min(smallest / nimble).min(1.0)
    }

    /// The fastest motion in joint space that keeps every limit of joints and tool.
    pub(super) fn joint_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        self.soonest(motion, start, &[*goal], 1)
    }

    /// The report of the solver as an error of the command.
    pub(super) fn refusal(&self, pose: usize, report: &IkReport<N>) -> MotionError {
        let unsolved = MotionError::Unsolved {
            pose,
            millimetres: report.position_error * 1e3,
            degrees: report.rotation_error.to_degrees(),
        };
        match report.failure {
            IkFailure::AtLimit { joint, beyond } => MotionError::BeyondLimit {
                pose,
                joint: self.joint_name(joint),
                beyond: self.amount(joint, beyond),
            },
            failure => Self::out_of_reach(pose, failure).unwrap_or(unsolved),
        }
    }

    /// The error of the command where a pose is out of reach, in place or orientation; `None` for other failures.
    pub(super) fn out_of_reach(pose: usize, failure: IkFailure) -> Option<MotionError> {
        match failure {
            IkFailure::OutOfReach { distance } => Some(MotionError::OutOfReach {
                pose,
                millimetres: distance * 1e3,
            }),
            IkFailure::Orientation { angle } => Some(MotionError::Orientation {
                pose,
                degrees: angle.to_degrees(),
            }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest solution is one of all solutions too; no configuration is compared twice.
    #[test]
    fn no_configuration_is_promising_twice() {
        let robot = crate::robot::load("ur5e").unwrap();
        let planner = Planner::<6>::new(
            &robot.chain().unwrap(),
            Isometry3::identity(),
            robot.joint_limits(),
            robot.joint_names(),
        );
        let home = SVector::from_column_slice(&robot.home);
        let mut compared = 0;
        for i in 0..40 {
            let turn = |j: usize| 0.4 * (f64::from(i) * (1.3 + 0.7 * j as f64)).sin();
            let start = home + SVector::from_fn(|j, _| turn(j));
            let end = home + SVector::from_fn(|j, _| turn(j + 6));
            let pose = planner.chain().forward(&end);
            let goals = planner.configurations(&pose, &start).unwrap();
            let goals = planner.promising(goals, &start);
            for (k, goal) in goals.iter().enumerate() {
                let twice = goals[..k].iter().any(|other| (other - goal).amax() < 1e-3);
                assert!(!twice, "{i}: {goals:?}");
            }
            compared += goals.len();
        }
        assert!(compared > 80, "{compared}");
    }
}
