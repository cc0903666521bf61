//! A recorded run compared with the same program executed again, bit by bit.

use core::fmt;
use std::collections::HashMap;
use std::io;
use std::time::{Duration, Instant};

use recorder::Sample;

use crate::run_loop::Operator;
use crate::session::{Note, RunSample, Session};
use crate::texts::GivenProgram;

/// The operator of a repetition: keeps every period, and ends a run that publishes none for too
/// long.
#[derive(Debug)]
pub struct RepetitionOperator {
    samples: Vec<RunSample>,
    heard: Instant,
    patience: Duration,
}

impl RepetitionOperator {
    /// An operator who ends the run after `patience` without a period.
    #[must_use]
    pub fn new(patience: Duration) -> Self {
        Self {
            samples: Vec::new(),
            heard: Instant::now(),
            patience,
        }
    }

    /// The periods of the run, oldest first.
    #[must_use]
    pub fn into_samples(self) -> Vec<RunSample> {
        self.samples
    }
}

impl Operator for RepetitionOperator {
    fn observe(&mut self, samples: &[RunSample], _session: &Session) -> io::Result<()> {
        if !samples.is_empty() {
            self.heard = Instant::now();
        }
        self.samples.extend_from_slice(samples);
        Ok(())
    }

    fn hear(&mut self, _note: &Note) {}

    fn has_stopped(&self, _session: &Session) -> bool {
        self.heard.elapsed() > self.patience
    }
}

/// What a comparison found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Periods with equal numbers, before the first difference.
    pub equal: usize,
    /// Periods that cannot be compared: the run was under an override, a pause or a stop, and its
    /// command is at other times of its path from then on.
    pub altered: usize,
    /// The first difference.
    pub difference: Option<Difference>,
}

/// A recorded period that is another one now.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Number of the command in its program, from 1.
    pub command: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// The recorded servo period.
    pub tick: u64,
    /// What is different.
    pub what: Deviation,
}

/// What is different in a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deviation {
    /// The run does not come to this time of the command.
    NoCounterpart,
    /// A number of a joint.
    Number {
        /// `position`, `velocity` or `acceleration`.
        quantity: &'static str,
        /// The joint, from 1.
        joint: usize,
        /// The number in the recording.
        recorded: f64,
        /// The number now.
        now: f64,
    },
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            command,
            path_time,
            tick,
            what,
        } = self;
        write!(f, "command {command} at {path_time} s (period {tick}): ")?;
        match what {
            Deviation::NoCounterpart => f.write_str("it does not come to this time"),
            Deviation::Number {
                quantity,
                joint,
                recorded,
                now,
            } => write!(
                f,
                "{quantity} of joint {joint}: recorded {recorded}, now {now}"
            ),
        }
    }
}

/// A time in a program: number of the command from 0, and the planned time in it as bits.
type ProgramTime = (u32, u64);

/// Compares the recorded periods of a program with those of its repetition, for the first `joints`
/// joints.
#[must_use]
pub fn compare(
    recorded: &[Sample],
    again: &[RunSample],
    given: &GivenProgram,
    joints: usize,
) -> Comparison {
    let made: HashMap<ProgramTime, &RunSample> = again
        .iter()
        .filter(|sample| sample.path_time > 0.0 && sample.command > 0)
        .map(|sample| ((sample.command - 1, sample.path_time.to_bits()), sample))
        .collect();
    let mut found = Comparison::default();
    let mut altered = None;
    for sample in recorded {
        if sample.path_time <= 0.0 || sample.command < given.first {
            continue;
        }
        let command = sample.command - given.first;
        // A command that was slowed down once is at other places of its path from then on.
        if sample.time_scaling.to_bits() != 1.0_f64.to_bits() && sample.time_scaling > 0.0 {
            altered = Some(command);
        }
        if altered == Some(command) {
            found.altered += 1;
            continue;
        }
        let what = match made.get(&(command, sample.path_time.to_bits())) {
            Some(made) => first_difference(sample, made, joints),
            None => Some(Deviation::NoCounterpart),
        };
        if let Some(what) = what {
            found.difference = Some(Difference {
                command: command + 1,
                path_time: sample.path_time,
                tick: sample.tick,
                what,
            });
            return found;
        }
        found.equal += 1;
    }
    found
}

/// The first number of a period that is another one now.
fn first_difference(recorded: &Sample, made: &RunSample, joints: usize) -> Option<Deviation> {
    let lists = [
        ("position", &recorded.position, &made.q),
        ("velocity", &recorded.velocity, &made.dq),
        ("acceleration", &recorded.acceleration, &made.ddq),
    ];
    lists.into_iter().find_map(|(quantity, was, is)| {
        let pairs = was.iter().zip(is).take(joints).enumerate();
        pairs
            .filter(|(_, (was, is))| was.to_bits() != is.to_bits())
            .map(|(joint, (was, is))| Deviation::Number {
                quantity,
                joint: joint + 1,
                recorded: *was,
                now: *is,
            })
            .next()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    fn given() -> GivenProgram {
        GivenProgram {
            form: "text".to_owned(),
            name: "test".to_owned(),
            text: String::new(),
            first: 4,
            last: 5,
            start: None,
            default_length: "mm".to_owned(),
        }
    }

    fn recorded(command: u32, path_time: f64) -> Sample {
        let mut sample = Sample {
            tick: 100,
            command,
            path_time,
            time_scaling: 1.0,
            ..Sample::default()
        };
        sample.position[..2].copy_from_slice(&[path_time, -path_time]);
        sample
    }

    fn made(command: u32, path_time: f64) -> RunSample {
        RunSample {
            tick: 3,
            command,
            path_time,
            time_scaling: 1.0,
            q: vec![path_time, -path_time],
            dq: vec![0.0; 2],
            ddq: vec![0.0; 2],
            measured: vec![0.0; 2],
            workstation_from_tool: Isometry3::identity(),
            measured_pose: Isometry3::identity(),
        }
    }

    #[test]
    fn the_first_difference_has_its_command_time_and_joint() {
        let again = [made(1, 0.001), made(1, 0.002), made(2, 0.001)];
        let mut was = [recorded(4, 0.001), recorded(4, 0.002), recorded(5, 0.001)];
        let same = compare(&was, &again, &given(), 2);
        assert_eq!((same.equal, same.altered, same.difference), (3, 0, None));
        was[2].position[1] = f64::from_bits(was[2].position[1].to_bits() ^ 1);
        let other = compare(&was, &again, &given(), 2);
        assert_eq!(other.equal, 2);
        let text = other.difference.unwrap().to_string();
        let wanted = "command 2 at 0.001 s (period 100): position of joint 2: recorded -0.001";
        assert!(text.starts_with(wanted), "{text}");
        assert_eq!(compare(&was, &again, &given(), 1).difference, None);
    }

    /// A period without a counterpart is a difference, unless the command was slowed down before.
    #[test]
    fn periods_after_an_override_are_counted_and_not_compared() {
        let again = [made(1, 0.001), made(2, 0.001)];
        let mut was = [recorded(4, 0.001), recorded(4, 0.0015), recorded(5, 0.001)];
        let missing = compare(&was, &again, &given(), 2).difference.unwrap();
        assert_eq!(missing.what, Deviation::NoCounterpart);
        was[1].time_scaling = 0.5;
        let slowed = compare(&was, &again, &given(), 2);
        assert_eq!(
            (slowed.equal, slowed.altered, slowed.difference),
            (2, 1, None)
        );
    }
}
