//! The moves of the language as tasks.

use nalgebra::{Isometry3, Point3};

use super::{Modal, isometry};
use crate::command_error::CommandError;
use crate::task::{JointGoal, JointMove, LegsMove, Move, ScrewMove, Shape, Task};

impl Modal {
    pub(super) fn joints(&self, targets: &[crcl::JointTarget]) -> Result<Task, CommandError> {
        self.settings.tool_limits(&self.maxima)?;
        let goal = |target: &crcl::JointTarget| {
            let index = usize::try_from(target.joint - 1).unwrap_or(usize::MAX);
            let Some(slides) = self.sliding.get(index) else {
                let count = self.sliding.len();
                let message = format!("the robot has joints 1 to {count}, not {}", target.joint);
                return Err(CommandError::range(message));
            };
            let unit = if *slides {
                self.length.metres()
            } else {
                self.angle.radians()
            };
            let told = |value: f64| (value > 0.0).then_some(value * unit);
            Ok(JointGoal {
                joint: index,
                position: target.position * unit,
                speed: told(target.speed),
                acceleration: told(target.acceleration),
            })
        };
        let share = |value: f64, most: f64| (value / most).min(1.0);
        Ok(Task::Joints(JointMove {
            goals: targets.iter().map(goal).collect::<Result<_, _>>()?,
            shares: (
                share(self.settings.speed, self.maxima.speed),
                share(self.settings.acceleration, self.maxima.acceleration),
            ),
            limits: self.maxima,
        }))
    }

    pub(super) fn screw(
        &self,
        screw: &crcl::Screw,
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<Task, CommandError> {
        let frame = self.workstation_from_frame(workstation_from_flange);
        let start = screw.start.as_ref().map(|pose| {
            let frame_from_tool = isometry(pose, self.length, self.angle)?;
            Ok::<_, CommandError>(frame * frame_from_tool)
        });
        let metres = self.length.metres();
        let point = |point: [f64; 3]| frame * Point3::from(point.map(|value| value * metres));
        Ok(Task::Screw(ScrewMove {
            start: start.transpose()?,
            axis_point: screw.axis_point.map(point),
            free: screw.free * metres,
            advance: screw.advance * metres,
            turn: screw.turn * self.angle.radians(),
            limits: self.settings.tool_limits(&self.maxima)?,
        }))
    }

    /// A smooth move; each waypoint has the settings in force, but for those of its own.
    pub(super) fn legs(
        &self,
        waypoints: &[crcl::PoseAndSet],
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<Task, CommandError> {
        let frame = self.workstation_from_frame(workstation_from_flange);
        let (length, angle) = (self.length.metres(), self.angle.radians());
        let (mut poses, mut limits) = (Vec::new(), Vec::new());
        let mut tolerance = f64::INFINITY;
        for (index, waypoint) in waypoints.iter().enumerate() {
            let leg = || {
                let mut settings = self.settings.clone();
                for command in waypoint.settings() {
                    settings.set(&command, length, angle, &self.maxima)?;
                }
                let pose = isometry(&waypoint.pose, self.length, self.angle)?;
                Ok((pose, settings.tool_limits(&self.maxima)?, settings))
            };
            let (pose, limit, settings) =
                leg().map_err(|error| numbered(error, index, waypoints.len()))?;
            poses.push(frame * pose);
            limits.push(limit);
            // The last pose is reached exactly.
            if index + 1 < waypoints.len() {
                tolerance = tolerance.min(settings.intermediate_ball());
            }
        }
        let tolerance = if tolerance.is_finite() {
            tolerance
        } else {
            0.0
        };
        Ok(Task::Legs(LegsMove::new(poses, tolerance, limits)))
    }

    pub(super) fn motion(
        &self,
        shape: Shape,
        poses: &[crcl::Pose],
        workstation_from_flange: &Isometry3<f64>,
    ) -> Result<Task, CommandError> {
        let limits = self.settings.tool_limits(&self.maxima)?;
        let workstation_from_frame = self.workstation_from_frame(workstation_from_flange);
        // A list may be long: no more room than it needs.
        let mut placed = Vec::with_capacity(poses.len());
        for (index, pose) in poses.iter().enumerate() {
            let frame_from_tool = isometry(pose, self.length, self.angle)
                .map_err(|error| numbered(error, index, poses.len()))?;
            placed.push(workstation_from_frame * frame_from_tool);
        }
        let tolerance = self.settings.intermediate_ball();
        Ok(Task::Move(Move {
            shape,
            poses: placed,
            tolerance,
            limits,
        }))
    }
}

fn numbered(mut error: CommandError, index: usize, count: usize) -> CommandError {
    if count > 1 {
        error.message = format!("pose {} of {count}: {}", index + 1, error.message);
    }
    error
}
