//! A simulated motion that only computes times, by a simple model.

use crcl::{Command, Pose};
use nalgebra::Isometry3;

use super::batch::Batch;
use super::motion::{Motion, MotionFailure, Situation};
use crate::world::from_axes;

/// Times of moves with trapezoidal speed, independent of the arm. For dry runs without a robot
/// description, and for tests.
///
/// # Source
/// Rest to rest over a distance `d` at speed at most `v` and acceleration `a`: `d/v + v/a` where
/// the speed is reached (`d >= v²/a`), else `2 sqrt(d/a)`.
#[derive(Clone, Debug)]
pub struct SimulatedMotion {
    /// Speed of the controlled point (m/s).
    pub speed: f64,
    /// Acceleration of the controlled point (m/s²).
    pub acceleration: f64,
    /// Speed of rotation (rad/s).
    pub angular_speed: f64,
    /// Acceleration of rotation (rad/s²).
    pub angular_acceleration: f64,
    /// Time to open or close a gripper or tool changer (s).
    pub gripper: f64,
    /// Commands that fail, counted from 0 over the whole run.
    pub failures: Vec<usize>,
    /// Number of commands executed so far.
    pub executed: usize,
    /// Reach of the arm: every commanded point must be within this distance (m) of the origin.
    pub reach: Option<f64>,
}

impl Default for SimulatedMotion {
    fn default() -> Self {
        Self {
            speed: 0.25,
            acceleration: 1.0,
            angular_speed: 1.0,
            angular_acceleration: 4.0,
            gripper: 0.2,
            failures: Vec::new(),
            executed: 0,
            reach: None,
        }
    }
}

fn rest_to_rest(distance: f64, speed: f64, acceleration: f64) -> f64 {
    if distance * acceleration >= speed * speed {
        distance / speed + speed / acceleration
    } else {
        2.0 * (distance / acceleration).sqrt()
    }
}

impl SimulatedMotion {
    fn time(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
        let difference = from.inv_mul(to);
        let line = rest_to_rest(
            difference.translation.vector.norm(),
            self.speed,
            self.acceleration,
        );
        let angle = difference.rotation.angle();
        line.max(rest_to_rest(
            angle,
            self.angular_speed,
            self.angular_acceleration,
        ))
    }

    fn target(&self, pose: &Pose, command: usize) -> Result<Isometry3<f64>, MotionFailure> {
        let Pose::Axes {
            point,
            z_axis,
            x_axis,
        } = pose
        else {
            let reason = "a pose without axes";
            return Err(MotionFailure::new(command, reason));
        };
        let pose = from_axes(*point, *x_axis, *z_axis)
            .map_err(|reason| MotionFailure::new(command, reason))?;
        let distance = pose.translation.vector.norm();
        match self.reach {
            Some(reach) if distance > reach => {
                let reason = format!("{point:?} is {distance:.3} m away, the reach is {reach} m");
                Err(MotionFailure::new(command, reason))
            }
            _ => Ok(pose),
        }
    }
}

impl Motion for SimulatedMotion {
    fn arm(&mut self) -> Option<Isometry3<f64>> {
        None
    }

    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let seconds = self.predict(start, batch)?;
        let range = self.executed..self.executed + batch.commands.len();
        if let Some(failure) = self.failures.iter().position(|at| range.contains(at)) {
            let at = self.failures.remove(failure);
            self.executed = range.end;
            let command = at - range.start;
            return Err(MotionFailure::new(command, "the arm was made to fail here"));
        }
        self.executed = range.end;
        Ok(seconds)
    }

    fn predict(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let mut tool = start.tool.clone();
        let tip = |arm: &Isometry3<f64>, tool: &Option<super::batch::Tool>| {
            tool.as_ref().map_or(*arm, |tool| arm * tool.arm_from_tip())
        };
        let mut at = tip(&start.arm, &tool);
        let mut seconds = 0.0;
        for (index, command) in batch.commands.iter().enumerate() {
            match command {
                Command::MoveTo { pose } | Command::MoveStraightTo { pose } => {
                    let target = self.target(pose, index)?;
                    seconds += self.time(&at, &target);
                    at = target;
                }
                Command::OpenGripper
                | Command::CloseGripper
                | Command::OpenToolChanger
                | Command::CloseToolChanger => seconds += self.gripper,
                Command::Dwell { seconds: time } => seconds += time,
                _ => {}
            }
            if let Some((_, changed)) = batch.tools.iter().find(|(after, _)| *after == index) {
                let arm = tool
                    .as_ref()
                    .map_or(at, |tool| at * tool.arm_from_tip().inverse());
                tool.clone_from(changed);
                at = tip(&arm, &tool);
            }
        }
        Ok(seconds)
    }

    fn recover(&mut self) -> bool {
        true
    }
}
