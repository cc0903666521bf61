//! What all connections share: the last command, and a picture of the arm.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crcl::Command;
use crcl::xml::{CommandState, Instance, ProgramPlace};

use crate::parameters::Parameters;
use crate::sensing::{Guards, Sensors};

/// Number of a connection, from 1.
pub(crate) type ConnectionId = u64;

/// The last command and how far it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Last {
    pub(crate) id: i64,
    pub(crate) name: Option<String>,
    pub(crate) place: ProgramPlace,
    pub(crate) state: CommandState,
    pub(crate) description: Option<String>,
}

impl Last {
    /// A command that has just come.
    pub(crate) fn new(instance: &Instance, state: CommandState) -> Self {
        Self {
            id: instance.instruction.id,
            name: instance.instruction.name.clone(),
            place: instance.place.clone(),
            state,
            description: None,
        }
    }
}

/// The settings in force, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Settings {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    pub(crate) intermediate_point: f64,
    pub(crate) end_point: f64,
}

/// The largest values that settings can have on this robot, SI; infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Largest {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    pub(crate) rot_speed: f64,
    pub(crate) rot_accel: f64,
}

impl Default for Largest {
    fn default() -> Self {
        Self {
            speed: f64::INFINITY,
            acceleration: f64::INFINITY,
            rot_speed: f64::INFINITY,
            rot_accel: f64::INFINITY,
        }
    }
}

impl Largest {
    /// The command with a speed or acceleration that the robot can reach: in CRCL these are
    /// targets, and clients ask for more than an arm can do.
    pub(crate) fn cap(&self, command: Command) -> Command {
        use Command as C;
        let capped = |value: &mut Option<f64>, most: f64| {
            *value = value.map(|value| value.min(most));
        };
        match command {
            C::MoveThroughWaypoints { mut waypoints } => {
                for waypoint in &mut waypoints {
                    capped(&mut waypoint.speed, self.speed);
                    capped(&mut waypoint.acceleration, self.acceleration);
                    capped(&mut waypoint.rot_speed, self.rot_speed);
                    capped(&mut waypoint.rot_accel, self.rot_accel);
                }
                C::MoveThroughWaypoints { waypoints }
            }
            C::SetAbsoluteSpeed { value } => C::SetAbsoluteSpeed {
                value: value.min(self.speed),
            },
            C::SetAbsoluteAcceleration { value } => C::SetAbsoluteAcceleration {
                value: value.min(self.acceleration),
            },
            C::SetAbsoluteRotSpeed { value } => C::SetAbsoluteRotSpeed {
                value: value.min(self.rot_speed),
            },
            C::SetAbsoluteRotAccel { value } => C::SetAbsoluteRotAccel {
                value: value.min(self.rot_accel),
            },
            other => other,
        }
    }
}

/// How the arm is: SI units, workstation frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Picture {
    /// Measured joint positions (rad, m).
    pub(crate) joints: Vec<f64>,
    /// Joint positions of the last setpoint (rad, m).
    pub(crate) setpoint: Vec<f64>,
    /// Measured joint velocities (rad/s, m/s); empty where the driver does not say.
    pub(crate) velocities: Vec<f64>,
    /// Measured joint torques or forces (N m, N); empty where the driver does not say.
    pub(crate) efforts: Vec<f64>,
    /// Whether each joint slides.
    pub(crate) sliding: Vec<bool>,
    /// Measured position of the controlled point (m).
    pub(crate) position: [f64; 3],
    /// Its orientation: w, x, y, z.
    pub(crate) orientation: [f64; 4],
    /// Settings in force.
    pub(crate) settings: Settings,
    /// What the robot can do.
    pub(crate) largest: Largest,
    /// The gripper: whether it holds or is open is not known; how far it is open (m).
    pub(crate) gripper: Option<f64>,
    /// What the sensors say.
    pub(crate) sensors: Sensors,
}

/// What is behind the lock.
#[derive(Debug, Default)]
pub(crate) struct Inner {
    pub(crate) last: Last,
    /// Grows with each command that changes `last`; an answer to an older one is dropped.
    pub(crate) serial: u64,
    /// Who gave the last command.
    pub(crate) owner: ConnectionId,
    /// Grows with each stop: what was asked for before it is not executed any more.
    pub(crate) epoch: u64,
    /// Whether InitCanon was given, and EndCanon not since.
    pub(crate) initialised: bool,
    /// Why every command is refused until InitCanon.
    pub(crate) failed: Option<String>,
    /// The last ConfigureStatusReport and who gave it.
    pub(crate) configured: Option<(i64, ConnectionId)>,
    /// What clients have set.
    pub(crate) parameters: Parameters,
    /// The guards of the last command.
    pub(crate) guards: Guards,
    pub(crate) picture: Picture,
    status: i64,
}

impl Inner {
    /// Puts a command in force that `owner` has given; gives its serial number.
    pub(crate) fn begin(&mut self, owner: ConnectionId, last: Last) -> u64 {
        self.last = last;
        self.owner = owner;
        self.serial += 1;
        self.serial
    }

    /// Ends the command of that number, unless another has taken its place.
    pub(crate) fn finish(&mut self, serial: u64, state: CommandState, why: Option<String>) {
        if serial == self.serial {
            self.last.state = state;
            self.last.description = why;
        }
    }

    /// Ends the command with an error; every later one is refused until InitCanon.
    pub(crate) fn fail(&mut self, serial: u64, why: &str) {
        self.failed = Some(why.to_owned());
        self.finish(serial, CommandState::Error, Some(why.to_owned()));
    }

    /// The next number of a status.
    pub(crate) fn next_status(&mut self) -> i64 {
        self.status += 1;
        self.status
    }

    /// Whether a command is under way.
    pub(crate) fn is_working(&self) -> bool {
        self.last.state == CommandState::Working
    }
}

/// The shared state of all connections.
#[derive(Debug, Default)]
pub(crate) struct Cell(Mutex<Inner>);

impl Cell {
    /// The state, for a few instructions.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
