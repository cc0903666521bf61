//! MoveTo: moves in joint space to the configuration that is reached soonest.

use kinematics::{IkFailure, IkReport};
use nalgebra::{Isometry3, SVector};
use trajectory::bounds::JointsToTool;
use trajectory::otg::{self, Otg};
use trajectory::{Boundary, JointLine, JointPoint, TimingOptions, Trajectory, time_path};

use super::certificate::Arm;
use super::{Draft, MotionError, Planner};
use crate::task::Move;

/// How many configurations are planned in full, the most promising first.
const TRIED: usize = 4;
/// Number of values of the free parameter of a seven-joint arm that are tried.
const SWEEP: usize = 48;
/// Configurations of a seven-joint arm count as equal if no joint differs by more, rad.
const ALIKE: f64 = 0.3;
/// Distance from a limit, rad, from which a seven-joint arm can move on well.
const ROOM: f64 = 0.35;
/// Smallest singular value (lengths in units of 0.3 m) from which it can move on well.
const NIMBLE: f64 = 0.15;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_joint(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        let pose = motion.poses.first().copied().unwrap_or_default();
        let mut goals = self.configurations(&pose, start)?;
        goals.sort_by(|a, b| {
            self.time_estimate(start, a)
                .total_cmp(&self.time_estimate(start, b))
        });
        if N > 6 {
            let mut apart: Vec<SVector<f64, N>> = Vec::new();
            for goal in goals {
                if apart.iter().all(|other| (other - goal).amax() > ALIKE) {
                    apart.push(goal);
                }
            }
            goals = apart;
        }
        goals.truncate(TRIED);
        let mut best: Option<(f64, Draft<N>)> = None;
        let mut refusal = None;
        for goal in &goals {
            match self.joint_move(motion, start, goal) {
                Ok(found) => {
                    let time = found.trajectory.duration() / self.ease(goal);
                    if best.as_ref().is_none_or(|(least, _)| time < *least) {
                        best = Some((time, found));
                    }
                }
                Err(error) => refusal = Some(error),
            }
        }
        best.map(|(_, found)| found)
            .ok_or_else(|| refusal.unwrap_or(MotionError::NoWay))
    }

    /// All known configurations that reach a pose within the joint limits.
    fn configurations(
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

    /// Time for the slowest joint at constant velocity, s: quick to compute, and a good order.
    /// Longer for goals from which the arm cannot move on well.
    fn time_estimate(&self, start: &SVector<f64, N>, goal: &SVector<f64, N>) -> f64 {
        let way = (goal - start).abs().component_div(&self.limits.velocity);
        way.max() / self.ease(goal)
    }

    /// How well a seven-joint arm can move on from a configuration: 1 is well, near 0 at a limit or
    /// a singular pose. 1 for other arms.
    fn ease(&self, q: &SVector<f64, N>) -> f64 {
        if N <= 6 {
            return 1.0;
        }
        let chain = self.chain();
        let room = (0..N)
            .map(|i| (chain.upper()[i] - q[i]).min(q[i] - chain.lower()[i]))
            .fold(f64::INFINITY, f64::min);
        let smallest = kinematics::measure::dexterity(chain, q).smallest;
        (room / ROOM).min(smallest / NIMBLE).clamp(1e-3, 1.0)
    }

    /// The fastest motion in joint space that keeps every limit of joints and tool.
    pub(super) fn joint_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Draft<N>, MotionError> {
        let free = self.rest_to_rest(start, goal)?;
        let alone = free.duration();
        let free = self.slowed(Draft::of(free), motion);
        if free.trajectory.duration() <= alone {
            return Ok(free);
        }
        // The tool is too fast: the faster of two is used, the whole motion slowed down, or a line
        // in joint space that is slow only where the tool is fast.
        match self.timed_line(motion, start, goal) {
            Ok(line) => {
                let line = self.slowed(Draft::of(line), motion);
                let faster = line.trajectory.duration() < free.trajectory.duration();
                Ok(if faster { line } else { free })
            }
            Err(_) => Ok(free),
        }
    }

    pub(super) fn rest_to_rest(
        &self,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let plan = Otg::plan(
            &otg::State::rest(*start),
            &otg::State::rest(*goal),
            &otg::Limits::from(&self.limits),
            &otg::Options::default(),
        );
        Ok(Trajectory::new(plan?.pieces()))
    }

    fn timed_line(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let chain = self.chain();
        let tool = |joint: &JointPoint<N>| Arm(chain).motion(joint);
        let line = JointLine::new(*start, *goal, tool);
        let options = TimingOptions {
            start: Boundary::Rest,
            end: Boundary::Rest,
            ..Default::default()
        };
        Ok(time_path(&line, &self.limits, &motion.limits, &options)?.trajectory)
    }

    /// The report of the solver as an error of the command.
    pub(super) fn refusal(&self, pose: usize, report: &IkReport<N>) -> MotionError {
        match report.failure {
            IkFailure::OutOfReach { distance } => MotionError::OutOfReach {
                pose,
                millimetres: distance * 1e3,
            },
            IkFailure::AtLimit { joint, beyond } => MotionError::BeyondLimit {
                pose,
                joint: self.joint_name(joint),
                beyond: self.amount(joint, beyond),
            },
            IkFailure::Orientation { angle } => MotionError::Orientation {
                pose,
                degrees: angle.to_degrees(),
            },
            _ => MotionError::Unsolved {
                pose,
                millimetres: report.position_error * 1e3,
                degrees: report.rotation_error.to_degrees(),
            },
        }
    }
}
