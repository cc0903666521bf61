//! What the simulated robot is like.

use std::path::PathBuf;

use ipc::{Arm, MAX_JOINTS};

use crate::SimError;

/// A gripper or tool changer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolOptions {
    /// How long opening takes (s).
    pub opening: f64,
    /// How long closing takes (s).
    pub closing: f64,
    /// Whether it is open at the start.
    pub open: bool,
    /// Opening when open (m).
    pub width: f64,
}

impl Default for ToolOptions {
    fn default() -> Self {
        Self {
            opening: 0.2,
            closing: 0.2,
            open: true,
            width: 0.08,
        }
    }
}

/// What the simulated robot is like. Lists have one value a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The arm it drives.
    pub arm: Arm,
    /// The driver's name.
    pub name: String,
    /// [`ipc::model_hash`] of the robot; 0 is any.
    pub model: u64,
    /// Positions at the start (rad).
    pub position: Vec<f64>,
    /// Lower ends of the ranges (rad).
    pub lower: Vec<f64>,
    /// Upper ends of the ranges (rad).
    pub upper: Vec<f64>,
    /// Largest speeds (rad/s).
    pub velocity: Vec<f64>,
    /// Accelerations of its own stop (rad/s²).
    pub acceleration: Vec<f64>,
    /// Jerks of its own stop (rad/s³).
    pub jerk: Vec<f64>,
    /// Natural frequency of the servos (rad/s).
    pub frequency: f64,
    /// Damping ratio of the servos.
    pub damping: f64,
    /// Periods by which setpoints come late.
    pub delay: usize,
    /// Amplitude of the noise on measured positions (rad).
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// The gripper.
    pub gripper: Option<ToolOptions>,
    /// The tool changer.
    pub tool_changer: Option<ToolOptions>,
    /// Where to write each setpoint received, as CSV.
    pub log: Option<PathBuf>,
    /// What the process asks of the operating system; nothing of it in lock-step.
    pub urgency: ipc::Urgency,
}

impl Options {
    /// A robot of `joints` joints in its zero position, with room and speed for anything and a
    /// gripper and a tool changer.
    pub fn new(arm: Arm, joints: usize) -> Self {
        Self {
            arm,
            name: "sim".to_owned(),
            model: 0,
            position: vec![0.0; joints],
            lower: vec![-2.0 * std::f64::consts::TAU; joints],
            upper: vec![2.0 * std::f64::consts::TAU; joints],
            velocity: vec![10.0; joints],
            acceleration: vec![20.0; joints],
            jerk: vec![500.0; joints],
            frequency: 300.0,
            damping: 1.0,
            delay: 0,
            noise: 0.0,
            seed: 1,
            gripper: Some(ToolOptions::default()),
            tool_changer: Some(ToolOptions {
                open: false,
                ..ToolOptions::default()
            }),
            log: None,
            urgency: ipc::Urgency {
                priority: 50,
                ..ipc::Urgency::default()
            },
        }
    }

    /// Whether the options fit together.
    ///
    /// # Errors
    /// [`SimError::Joints`], [`SimError::Count`] or [`SimError::Value`] with the option's name.
    pub fn check(&self) -> Result<(), SimError> {
        let joints = self.position.len();
        if joints == 0 || joints > MAX_JOINTS {
            return Err(SimError::Joints {
                joints,
                most: MAX_JOINTS,
            });
        }
        let lists = [
            ("position", &self.position, false),
            ("lower", &self.lower, false),
            ("upper", &self.upper, false),
            ("velocity", &self.velocity, true),
            ("acceleration", &self.acceleration, true),
            ("jerk", &self.jerk, true),
        ];
        for (option, list, positive) in lists {
            if list.len() != joints {
                return Err(SimError::Count {
                    option,
                    found: list.len(),
                    joints,
                });
            }
            for value in list {
                check_value(option, *value, positive)?;
            }
        }
        check_value("frequency", self.frequency, true)?;
        check_value("damping", self.damping, true)?;
        check_value("noise", self.noise, false)
    }
}

fn check_value(option: &'static str, value: f64, positive: bool) -> Result<(), SimError> {
    let wanted = if positive {
        "positive and finite"
    } else {
        "finite"
    };
    if value.is_finite() && (!positive || value > 0.0) {
        Ok(())
    } else {
        Err(SimError::Value {
            option,
            wanted,
            value,
        })
    }
}
