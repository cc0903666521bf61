//! The thread that owns the arm's controller: reads states, sends commands, recovers.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use driver_kit::{Reference, Resampler, RobotFault, TimedReferences, pause};
use franka::{
    ActiveMotionGenerator, Errors, FrankaError, JointPositions, MoveControllerMode, RealtimeConfig,
    Robot, RobotMode, RobotOptions, RobotState, motion_finished,
};
use ipc::{Payload, bytes_of};
use rtrb::{Consumer, Producer};
use scheduling::now_ns;

use crate::arrivals::{Arrivals, Sockets};
use crate::snapshot::{Phase, Snapshot, Wish};
use crate::taken::Taken;
use crate::{FrankaOptions, JOINTS};

/// Time between two tries to connect.
const AGAIN: Duration = Duration::from_millis(500);

/// The controller goes on by itself when the driver slept for longer than this (s), or when so many
/// states in a row show a command that was not sent.
const SLEPT: f64 = 1.5e-3;
const STRANGE: u32 = 6;

/// Period of the controller (s).
const PERIOD: f64 = 1e-3;

/// An answer is late that leaves when its state came longer ago than this (s).
const LATE: f64 = 0.7e-3;

/// For so many states at its beginning a motion holds what the controller commands.
const FIRST: usize = 5;

/// How long a motion that shall end may take to come to rest (periods).
const PATIENCE: u32 = 2000;

/// Everything that the thread owns.
pub(crate) struct ArmThread {
    pub(crate) options: FrankaOptions,
    pub(crate) resampler: Resampler,
    pub(crate) rows: Consumer<TimedReferences<JOINTS>>,
    pub(crate) wishes: Consumer<Wish>,
    pub(crate) snapshots: Producer<Snapshot>,
    pub(crate) snapshot: Snapshot,
    pub(crate) payload: Option<(Payload, u32)>,
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) arrivals: Option<Arrivals>,
}

/// A motion that runs.
type Control<'a> = ActiveMotionGenerator<'a, JointPositions>;

impl ArmThread {
    /// Until the driver ends: connects, serves, connects again.
    pub(crate) fn run(mut self) {
        while !self.ends() {
            let options = RobotOptions::new(RealtimeConfig::Ignore).with_log_size(0);
            let before = Sockets::now();
            let lost = match Robot::with_options(&self.options.address, options) {
                Ok(robot) => {
                    // Of this robot's socket; without it no answer counts as late.
                    self.arrivals = before.arrivals_of_new();
                    self.serve(&robot)
                }
                Err(error) => error.to_string(),
            };
            self.arrivals = None;
            self.lose(&lost);
            pause(AGAIN, || self.ends());
        }
    }

    fn ends(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The connection is lost: during a motion that is a fault.
    fn lose(&mut self, reason: &str) {
        self.snapshot.reason = bytes_of(reason);
        if self.snapshot.phase == Phase::Moving {
            let text = format!("the connection is lost: {reason}");
            self.snapshot.fault = Some(RobotFault::new(None, 0, &text));
        }
        self.snapshot.phase = Phase::Disconnected;
        // Nothing that was wished before counts after it.
        while self.wishes.pop().is_ok() {}
        self.tell();
    }

    fn tell(&mut self) {
        // A full ring has a kit that does not run; the newest states will come.
        let _ = self.snapshots.push(self.snapshot);
    }

    /// Reads states until the connection is lost; returns why.
    fn serve(&mut self, robot: &Robot) -> String {
        self.snapshot.phase = match self.snapshot.fault {
            Some(_) => Phase::Faulted,
            None => Phase::Idle,
        };
        while !self.ends() {
            match robot.read_once() {
                Ok(state) => self.snapshot.take(&state, now_ns()),
                Err(error) => return error.to_string(),
            }
            self.tell();
            while self.rows.pop().is_ok() {}
            match self.wishes.pop() {
                Ok(Wish::Begin) => {
                    if let Err(lost) = self.session(robot) {
                        return lost;
                    }
                }
                Ok(Wish::Carry(payload, number)) => self.payload = Some((payload, number)),
                Ok(Wish::End) | Err(_) => {}
            }
        }
        "the driver ends".to_owned()
    }

    /// A motion from its start to its end.
    ///
    /// # Errors
    /// The text of a lost connection.
    fn session(&mut self, robot: &Robot) -> Result<(), String> {
        self.snapshot.phase = Phase::Starting;
        self.snapshot.fault = None;
        self.snapshot.reason = [0; 96];
        self.tell();
        let ended = self.prepare(robot).and_then(|()| self.motions(robot));
        match ended {
            Ok(()) => self.snapshot.phase = Phase::Idle,
            Err(FrankaError::Network(text)) => return Err(text),
            Err(error) => {
                self.snapshot.fault = Some(fault(&error));
                self.snapshot.phase = Phase::Faulted;
            }
        }
        self.tell();
        Ok(())
    }

    /// The motion, and another one after each payload: the controller takes a payload between them only.
    fn motions(&mut self, robot: &Robot) -> Result<(), FrankaError> {
        loop {
            while self.rows.pop().is_ok() {}
            let mut control =
                robot.start_joint_position_control(MoveControllerMode::JointImpedance)?;
            let goes_on = self.follow(&mut control)?;
            drop(control);
            if !goes_on {
                return Ok(());
            }
            self.load(robot)?;
        }
    }

    /// Tells the controller what the arm carries.
    fn load(&mut self, robot: &Robot) -> Result<(), FrankaError> {
        let Some((payload, number)) = self.payload.take() else {
            return Ok(());
        };
        let [xx, yy, zz, xy, xz, yz] = payload.inertia;
        let inertia = [xx, xy, xz, xy, yy, yz, xz, yz, zz];
        robot.set_load(payload.mass, payload.centre, inertia)?;
        self.snapshot.carried = number;
        Ok(())
    }

    /// Recovers from an error, and tells the controller what it must know before the motion.
    fn prepare(&mut self, robot: &Robot) -> Result<(), FrankaError> {
        if self.snapshot.mode == RobotMode::Reflex {
            robot.automatic_error_recovery()?;
        }
        if let Some(thresholds) = self.options.collision {
            let (torque, force) = (thresholds.torque, thresholds.force);
            robot.set_collision_behavior_simple(torque, torque, force, force)?;
        }
        if let Some(impedance) = self.options.impedance {
            robot.set_joint_impedance(impedance)?;
        }
        self.load(robot)
    }

    /// Answers each state of the controller with a command, until the motion shall end; says whether
    /// another motion shall follow it, after a new payload.
    fn follow(&mut self, control: &mut Control<'_>) -> Result<bool, FrankaError> {
        let mut sent = Sent::default();
        let (mut ending, mut ends) = (0_u32, false);
        loop {
            let (state, passed) = control.read_once()?;
            let advance = passed.as_secs_f64();
            let doubtful = core::mem::take(&mut sent.doubtful) || sent.misses_one(&state);
            if sent.taken.count() < FIRST {
                self.resampler.begin(&state.q_d);
            } else if !doubtful && sent.has_gone_on(&state, advance) {
                self.rejoin(&mut sent, &state);
            }
            while let Ok(row) = self.rows.pop() {
                self.resampler.push(row.at_ns, &row.joints);
            }
            self.snapshot.phase = Phase::Moving;
            self.snapshot.take(&state, now_ns());
            self.tell();
            let command = self.resampler.next(advance);
            let q: [f64; JOINTS] =
                core::array::from_fn(|joint| command.get(joint).map_or(0.0, |c| c.position));
            self.snapshot.delay = self.resampler.delay();
            match self.wishes.pop() {
                Ok(Wish::End) => ends = true,
                Ok(Wish::Carry(payload, number)) => self.payload = Some((payload, number)),
                Ok(Wish::Begin) | Err(_) => {}
            }
            ends |= self.ends();
            ending += u32::from(ends || self.payload.is_some());
            let positions = JointPositions::new(q);
            if ending > 0 && (self.resampler.is_resting() || ending > PATIENCE) {
                self.snapshot.phase = Phase::Starting;
                self.tell();
                control.write_once(&motion_finished(positions), None)?;
                return Ok(!ends);
            }
            if doubtful || self.is_late() {
                // The controller has dropped this cycle and gone on by itself; an answer that comes later
                // would be taken for one to a cycle of its own.
                sent.skipped = true;
                continue;
            }
            control.write_once(&positions, None)?;
            sent.taken.push(q);
            // One that was held up while it was sent comes late. Whether the controller takes it shows in the
            // state after the next one; what is answered to the next one could be a step for it.
            sent.doubtful = self.is_late();
        }
    }

    /// Whether the last state came too long ago for an answer.
    fn is_late(&self) -> bool {
        self.arrivals.as_ref().map_or(0.0, Arrivals::age) > LATE
    }

    /// After lost commands the controller has gone on by itself: the next command starts there.
    fn rejoin(&mut self, sent: &mut Sent, state: &RobotState) {
        if let Some(there) = sent.taken.went_on(&state.q_d, PERIOD) {
            self.resampler.rejoin(&there);
            return;
        }
        // It did something else: as exact as its states are.
        let commanded: [Reference; JOINTS] = core::array::from_fn(|joint| Reference {
            position: state.q_d[joint],
            // The controller's velocity is the difference of its last two positions: that of half a
            // period ago.
            velocity: state.dq_d[joint] + state.ddq_d[joint] * PERIOD / 2.0,
            acceleration: state.ddq_d[joint],
        });
        self.resampler.rejoin(&commanded);
    }
}

/// The commands of a motion.
#[derive(Default)]
struct Sent {
    taken: Taken,
    /// States in a row that show a command that was not sent.
    strange: u32,
    /// The last state was not answered.
    skipped: bool,
    /// The answer to the last state may come too late.
    doubtful: bool,
}

impl Sent {
    /// Whether an answer is missing that the driver believes to have given: it may still come.
    fn misses_one(&self, state: &RobotState) -> bool {
        let began = self.taken.count() >= FIRST;
        began && !self.skipped && self.taken.misses(&state.q_d, PERIOD)
    }

    /// Whether the controller commands something that was not sent, and not only for a moment;
    /// `passed` is the time since the last state (s).
    fn has_gone_on(&mut self, state: &RobotState, passed: f64) -> bool {
        let known = self.taken.knows(&state.q_d);
        self.strange = if known { 0 } else { self.strange + 1 };
        if core::mem::take(&mut self.skipped) {
            self.strange = 0;
            return true;
        }
        if known || (passed < SLEPT && self.strange < STRANGE) {
            return false;
        }
        self.strange = 0;
        true
    }
}

/// A motion's error in the maker's words.
fn fault(error: &FrankaError) -> RobotFault {
    let FrankaError::Control(exception) = error else {
        return RobotFault::new(None, 0, &error.to_string());
    };
    let errors: &Errors = &exception.last_motion_errors;
    let names = errors.names();
    let first = errors.0.iter().position(|set| *set);
    match first {
        Some(index) => RobotFault::new(None, index as u32 + 1, &names.join(", ")),
        None => RobotFault::new(None, 0, exception.message.lines().next().unwrap_or("")),
    }
}
