//! The engine's ends: what is asked of it and what it says.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crcl::{Command, Program, json};
use ipc::{Arm, Client, IpcError, Observer, State, ToolStatus, Verb};
use serde_json::Value;

use crate::cell::{Largest, Picture, Settings};
use crate::sensing::{Sensors, Tripped};

/// How long an engine may take to answer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(2);

/// What an engine said about itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    /// `unready`, `ready` or `ended`.
    pub(crate) state: String,
    /// Whether nothing is left to do.
    pub(crate) idle: bool,
    /// The latched fault, if any.
    pub(crate) fault: Option<String>,
    /// Number of the last note.
    pub(crate) last_note: u64,
    pub(crate) picture: Picture,
}

/// One thing that happened to commands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Happened {
    Done { id: u64 },
    Refused { id: u64, why: String },
    Guarded { id: u64, tripped: Tripped },
    Faulted(String),
    Closed,
}

/// A connection to an engine; it stays in the thread that opened it.
pub(crate) struct Engine {
    client: Client,
    observer: Observer,
    state: Option<State>,
    seen: u64,
}

impl Engine {
    /// Opens the channels of an arm's engine.
    ///
    /// # Errors
    /// Everything that can go wrong with shared memory.
    pub(crate) fn open(arm: &Arm) -> Result<Self, IpcError> {
        Ok(Self {
            client: Client::open(arm, "canter serve crcl")?,
            observer: Observer::open(arm)?,
            state: None,
            seen: 0,
        })
    }

    /// Asks; a refusal is the engine's sentence.
    fn ask(&self, verb: Verb) -> Result<Value, String> {
        match self.client.ask(verb, PATIENCE) {
            Ok(answer) if answer.accepted => Ok(answer.body),
            Ok(answer) => Err(answer.message),
            Err(error) => Err(error.to_string()),
        }
    }

    /// How the arm is.
    ///
    /// # Errors
    /// The sentence of an engine that refuses, or why there is no answer.
    pub(crate) fn report(&mut self) -> Result<Report, String> {
        while let Some(state) = self.observer.next_state() {
            self.state = Some(state);
        }
        let body = self.ask(Verb::Status)?;
        let status = &body["status"];
        let settings = &status["settings"];
        let joints = numbers(&status["joints"]);
        let state = self.state.filter(|state| state.check(joints.len()).is_ok());
        let part = |all: &dyn Fn(&State) -> Vec<f64>| {
            let all = state.as_ref().map(all).unwrap_or_default();
            all.into_iter().take(joints.len()).collect::<Vec<_>>()
        };
        let picture = Picture {
            setpoint: numbers(&status["setpoint"]),
            velocities: part(&|state| state.velocity.to_vec()),
            efforts: part(&|state| state.effort.to_vec()),
            sliding: flags(&status["sliding"]),
            position: array(&status["position_m"]),
            orientation: array(&status["orientation_wxyz"]),
            settings: Settings {
                speed: settings["speed"].as_f64().unwrap_or(0.0),
                acceleration: settings["acceleration"].as_f64().unwrap_or(0.0),
                intermediate_point: settings["intermediate_point"].as_f64().unwrap_or(0.0),
                end_point: settings["end_point"].as_f64().unwrap_or(0.0),
            },
            largest: largest(&status["largest"]),
            gripper: state.as_ref().and_then(opening),
            sensors: state.as_ref().map(sensors).unwrap_or_default(),
            joints,
        };
        Ok(Report {
            state: status["state"].as_str().unwrap_or_default().to_owned(),
            idle: status["idle"].as_bool().unwrap_or(false),
            fault: status["fault"].as_str().map(str::to_owned),
            last_note: body["last_note"].as_u64().unwrap_or(0),
            picture,
        })
    }

    /// Forgets what happened before.
    pub(crate) fn begin_after(&mut self, note: u64) {
        self.seen = note;
    }

    /// What happened since the last call, as far as one answer tells.
    ///
    /// # Errors
    /// As [`Self::report`].
    pub(crate) fn happened(&mut self) -> Result<Vec<Happened>, String> {
        let body = self.ask(Verb::Notes { since: self.seen })?;
        let mut found = Vec::new();
        for entry in body["notes"].as_array().into_iter().flatten() {
            self.seen = entry["number"].as_u64().unwrap_or(self.seen);
            found.extend(happened(&entry["note"]));
        }
        Ok(found)
    }

    /// Gives commands to the engine; gives the number of the last.
    ///
    /// # Errors
    /// As [`Self::report`].
    pub(crate) fn submit(&self, commands: &[Command]) -> Result<u64, String> {
        let (format, name, program) = document(commands);
        last(&self.ask(Verb::Submit {
            format,
            name,
            program,
        })?)
    }

    /// Has a move take the place of the one that moves; gives the number of the last command.
    ///
    /// # Errors
    /// As [`Self::report`]: the move under way goes on.
    pub(crate) fn replace(&self, commands: &[Command]) -> Result<u64, String> {
        let (format, name, program) = document(commands);
        last(&self.ask(Verb::Replace {
            format,
            name,
            program,
        })?)
    }
}

/// Commands as the engine reads them: format, name, program.
fn document(commands: &[Command]) -> (String, String, String) {
    let program: Program = commands.iter().cloned().collect();
    let program = json::write(&program);
    ("json".to_owned(), "crcl".to_owned(), program)
}

/// The number of the last command that was taken.
fn last(body: &Value) -> Result<u64, String> {
    let last = body["last"].as_u64();
    last.ok_or_else(|| "the engine did not number the command".to_owned())
}

fn happened(note: &Value) -> Option<Happened> {
    let id = || note["id"].as_u64().unwrap_or(0);
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    match note["event"].as_str()? {
        "done" => Some(Happened::Done { id: id() }),
        "refused" => Some(Happened::Refused {
            id: id(),
            why: text(&note["error"]["message"]),
        }),
        "guarded" => Some(Happened::Guarded {
            id: id(),
            tripped: Tripped {
                sensor: text(&note["sensor"]),
                value: note["value"].as_f64().unwrap_or(0.0),
                stop_s: note["stop_s"].as_f64().unwrap_or(0.0),
                position: array(&note["position_m"]),
                orientation: array(&note["orientation_wxyz"]),
                sentence: text(&note["message"]),
            },
        }),
        "faulted" => Some(Happened::Faulted(text(&note["reason"]))),
        "closed" => Some(Happened::Closed),
        _ => None,
    }
}

/// What the sensors of a state say.
fn sensors(state: &State) -> Sensors {
    let used = state.sensors.iter().take(state.sensor_count as usize);
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let now = now.map_or(0, |since| since.as_millis());
    Sensors {
        values: used.map(|sensor| (sensor.text(), sensor.value)).collect(),
        digital: state.digital_inputs,
        count: state.sequence,
        read_ms: i64::try_from(now).unwrap_or(i64::MAX),
    }
}

/// How far the gripper is open (m), if there is one.
fn opening(state: &State) -> Option<f64> {
    let gripper = state.tools.get(ipc::GRIPPER)?;
    match ToolStatus::from_number(gripper.status)? {
        ToolStatus::Unknown => None,
        _ => Some(gripper.position),
    }
}

/// What the robot can do; what is not there, or null, is not limited.
fn largest(value: &Value) -> Largest {
    let part = |name: &str| value[name].as_f64().unwrap_or(f64::INFINITY);
    Largest {
        speed: part("speed"),
        acceleration: part("acceleration"),
        rot_speed: part("rot_speed"),
        rot_accel: part("rot_accel"),
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().into_iter().flatten();
    list.map(|number| number.as_f64().unwrap_or(0.0)).collect()
}

fn flags(value: &Value) -> Vec<bool> {
    let list = value.as_array().into_iter().flatten();
    list.map(|flag| flag.as_bool().unwrap_or(false)).collect()
}

fn array<const N: usize>(value: &Value) -> [f64; N] {
    let mut array = [0.0; N];
    for (place, number) in array.iter_mut().zip(numbers(value)) {
        *place = number;
    }
    array
}
