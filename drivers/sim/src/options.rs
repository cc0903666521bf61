//! Options of the simulated robot.

use std::path::PathBuf;

use driver_kit::DriverError;
use ipc::Arm;

use crate::Wall;

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
    /// Width of an object between the fingers (m).
    pub object: Option<f64>,
}

impl Default for ToolOptions {
    fn default() -> Self {
        Self {
            opening: 0.2,
            closing: 0.2,
            open: true,
            width: 0.08,
            object: None,
        }
    }
}

/// Options of the simulated robot. Lists have one value per joint.
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
    /// A wall that the tool can press against; it brings sensors.
    pub wall: Option<Wall>,
    /// File for the received setpoints, as CSV.
    pub log: Option<PathBuf>,
    /// What the process asks of the operating system; nothing of it in lock-step.
    pub real_time: scheduling::RealTimeRequest,
}

impl Options {
    /// A robot of `joints` joints in its zero position, with wide ranges, high limits, a gripper
    /// and a tool changer.
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
            wall: None,
            log: None,
            real_time: scheduling::RealTimeRequest {
                priority: 50,
                ..scheduling::RealTimeRequest::default()
            },
        }
    }

    /// Checks the options of the simulation; the kit checks the rest.
    ///
    /// # Errors
    /// [`DriverError::Count`] or [`DriverError::Value`] with the option's name.
    pub fn check(&self) -> Result<(), DriverError> {
        let (found, joints) = (self.position.len(), self.lower.len());
        if found != joints {
            return Err(DriverError::Count {
                option: "position",
                found,
                joints,
            });
        }
        for position in &self.position {
            DriverError::check_value("position", *position, false)?;
        }
        DriverError::check_value("frequency", self.frequency, true)?;
        DriverError::check_value("damping", self.damping, true)?;
        if let Some(wall) = &self.wall {
            wall.check()?;
        }
        DriverError::check_value("noise", self.noise, false)
    }
}
