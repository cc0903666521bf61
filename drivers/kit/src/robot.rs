//! The interface of a robot.

use ipc::{MAX_JOINTS, ToolAction, ToolFeedback, ToolStatus};

use crate::{DriverError, Limiter, Reference};

/// Description of a robot. Lists have one value per joint, root first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// The driver's name.
    pub name: String,
    /// [`ipc::model_hash`] of the robot; 0 is any.
    pub model: u64,
    /// Lower ends of the ranges (rad).
    pub lower: Vec<f64>,
    /// Upper ends of the ranges (rad).
    pub upper: Vec<f64>,
    /// Largest speeds (rad/s).
    pub velocity: Vec<f64>,
    /// Largest accelerations (rad/s²), also of the driver's own stop; setpoints beyond them are
    /// refused.
    pub acceleration: Vec<f64>,
    /// Largest jerks (rad/s³), also of the driver's own stop; the reference that follows setpoints
    /// keeps them.
    pub jerk: Vec<f64>,
}

impl About {
    /// How many joints there are.
    pub fn joints(&self) -> usize {
        self.lower.len()
    }

    /// A limiter a joint.
    pub(crate) fn limiters(&self) -> Vec<Limiter> {
        let limiter = |joint: usize| Limiter {
            range: [self.lower[joint], self.upper[joint]],
            velocity: self.velocity[joint],
            acceleration: self.acceleration[joint],
            jerk: self.jerk[joint],
        };
        (0..self.joints()).map(limiter).collect()
    }

    /// Whether the lists fit together.
    ///
    /// # Errors
    /// [`DriverError::Joints`], [`DriverError::Count`] or [`DriverError::Value`] with the list's
    /// name.
    pub fn check(&self) -> Result<(), DriverError> {
        let joints = self.joints();
        if joints == 0 || joints > MAX_JOINTS {
            return Err(DriverError::Joints {
                joints,
                most: MAX_JOINTS,
            });
        }
        let lists = [
            ("lower", &self.lower, false),
            ("upper", &self.upper, false),
            ("velocity", &self.velocity, true),
            ("acceleration", &self.acceleration, true),
            ("jerk", &self.jerk, true),
        ];
        for (option, list, positive) in lists {
            if list.len() != joints {
                return Err(DriverError::Count {
                    option,
                    found: list.len(),
                    joints,
                });
            }
            for value in list {
                DriverError::check_value(option, *value, positive)?;
            }
        }
        Ok(())
    }
}

/// How one joint is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Position (rad).
    pub position: f64,
    /// Velocity (rad/s).
    pub velocity: f64,
    /// Effort (N m).
    pub effort: f64,
}

impl From<Reference> for Measured {
    /// A joint that is exactly where it shall be.
    fn from(reference: Reference) -> Self {
        Self {
            position: reference.position,
            velocity: reference.velocity,
            effort: 0.0,
        }
    }
}

/// A robot that can be driven. In every period it is measured once, and then gets a reference to
/// follow.
pub trait Robot {
    /// What the robot is like; asked once.
    fn about(&self) -> About;

    /// The present state of the joints, one entry per joint.
    fn measure(&mut self, joints: &mut [Measured]);

    /// Follow this for `period` (s), one entry per joint.
    fn follow(&mut self, joints: &[Reference], period: f64);

    /// Begin an action of a tool: [`ipc::GRIPPER`] or [`ipc::TOOL_CHANGER`].
    fn act(&mut self, _tool: usize, _action: ToolAction) {}

    /// Status of a tool; by default there is none.
    fn tool_status(&self, _tool: usize) -> ToolStatus {
        ToolStatus::Unknown
    }

    /// Further data of a tool; the kit fills in `order`.
    fn tool(&self, tool: usize) -> ToolFeedback {
        ToolFeedback {
            status: self.tool_status(tool) as u32,
            ..ToolFeedback::default()
        }
    }

    /// A fault of the hardware, with the joint from 0 or `u32::MAX`: the driver stops and latches.
    fn fault(&self) -> Option<u32> {
        None
    }
}
