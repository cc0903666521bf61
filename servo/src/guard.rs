//! Guards: conditions on sensors that stop a motion, and what became of them.

use ipc::{MAX_ANALOGUE, State, bytes_of};
use nalgebra::SVector;

/// How far each joint may be from where it comes to rest when a guard has stopped it (rad, m): the
/// answer is about a measured arm that rests.
pub const SETTLED: f64 = 1e-5;

/// How many guards a command has at most.
pub const MAX_GUARDS: usize = 4;

/// Which value of the driver's state a guard watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuardSource {
    /// A named sensor; the name is filled up with 0.
    Sensor([u8; 24]),
    /// A digital input: 0 or 1.
    DigitalInput(u32),
    /// An analogue input, in the unit of the arm.
    AnalogueInput(usize),
}

impl GuardSource {
    /// The value of that name: `digital_input_0` to `63`, `analogue_input_0` to `7`, or a sensor of
    /// the driver.
    ///
    /// ```
    /// use servo::GuardSource;
    /// assert_eq!(GuardSource::named("digital_input_3"), GuardSource::DigitalInput(3));
    /// assert!(matches!(GuardSource::named("wrench.Fz"), GuardSource::Sensor(_)));
    /// ```
    pub fn named(name: &str) -> Self {
        let number = |prefix: &str| {
            name.strip_prefix(prefix)
                .and_then(|n| n.parse::<u32>().ok())
        };
        if let Some(input) = number("digital_input_").filter(|n| *n < u64::BITS) {
            return Self::DigitalInput(input);
        }
        match number("analogue_input_").filter(|n| (*n as usize) < MAX_ANALOGUE) {
            Some(input) => Self::AnalogueInput(input as usize),
            None => Self::Sensor(bytes_of(name)),
        }
    }

    /// The value in a state; NaN where it is not known.
    pub fn read(&self, state: &State) -> f64 {
        match self {
            Self::Sensor(name) => {
                let known = state.sensors.iter().take(state.sensor_count as usize);
                let mut found = known.filter(|sensor| sensor.name == *name);
                found.next().map_or(f64::NAN, |sensor| sensor.value)
            }
            Self::DigitalInput(bit) => f64::from((state.digital_inputs >> bit & 1) as u32),
            Self::AnalogueInput(input) => {
                let value = state.analogue_inputs.get(*input);
                value.copied().unwrap_or(f64::NAN)
            }
        }
    }
}

/// What trips a guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuardKind {
    /// A value above the limit.
    Over,
    /// A value below the limit.
    Under,
    /// A value that has grown by more than the limit since the start of the command.
    Increase,
    /// A value that has fallen by more than the limit since the start of the command.
    Decrease,
}

/// A condition on a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorGuard {
    /// What is watched.
    pub source: GuardSource,
    /// What trips it.
    pub kind: GuardKind,
    /// The limit, SI.
    pub limit: f64,
}

impl SensorGuard {
    /// Whether a value trips the guard; `start` is the value at the start of the command.
    ///
    /// ```
    /// use servo::{GuardKind, GuardSource, SensorGuard};
    /// let source = GuardSource::named("force");
    /// let guard = SensorGuard { source, kind: GuardKind::Increase, limit: 5.0 };
    /// assert!(guard.is_tripped(15.1, 10.0) && !guard.is_tripped(15.0, 10.0));
    /// ```
    pub fn is_tripped(&self, value: f64, start: f64) -> bool {
        match self.kind {
            GuardKind::Over => value > self.limit,
            GuardKind::Under => value < self.limit,
            GuardKind::Increase => value - start > self.limit,
            GuardKind::Decrease => start - value > self.limit,
        }
    }

    /// The value of the two that is further in the direction of the limit.
    fn further(&self, a: f64, b: f64) -> f64 {
        match self.kind {
            GuardKind::Over | GuardKind::Increase => a.max(b),
            GuardKind::Under | GuardKind::Decrease => a.min(b),
        }
    }
}

/// The guards of a command. They are pushed in front of its segments, and begin when the arm rests
/// after all that was pushed before.
#[derive(Clone, Copy, Debug)]
pub struct GuardOrder {
    /// Index of the command.
    pub command: u32,
    /// The guards; the command stops when one of them trips.
    pub guards: [Option<SensorGuard>; MAX_GUARDS],
}

/// What became of the guards of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GuardOutcome {
    /// None has tripped.
    Quiet,
    /// This one has tripped, by its index.
    Tripped(usize),
    /// The value of this one is not known, by its index.
    Unknown(usize),
}

/// What became of a guarded command, when the arm rests after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded<const N: usize> {
    /// Index of the command.
    pub command: u32,
    /// Whether a guard has ended it.
    pub outcome: GuardOutcome,
    /// The value that ended it.
    pub value: f64,
    /// For each guard, the value furthest in the direction of its limit, until the arm rests.
    pub peaks: [f64; MAX_GUARDS],
    /// The period in which it ended.
    pub tick: u64,
    /// Time from then until the measured arm rests (s).
    pub stop_s: f64,
    /// Measured positions when it ended (rad, m).
    pub measured: SVector<f64, N>,
    /// Positions of the setpoint before it ended (rad, m).
    pub setpoint: SVector<f64, N>,
    /// Planned time since the command's start when it ended (s); 0 if it did not start.
    pub path_time: f64,
    /// Share of the planned speed when it ended.
    pub time_scaling: f64,
    /// Measured positions when the arm rests (rad, m).
    pub rested: SVector<f64, N>,
}

/// The guards of the command that moves now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watch<const N: usize> {
    guards: [Option<SensorGuard>; MAX_GUARDS],
    starts: [f64; MAX_GUARDS],
    pub(crate) report: Guarded<N>,
    /// Whether the last segment of the command was pushed into the cycle.
    pub(crate) is_whole: bool,
    /// Whether the command has come to its end, by its plan or by a guard.
    pub(crate) has_ended: bool,
}

impl<const N: usize> Watch<N> {
    /// Begins to watch; the values of now are those of the start.
    pub(crate) fn new(order: &GuardOrder, state: &State) -> Self {
        let mut starts = [f64::NAN; MAX_GUARDS];
        for (start, guard) in starts.iter_mut().zip(&order.guards) {
            if let Some(guard) = guard {
                *start = guard.source.read(state);
            }
        }
        let zero = SVector::zeros();
        Self {
            guards: order.guards,
            starts,
            report: Guarded {
                command: order.command,
                outcome: GuardOutcome::Quiet,
                value: f64::NAN,
                peaks: starts,
                tick: 0,
                stop_s: 0.0,
                measured: zero,
                setpoint: zero,
                path_time: 0.0,
                time_scaling: 0.0,
                rested: zero,
            },
            is_whole: false,
            has_ended: false,
        }
    }

    /// Looks at the values of a period; says whether one of them ends the command now.
    pub(crate) fn look(&mut self, state: &State) -> bool {
        let mut ended = None;
        for (index, guard) in self.guards.iter().enumerate() {
            let Some(guard) = guard else { continue };
            let value = guard.source.read(state);
            let start = self.starts.get(index).copied().unwrap_or(f64::NAN);
            if let Some(peak) = self.report.peaks.get_mut(index) {
                *peak = guard.further(*peak, value);
            }
            let outcome = if value.is_nan() {
                GuardOutcome::Unknown(index)
            } else if guard.is_tripped(value, start) {
                GuardOutcome::Tripped(index)
            } else {
                continue;
            };
            ended = ended.or(Some((outcome, value)));
        }
        match ended {
            Some((outcome, value)) if self.report.outcome == GuardOutcome::Quiet => {
                (self.report.outcome, self.report.value) = (outcome, value);
                true
            }
            _ => false,
        }
    }

    /// Whether a guard wants the arm to stop.
    pub(crate) fn stops(&self) -> bool {
        self.report.outcome != GuardOutcome::Quiet && !self.has_ended
    }
}
