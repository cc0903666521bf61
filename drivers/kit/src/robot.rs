//! The interface of a robot.

use ipc::{MAX_JOINTS, Payload, ToolCommand, ToolFeedback, ToolStatus};

use crate::{
    Command, DriverError, EndSpeeds, Inputs, Limiter, Measured, Measurement, Outputs, RobotFault,
    Sensors,
};

/// Description of a robot. Lists have one value per joint, root first.
#[derive(Clone, Debug, PartialEq)]
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
    /// Less speed near the ends of the range, if the arm asks for it: references and stops keep it.
    pub end_speeds: Option<EndSpeeds>,
    /// Whether it can be driven in lock-step: simulations can, a real arm cannot.
    pub lock_step: bool,
    /// The shortest and the longest period that it can serve (ns).
    pub periods_ns: [u64; 2],
    /// Whether the arm's controller has a clock of its own and reads the references at its own
    /// times: then each period has its reference, also those that the driver slept through.
    pub own_clock: bool,
    /// Whether it is a real arm or a maker's controller, and not a simulation of ours.
    pub real: bool,
    /// How late the arm is behind the setpoints, by the driver's own delay (ns).
    pub delay_ns: u64,
}

impl Default for About {
    /// No joints; every clock and period.
    fn default() -> Self {
        Self {
            name: String::new(),
            model: 0,
            lower: Vec::new(),
            upper: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
            jerk: Vec::new(),
            end_speeds: None,
            lock_step: true,
            periods_ns: [100_000, 1_000_000_000],
            own_clock: false,
            real: false,
            delay_ns: 0,
        }
    }
}

impl About {
    /// How many joints there are.
    pub fn joints(&self) -> usize {
        self.lower.len()
    }

    /// Whether there are as many joints as a controller drives.
    ///
    /// # Errors
    /// [`DriverError::Count`].
    pub fn check_joints(&self, joints: usize) -> Result<(), DriverError> {
        let found = self.joints();
        if found == joints {
            return Ok(());
        }
        Err(DriverError::Count {
            option: "joints",
            found,
            joints,
        })
    }

    /// The largest speed (rad/s) of a joint at a position (rad) in the direction of `velocity`.
    pub(crate) fn speed(&self, joint: usize, position: f64, velocity: f64) -> f64 {
        let most = self.velocity[joint];
        let Some(ends) = &self.end_speeds else {
            return most;
        };
        let near = ends.of(joint);
        most.min(if velocity < 0.0 {
            near.mirrored().upwards(-position)
        } else {
            near.upwards(position)
        })
    }

    /// A limiter a joint.
    pub(crate) fn limiters(&self) -> Vec<Limiter> {
        let limiter = |joint: usize| Limiter {
            range: [self.lower[joint], self.upper[joint]],
            velocity: self.velocity[joint],
            acceleration: self.acceleration[joint],
            jerk: self.jerk[joint],
            near_ends: self.end_speeds.as_ref().map(|ends| ends.of(joint)),
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
        let mut lists = vec![
            ("lower", &self.lower, false),
            ("upper", &self.upper, false),
            ("velocity", &self.velocity, true),
            ("acceleration", &self.acceleration, true),
            ("jerk", &self.jerk, true),
        ];
        if let Some(ends) = &self.end_speeds {
            lists.extend([
                ("end_speeds.lower", &ends.lower, false),
                ("end_speeds.upper", &ends.upper, false),
                ("end_speeds.deceleration", &ends.deceleration, true),
                ("end_speeds.offset", &ends.offset, false),
            ]);
        }
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

/// Whether an arm can be moved now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// It follows from now on.
    Ready,
    /// It is getting ready: what it waits for, in a few words. The kit asks again.
    Wait(String),
    /// It cannot be moved: the reason, and what the operator must do.
    NotReady(String),
}

/// A robot that can be driven. In every period it is measured once, and then gets a reference to
/// follow. No function may wait: what takes time is begun here and done in a thread of the robot's
/// own.
pub trait Robot {
    /// What the robot is like; asked once.
    fn about(&self) -> About;

    /// An engine wants to move the arm: switch on, open brakes, clear errors. It is the operator's
    /// word: an engine asks at its start and after `canter recover`. Asked again and again until
    /// the answer is not [`Readiness::Wait`], and again where a session follows another.
    fn begin(&mut self) -> Readiness {
        Readiness::Ready
    }

    /// No engine moves the arm any more: what [`Robot::begin`] began is ended.
    fn end(&mut self) {}

    /// The last known state of the joints, one entry per joint, and when it was measured.
    fn measure(&mut self, joints: &mut [Measured]) -> Measurement;

    /// What the arm's own controller commands now (rad), one entry per joint; returns whether it
    /// says so. A motion must begin exactly there.
    fn commanded(&self, _joints: &mut [f64]) -> bool {
        false
    }

    /// Follow this.
    fn follow(&mut self, command: &Command<'_>);

    /// Share of the planned speed that the arm asks for, 0..=1: the engine slows down along the
    /// path.
    fn speed_scaling(&self) -> f64 {
        1.0
    }

    /// Begin an order to a tool: [`ipc::GRIPPER`] or [`ipc::TOOL_CHANGER`].
    fn act(&mut self, _tool: usize, _order: &ToolCommand) {}

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

    /// The arm carries something else now.
    fn carry(&mut self, _payload: &Payload) {}

    /// Set outputs; called when one changes.
    fn set_outputs(&mut self, _outputs: &Outputs) {}

    /// The present inputs.
    fn inputs(&self) -> Inputs {
        Inputs::default()
    }

    /// The present values of sensors: force, torque, distance.
    fn sensors(&self, _sensors: &mut Sensors) {}

    /// A fault of the hardware, as long as it lasts: the driver stops and latches, and the
    /// references follow the measured arm.
    fn fault(&self) -> Option<RobotFault> {
        None
    }
}
