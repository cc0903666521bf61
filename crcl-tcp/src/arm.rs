//! The thread that gives commands to the engine and follows what becomes of them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use crcl::xml::CommandState;
use crcl::{AngleUnit, Command, CoordinateFrame, LengthUnit};
use ipc::{Arm, ControlClient, IpcError};

use crate::cell::Cell;
use crate::engine::{Engine, Happened, Report};
use crate::sensing::Tripped;
use crate::stopper::{abort, wait_for_rest};

/// How often the engine is asked how far it is.
const LOOK: Duration = Duration::from_millis(2);

/// How far a joint may be from its setpoint when the arm has settled (rad, m).
const JOINT_ERROR: f64 = 2e-3;

/// How far a joint may have moved between two looks when the arm has settled (rad, m).
const STILL: f64 = 1e-4;

/// How near the end of a move the controlled point must be where no tolerance is set (m).
const POINT_ERROR: f64 = 1e-3;

/// How long the engine may take to obey a stop after the arm rests.
const OBEY: Duration = Duration::from_millis(500);

/// How long the arm may take to settle after its last setpoint.
const SETTLE: Duration = Duration::from_secs(5);

/// What kind of command it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// It changes no motion.
    Setting,
    /// It moves the arm, or makes it wait: another move may take its place.
    Motion,
    /// It moves a tool; it is never broken off.
    Tool,
    /// InitCanon.
    Begin,
    /// EndCanon.
    End,
}

/// A command for the engine.
#[derive(Clone, Debug)]
pub(crate) struct Order {
    /// Number of the command.
    pub(crate) serial: u64,
    /// How many stops there were when it was given.
    pub(crate) epoch: u64,
    /// What kind it is.
    pub(crate) kind: Kind,
    /// The commands, in metres and radians.
    pub(crate) commands: Vec<Command>,
    /// Whether it takes the place of a motion that is under way.
    pub(crate) preempts: bool,
    /// Where the controlled point stops (m).
    pub(crate) target: Option<[f64; 3]>,
}

/// A command that the engine has.
struct Active {
    order: Order,
    /// The engine's number of its last command.
    last: u64,
    /// Since when the engine has done it.
    done: Option<Instant>,
    /// What its guard said that has ended it.
    said: Option<String>,
}

/// Follows an engine.
pub(crate) struct Follower {
    cell: Arc<Cell>,
    engine: Engine,
    control: ControlClient,
    active: VecDeque<Active>,
    /// Joints at the look before.
    before: Vec<f64>,
    /// How many stops there were when the last command was given.
    given: u64,
    /// Since when the engine has nothing to do and takes nothing.
    ended: Option<Instant>,
}

impl Follower {
    /// Opens the channels of an engine that is there.
    ///
    /// # Errors
    /// Why it cannot be reached.
    pub(crate) fn open(arm: &Arm, cell: &Arc<Cell>) -> Result<Self, FollowError> {
        let mut engine = Engine::open(arm)?;
        let report = engine.report().map_err(FollowError::Engine)?;
        engine.begin_after(report.last_note);
        cell.lock().picture = report.picture;
        Ok(Self {
            cell: Arc::clone(cell),
            engine,
            control: ControlClient::open(arm)?,
            active: VecDeque::new(),
            before: Vec::new(),
            given: 0,
            ended: None,
        })
    }

    /// Takes orders until nobody can give one any more.
    pub(crate) fn run(mut self, orders: &Receiver<Order>) {
        loop {
            match orders.recv_timeout(LOOK) {
                Ok(order) => self.take(order),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            self.look();
        }
    }

    /// Gives one order to the engine, or says why not.
    fn take(&mut self, order: Order) {
        if self.cell.lock().epoch != order.epoch {
            return;
        }
        let serial = order.serial;
        match self.give(&order) {
            Ok(last) => self.active.push_back(Active {
                order,
                done: (last == 0).then(Instant::now),
                last,
                said: None,
            }),
            Err(why) => self.cell.lock().fail(serial, &why),
        }
    }

    fn give(&mut self, order: &Order) -> Result<u64, String> {
        if let Some(last) = self.replace(order) {
            return Ok(last);
        }
        let stopped = order.preempts && self.preempt()?;
        if stopped || order.epoch != self.given {
            self.wait_for_end()?;
        }
        self.given = order.epoch;
        let report = self.engine.report()?;
        if let Some(fault) = report.fault {
            return Err(format!(
                "a fault is latched: {fault}; canter recover clears it"
            ));
        }
        let mut commands = Vec::new();
        let begins = order.kind == Kind::Begin;
        // A stop leaves the engine ended; the client need not know.
        if report.state != "ready" && (begins || order.kind != Kind::End) {
            commands.push(Command::InitCanon);
        }
        if begins || !commands.is_empty() {
            commands.extend(prelude());
        }
        if order.kind == Kind::End && report.state != "ready" {
            return Ok(0);
        }
        if !begins {
            commands.extend(order.commands.iter().cloned());
        }
        let last = self.engine.submit(&commands)?;
        // A stop that came meanwhile did not find this command.
        if self.cell.lock().epoch != order.epoch {
            abort(&self.control, true)?;
        }
        Ok(last)
    }

    /// Has the engine lead a motion that is under way over into this one, without a stop; nothing
    /// where that is not possible. The motion under way then never becomes done.
    fn replace(&mut self, order: &Order) -> Option<u64> {
        let moves = match self.active.iter().collect::<Vec<_>>().as_slice() {
            [active] => active.order.kind == Kind::Motion && active.done.is_none(),
            _ => false,
        };
        if !(order.preempts && moves && order.epoch == self.given) {
            return None;
        }
        // Refused, the motion is stopped first.
        let last = self.engine.replace(&order.commands).ok()?;
        self.active.clear();
        // A stop that came meanwhile did not find this command; if the stop is refused, the thread
        // that stops says so.
        if self.cell.lock().epoch != order.epoch {
            let _ = abort(&self.control, true);
        }
        Some(last)
    }

    /// Stops a motion that is under way, which then never becomes done; says whether there was one.
    fn preempt(&mut self) -> Result<bool, String> {
        let kinds = || self.active.iter().map(|active| active.order.kind);
        let moves = kinds().any(|kind| kind == Kind::Motion);
        if !moves || kinds().any(|kind| kind == Kind::Tool) {
            return Ok(false);
        }
        abort(&self.control, false)?;
        wait_for_rest(&self.control)?;
        self.active.clear();
        Ok(true)
    }

    /// Waits until the engine has obeyed a stop: it rests at once, but takes commands a moment
    /// later.
    fn wait_for_end(&mut self) -> Result<(), String> {
        let end = Instant::now() + OBEY;
        while self.engine.report()?.state == "ready" && Instant::now() < end {
            std::thread::sleep(LOOK);
        }
        Ok(())
    }

    /// Looks at the engine and ends what is over.
    fn look(&mut self) {
        let seen = match self.engine.happened() {
            Ok(seen) => seen,
            Err(why) => return self.lost(&why),
        };
        for happened in seen {
            self.hear(happened);
        }
        match self.engine.report() {
            Ok(report) => self.show(report),
            Err(why) => self.lost(&why),
        }
    }

    fn hear(&mut self, happened: Happened) {
        let epoch = self.cell.lock().epoch;
        match happened {
            Happened::Done { id } => {
                for active in &mut self.active {
                    if active.last <= id && active.done.is_none() {
                        active.done = Some(Instant::now());
                    }
                }
            }
            Happened::Refused { id, why } => {
                let refused = self.active.iter().position(|active| active.last >= id);
                if let Some(active) = refused.and_then(|at| self.active.remove(at)) {
                    self.cell.lock().fail(active.order.serial, &why);
                }
            }
            Happened::Guarded { id, tripped } => self.trip(id, tripped),
            Happened::Faulted(why) => self.drop_all(epoch, &why),
            Happened::Closed => self.drop_all(epoch, "the engine has ended"),
        }
    }

    /// A guard has ended a command: it is where it is, and not where it was sent.
    fn trip(&mut self, id: u64, tripped: Tripped) {
        let found = self.active.iter_mut().find(|active| active.last >= id);
        if let Some(active) = found {
            active.order.target = None;
            active.said = Some(tripped.sentence.clone());
        }
        let mut inner = self.cell.lock();
        inner.guards.count = inner.guards.count.saturating_add(1);
        inner.guards.last = Some(tripped);
    }

    /// Forgets all commands; those that were not stopped by a client have failed.
    fn drop_all(&mut self, epoch: u64, why: &str) {
        for active in std::mem::take(&mut self.active) {
            if active.order.epoch == epoch {
                self.cell.lock().fail(active.order.serial, why);
            }
        }
    }

    fn lost(&mut self, why: &str) {
        let epoch = self.cell.lock().epoch;
        self.drop_all(epoch, &format!("the engine does not answer: {why}"));
    }

    /// Shows how the arm is, and at the same time what is over.
    fn show(&mut self, report: Report) {
        let joints = report.picture.joints.clone();
        let moved = joints.iter().zip(&self.before).map(|(a, b)| (a - b).abs());
        let still = joints.len() == self.before.len() && moved.fold(0.0, f64::max) < STILL;
        self.before = joints;
        let cell = Arc::clone(&self.cell);
        let mut inner = cell.lock();
        // What was asked for before a stop was dropped by it.
        self.active
            .retain(|active| active.order.epoch == inner.epoch);
        while let Some(active) = self.active.front() {
            let Some(since) = active.done else { break };
            let order = &active.order;
            let waits = order.kind == Kind::Motion && self.active.len() == 1;
            if !waits || (still && settled(&report, order.target)) {
                inner.finish(order.serial, CommandState::Done, active.said.clone());
            } else if since.elapsed() >= SETTLE {
                let why = "the arm has not settled within its tolerance";
                inner.fail(order.serial, why);
            } else {
                break;
            }
            self.active.pop_front();
        }
        let stopped = report.idle && report.state == "ended" && !self.active.is_empty();
        let since = *self.ended.get_or_insert_with(Instant::now);
        if !stopped {
            self.ended = None;
        } else if since.elapsed() >= OBEY {
            for active in self.active.drain(..).filter(|active| active.done.is_none()) {
                let why = "the arm was stopped by somebody else";
                inner.fail(active.order.serial, why);
            }
        }
        inner.picture = report.picture;
    }
}

/// Whether the measured arm is where it was sent.
fn settled(report: &Report, target: Option<[f64; 3]>) -> bool {
    let picture = &report.picture;
    let apart = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let near = target.is_none_or(|target| {
        let most = picture.settings.end_point;
        let most = if most > 0.0 { most } else { POINT_ERROR };
        let squares = picture.position.iter().zip(target);
        squares.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt() <= most
    });
    near && apart(&picture.joints, &picture.setpoint) <= JOINT_ERROR
}

/// What makes the engine read metres and radians.
fn prelude() -> [Command; 3] {
    [
        Command::SetLengthUnits {
            unit: LengthUnit::Meter,
        },
        Command::SetAngleUnits {
            unit: AngleUnit::Radian,
        },
        Command::SetCoordinateFrame {
            frame: CoordinateFrame::Workstation,
        },
    ]
}

/// Why an engine cannot be followed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FollowError {
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The engine refused, or did not answer.
    #[error("{0}")]
    Engine(String),
}
