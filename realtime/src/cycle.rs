//! One control period: from planned pieces to the next setpoint.

use nalgebra::SVector;

use crate::brake::{at_rest, brake};
use crate::buffer::{Buffer, Cursor, Pushed};
use crate::governor::{Aim, Governor, Outlook, StopCategory, scale};
use crate::guard::{Trip, check};
use crate::{JointLimits, Sample, Segment};

/// What the operator or a fault demands of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// Move along the path at this fraction of the planned speed, 0..=1.
    Run(f64),
    /// Stop on the path and wait.
    Stop(StopCategory),
}

/// The result of one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<const N: usize> {
    /// The setpoint.
    pub setpoint: Sample<N>,
    /// The current command, or the last one.
    pub command: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// Share of the planned speed.
    pub time_scaling: f64,
    /// A command that ended at rest with this setpoint.
    pub finished: Option<u32>,
    /// A command that starts with this setpoint: at rest, or in the place of the one before.
    pub started: Option<u32>,
    /// Whether the setpoint rests.
    pub resting: bool,
    /// The limit that the plan would have broken; the setpoint is then the first of a stop in
    /// which each joint brakes by itself.
    pub trip: Option<Trip>,
}

/// How the setpoint is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// At rest between commands.
    Rest,
    /// Along the planned path, also when stopped on it.
    Path,
    /// Each joint brakes by itself; the path is left.
    Brake,
}

/// Planned time that must be in the buffer before a command starts whose end is not in it (s).
const START_HORIZON: f64 = 1.0;

/// With less planned time than this in the buffer, the path factor falls in proportion (s).
const LOW_HORIZON: f64 = 0.5;

/// The motion of an arm of `N` joints, one setpoint per period, with room for `B` planned segments.
/// It is used in the real-time thread: it does not allocate, wait or fail.
///
/// ```
/// use nalgebra::vector;
/// use realtime::{Cycle, Demand, JointLimits, Piece, Pushed, Sample, Segment};
///
/// let limits = JointLimits {
///     lower: vector![-3.0],
///     upper: vector![3.0],
///     velocity: vector![2.0],
///     acceleration: vector![10.0],
///     jerk: vector![100.0],
///     ends: None,
/// };
/// let mut cycle = Cycle::<1, 64>::new(vector![0.0], limits, 0.001);
/// let (from, to) = (Sample::rest(vector![0.0]), Sample::rest(vector![0.5]));
/// let segment = Segment { piece: Piece::hermite(1.0, &from, &to), command: 7, last: true };
/// assert_eq!(cycle.push(&segment), Pushed::Taken);
/// assert_eq!(cycle.step(Demand::Run(1.0)).started, Some(7));
/// for tick in 1..1000 {
///     let step = cycle.step(Demand::Run(1.0));
///     let planned = segment.piece.sample(f64::from(tick) * 0.001);
///     assert!((step.setpoint.position - planned.position).amax() < 1e-12);
/// }
/// assert_eq!(cycle.step(Demand::Run(1.0)).finished, Some(7));
/// ```
#[derive(Clone, Debug)]
pub struct Cycle<const N: usize, const B: usize> {
    limits: JointLimits<N>,
    period: f64,
    buffer: Buffer<N, B>,
    at: Cursor,
    governor: Governor,
    mode: Mode,
    setpoint: Sample<N>,
    command: u32,
    path_time: f64,
    may_start: bool,
}

impl<const N: usize, const B: usize> Cycle<N, B> {
    /// A cycle that rests in `position` (rad) and makes a setpoint each `period` (s).
    pub fn new(position: SVector<f64, N>, limits: JointLimits<N>, period: f64) -> Self {
        Self {
            limits,
            period,
            buffer: Buffer::new(),
            at: Cursor {
                index: 0,
                offset: 0.0,
            },
            governor: Governor::new(1.0),
            mode: Mode::Rest,
            setpoint: Sample::rest(position),
            command: 0,
            path_time: 0.0,
            may_start: true,
        }
    }

    /// Takes a planned segment.
    pub fn push(&mut self, segment: &Segment<N>) -> Pushed {
        self.buffer.push(segment)
    }

    /// Whether nothing is planned and the arm rests between commands.
    pub fn is_idle(&self) -> bool {
        self.mode == Mode::Rest && self.buffer.is_empty()
    }

    /// Whether the setpoint rests, on the path or between commands.
    pub fn is_resting(&self) -> bool {
        match self.mode {
            Mode::Rest => true,
            Mode::Path => self.governor.factor == 0.0 && self.governor.rate == 0.0,
            Mode::Brake => at_rest(&self.setpoint),
        }
    }

    /// Whether the next command may start when the one that moves has ended; it may if nobody says
    /// otherwise. A command that moves is not touched.
    pub fn let_start(&mut self, may_start: bool) {
        self.may_start = may_start;
    }

    /// The command whose path is followed, also while the arm is stopped on it.
    pub fn follows(&self) -> Option<u32> {
        (self.mode == Mode::Path).then_some(self.command)
    }

    /// The last setpoint.
    pub fn setpoint(&self) -> &Sample<N> {
        &self.setpoint
    }

    /// The current command, or the last one.
    pub fn command(&self) -> u32 {
        self.command
    }

    /// Planned time since the command's start (s).
    pub fn path_time(&self) -> f64 {
        self.path_time
    }

    /// Share of the planned speed.
    pub fn time_scaling(&self) -> f64 {
        self.governor.factor
    }

    /// Forgets the plan; only at rest, says whether it did.
    pub fn flush(&mut self) -> bool {
        let resting = self.is_resting();
        if resting {
            self.reset(self.setpoint.position);
        }
        resting
    }

    /// Forgets the plan and rests in `position` (rad): for a new session with a driver.
    pub fn reset(&mut self, position: SVector<f64, N>) {
        self.buffer.clear();
        self.at = Cursor {
            index: 0,
            offset: 0.0,
        };
        self.mode = Mode::Rest;
        self.governor = Governor::new(1.0);
        self.setpoint = Sample::rest(position);
    }

    /// Forgets what is planned behind a time of the current command (s since its start), so that
    /// another motion, which begins there in the same state of motion, can be pushed behind it.
    /// Says whether it did: only while `command` moves at a steady share of the planned speed, for
    /// a time that is still to come and is in the buffer.
    pub fn cut(&mut self, command: u32, path_time: f64) -> bool {
        let left = path_time - self.path_time;
        let moves = self.mode == Mode::Path && self.command == command;
        let steady = self.governor.rate == 0.0 && self.governor.factor > 0.0;
        if !(moves && steady && left > self.period) {
            return false;
        }
        let (at, starved) = self.buffer.advance(self.at, left);
        let ahead = self.buffer.get(at.index);
        let inside = |segment: &Segment<N>| at.offset < segment.piece.duration || !segment.last;
        if starved || !ahead.is_some_and(inside) {
            return false;
        }
        self.buffer.cut(at);
        true
    }

    /// Leaves the path: each joint brakes by itself from the next period on.
    pub fn brake(&mut self) {
        if self.mode != Mode::Rest {
            self.mode = Mode::Brake;
        }
    }

    /// Makes the next setpoint.
    pub fn step(&mut self, demand: Demand) -> Step<N> {
        let (mut finished, mut started, mut trip) = (None, None, None);
        let before = self.command;
        let next = match self.mode {
            Mode::Brake => brake(&self.setpoint, &self.limits, self.period),
            Mode::Path => {
                let (next, over) = self.follow(demand);
                finished = over;
                started = (self.command != before).then_some(self.command);
                next
            }
            Mode::Rest => Sample::rest(self.setpoint.position),
        };
        let next = match check(&self.setpoint, &next, &self.limits, self.period) {
            Some(found) if self.mode != Mode::Brake => {
                trip = Some(found);
                (finished, started) = (None, None);
                self.mode = Mode::Brake;
                brake(&self.setpoint, &self.limits, self.period)
            }
            _ => next,
        };
        self.setpoint = next;
        if self.mode == Mode::Rest && trip.is_none() {
            started = self.start(demand);
        }
        self.report([finished, started], trip)
    }

    fn report(&self, [finished, started]: [Option<u32>; 2], trip: Option<Trip>) -> Step<N> {
        Step {
            setpoint: self.setpoint,
            command: self.command,
            path_time: self.path_time,
            time_scaling: self.governor.factor,
            finished,
            started,
            resting: self.is_resting(),
            trip,
        }
    }

    /// Starts the next command, if there is one and it may start.
    fn start(&mut self, demand: Demand) -> Option<u32> {
        let Demand::Run(share) = demand else {
            return None;
        };
        let first = self.buffer.get(0)?;
        let enough = self.buffer.has_end()
            || self.buffer.is_full()
            || self.buffer.horizon() >= START_HORIZON;
        if share.is_nan() || share <= 0.0 || !enough || !self.may_start {
            return None;
        }
        self.command = first.command;
        self.path_time = 0.0;
        self.at = Cursor {
            index: 0,
            offset: 0.0,
        };
        self.mode = Mode::Path;
        self.governor = Governor::new(share.min(1.0));
        Some(self.command)
    }

    /// One period along the path; says which command ended with it.
    fn follow(&mut self, demand: Demand) -> (Sample<N>, Option<u32>) {
        let outlook = Outlook {
            buffer: &self.buffer,
            at: self.at,
            limits: &self.limits,
        };
        let before = self.governor.rate;
        let passed = self.governor.step(&outlook, self.aim(demand));
        let (at, _) = self.buffer.advance(self.at, passed);
        self.path_time += passed;
        let Some(segment) = self.buffer.get(at.index).copied() else {
            return (brake(&self.setpoint, &self.limits, self.period), None);
        };
        if segment.command != self.command {
            // Another motion has taken the place of this one.
            (self.command, self.path_time) = (segment.command, at.offset);
        }
        let end = segment.piece.duration;
        if segment.last && at.offset >= end - 1e-9 {
            self.buffer.drop_before(at.index + 1);
            self.at = Cursor {
                index: 0,
                offset: 0.0,
            };
            self.mode = Mode::Rest;
            return (
                Sample::rest(segment.piece.sample(end).position),
                Some(segment.command),
            );
        }
        self.buffer.drop_before(at.index);
        self.at = Cursor { index: 0, ..at };
        let change = (self.governor.rate - before) / self.period;
        let pace = [self.governor.factor, self.governor.rate, change];
        (scale(&segment.piece.sample(at.offset), pace), None)
    }

    /// The target of the path factor.
    fn aim(&self, demand: Demand) -> Aim {
        let (target, category) = match demand {
            Demand::Run(share) if share.is_finite() => {
                (share.clamp(0.0, 1.0), StopCategory::Gentle)
            }
            Demand::Run(_) => (0.0, StopCategory::Gentle),
            Demand::Stop(category) => (0.0, category),
        };
        let period = self.period;
        if self.buffer.has_end() {
            return Aim {
                target,
                category,
                period,
            };
        }
        let supply = (self.buffer.horizon() - self.at.offset) / LOW_HORIZON;
        let target = target.min(supply.clamp(0.0, 1.0));
        Aim {
            target: if target < 1e-3 { 0.0 } else { target },
            category,
            period,
        }
    }
}
