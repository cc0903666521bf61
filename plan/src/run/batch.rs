//! Requests of a step: commands for the robot, requests to the factotum.

use crcl::{Command, Pose};
use nalgebra::{Isometry3, Vector3};

use crate::world::{Change, ObjectId};

/// An end effector as the motion needs it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Its name in the world.
    pub name: String,
    /// From the end of the arm to the tip, along the Z axis of the end of the arm (m).
    pub length: f64,
}

impl Tool {
    /// `arm_from_tip` (m).
    #[must_use]
    pub fn arm_from_tip(&self) -> Isometry3<f64> {
        Isometry3::translation(0.0, 0.0, self.length)
    }
}

/// Commands of one step, and their effects on the world when all of them have been executed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// The commands, in metres and radians.
    pub commands: Vec<Command>,
    /// After the command of this position the tool on the arm is this; the controlled point is its
    /// tip, or the end of the arm without a tool.
    pub tools: Vec<(usize, Option<Tool>)>,
    /// Changes of the world, to be committed when all commands have been executed.
    pub changes: Vec<Change>,
}

impl Batch {
    /// Adds a command.
    pub fn push(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// Adds a straight move of the controlled point to a pose (m) in the frame of the workstation.
    pub fn straight(&mut self, pose: &Isometry3<f64>) {
        self.push(Command::MoveStraightTo {
            pose: canonical(pose),
        });
    }

    /// The tool changed with the last command.
    pub fn tool(&mut self, tool: Option<Tool>) {
        self.tools
            .push((self.commands.len().saturating_sub(1), tool));
    }
}

/// Resolution of coordinates in commands, in parts of a metre; smaller amounts are rounding.
const FINEST: f64 = 1e12;

/// A pose as the canonical language writes it: point and two axes.
#[must_use]
pub fn canonical(pose: &Isometry3<f64>) -> Pose {
    // Adding zero turns a negative zero into a positive one.
    let rounded = |v: Vector3<f64>| v.map(|x| (x * FINEST).round() / FINEST + 0.0).into();
    let axis = |axis: Vector3<f64>| rounded(pose.rotation * axis);
    Pose::Axes {
        point: rounded(pose.translation.vector),
        z_axis: axis(Vector3::z()),
        x_axis: axis(Vector3::x()),
    }
}

/// What the factotum is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errand {
    /// Bring an object that meets the requirement.
    Refill,
    /// Take the object away.
    Remove,
    /// Take the object away and bring one that meets the requirement to its place.
    Replace,
}

/// A request to the factotum.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What to do.
    pub errand: Errand,
    /// The object to remove or replace.
    pub object: Option<ObjectId>,
    /// Name of the requirement that the new object meets.
    pub requirement: Option<String>,
    /// The variable that gets the new object, or Null after a removal.
    pub variable: String,
}
