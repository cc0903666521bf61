//! MoveTo: the configuration that is reached soonest, moved to in joint space.

use kinematics::Report;
use nalgebra::{Isometry3, SVector};
use trajectory::otg::{self, Otg};
use trajectory::{Boundary, JointLine, TimingOptions, Trajectory, time_path};

use super::{MotionError, Planner, certificate, stretched};
use crate::task::Move;

/// How many configurations are planned in full, the most promising first.
const TRIED: usize = 4;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_joint(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let pose = motion.poses.first().copied().unwrap_or_default();
        let mut goals = self.configurations(&pose, start)?;
        goals.sort_by(|a, b| self.effort(start, a).total_cmp(&self.effort(start, b)));
        goals.truncate(TRIED);
        let mut best: Option<Trajectory<N>> = None;
        let mut refusal = None;
        for goal in &goals {
            match self.joint_move(motion, start, goal) {
                Ok(found) if best.as_ref().is_none_or(|b| found.duration() < b.duration()) => {
                    best = Some(found);
                }
                Ok(_) => {}
                Err(error) => refusal = Some(error),
            }
        }
        best.ok_or_else(|| refusal.unwrap_or_else(|| MotionError::Timing("no goal".into())))
    }

    /// All known configurations that reach a pose within the joint limits.
    fn configurations(
        &self,
        pose: &Isometry3<f64>,
        start: &SVector<f64, N>,
    ) -> Result<Vec<SVector<f64, N>>, MotionError> {
        let mut goals: Vec<SVector<f64, N>> =
            self.solver.solve_all(pose).iter().map(|branch| branch.q).collect();
        match self.solver.nearest(pose, start) {
            Ok(solution) => goals.push(solution.q),
            Err(report) if goals.is_empty() => return Err(self.refusal(1, &report)),
            Err(_) => {}
        }
        Ok(goals)
    }

    /// Time for the slowest joint at constant velocity, s: cheap, and a good order.
    fn effort(&self, start: &SVector<f64, N>, goal: &SVector<f64, N>) -> f64 {
        (goal - start).abs().component_div(&self.limits.velocity).max()
    }

    fn joint_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let free = self.rest_to_rest(start, goal)?;
        let samples = certificate::tool_samples(self.chain(), &free);
        let peaks = certificate::peaks(&free, &samples, &self.limits, &motion.limits);
        let stretch = peaks.stretch();
        if stretch <= 1.0 {
            return Ok(free);
        }
        // The tool is too fast: either everything slower, or a line in joint
        // space that is slow only where the tool is fast.
        let slow = stretched(&free, stretch);
        match self.timed_line(motion, start, goal) {
            Ok(line) if line.duration() < slow.duration() => Ok(line),
            _ => Ok(slow),
        }
    }

    fn rest_to_rest(
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
        match plan {
            Ok(found) => Ok(found.trajectory()),
            Err(error) => Err(MotionError::Timing(error.to_string())),
        }
    }

    fn timed_line(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let chain = self.chain();
        let tool = |q: &[SVector<f64, N>; 4]| super::cartesian::tool_point(chain, q);
        let line = JointLine::new(*start, *goal, &tool);
        let options =
            TimingOptions { start: Boundary::Rest, end: Boundary::Rest, ..Default::default() };
        time_path(&line, &self.limits, &motion.limits, &options)
            .map(|timed| timed.trajectory)
            .map_err(|error| MotionError::Timing(error.to_string()))
    }

    pub(super) fn refusal(&self, pose: usize, report: &Report<N>) -> MotionError {
        let _ = report;
        MotionError::Unsolved { pose, millimetres: 0.0, degrees: 0.0 }
    }
}
