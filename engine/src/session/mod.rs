//! A session with a driver: commands go through queue, planner and executor.
//!
//! A session has a worker thread, which plans ahead of the executor and reports each command in
//! order. The executor has a separate real-time thread. Orders of an operator (pause, stop, ...) go
//! directly to the real-time thread; the worker, which may plan for a long time, reads them
//! afterwards.

mod inbox;
mod jog;
mod note;
mod status;
mod worker;

use core::fmt;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use crcl::{LengthUnit, Located, Program};
use ipc::{Arm, Clock};
use nalgebra::Isometry3;
use thiserror::Error;

pub use jog::{Jog, JogError, JogSpace};
pub use note::{Blame, Note};
pub use status::{Cycles, Largest, Spread, Status, Timing};

use crate::queue::{Full, Given};
use inbox::Inbox;
use planner::dry_run::{FailurePolicy, Plan, PlannedCommand};
use planner::robot::{Robot, RobotError};
use planner::with_dof;
use servo::{Control, ExecutorError, NoFault, Progress, Steering};

/// How a session runs.
#[derive(Clone, Debug)]
pub struct SessionConfig {
    /// The arm, as its driver is named.
    pub arm: Arm,
    /// Setpoints a second, 100 to 4000.
    pub rate_hz: f64,
    /// By the wall clock, or in lock-step with the driver.
    pub clock: Clock,
    /// Whether every setpoint and measured position is kept for [`Session::samples`].
    pub record: bool,
    /// What happens when a command cannot be executed.
    pub on_refusal: FailurePolicy,
    /// Unit of length before SetLengthUnits and after InitCanon.
    pub default_length: LengthUnit,
    /// How many commands may wait.
    pub capacity: usize,
    /// How long to look for a driver.
    pub connect: Duration,
    /// Gets what a driver that is getting ready waits for.
    pub on_wait: fn(&str),
}

impl SessionConfig {
    /// The usual choice for an arm: 1000 Hz by the clock, abort on refusal,
    /// millimetres, 4096 commands.
    #[must_use]
    pub fn new(arm: Arm) -> Self {
        Self {
            arm,
            rate_hz: 1000.0,
            clock: Clock::Wall,
            record: false,
            on_refusal: FailurePolicy::default(),
            default_length: LengthUnit::default(),
            capacity: 4096,
            connect: Duration::from_secs(5),
            on_wait: |_| {},
        }
    }
}

/// Why a session cannot start.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The robot's description.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The executor, its driver or shared memory.
    #[error(transparent)]
    Executor(#[from] ExecutorError),
    /// The operating system gave no thread.
    #[error("cannot start the planner thread: {cause}")]
    Thread {
        /// What the operating system said.
        cause: String,
    },
    /// The session has ended.
    #[error("the session has ended")]
    Closed,
}

/// One servo period of a recorded run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSample {
    /// The servo period since the start of the session.
    pub tick: u64,
    /// Number of the command, from 1; 0 before the first.
    pub command: u32,
    /// Planned time since the command's start, s.
    pub path_time: f64,
    /// Share of the planned speed.
    pub time_scaling: f64,
    /// Joint positions published, rad or m.
    pub q: Vec<f64>,
    /// Joint velocities published.
    pub dq: Vec<f64>,
    /// Joint accelerations published.
    pub ddq: Vec<f64>,
    /// Joint positions measured.
    pub measured: Vec<f64>,
    /// Published pose of the controlled point in the workstation.
    pub workstation_from_tool: Isometry3<f64>,
    /// Measured pose of the controlled point in the workstation.
    pub measured_pose: Isometry3<f64>,
}

/// Why commands were not taken.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SubmitError {
    /// There is no room for all of them.
    #[error(transparent)]
    Full(#[from] Full),
    /// A fault is latched: commands that are queued now would be dropped when it is cleared.
    #[error("a fault is latched ({0}); canter recover clears it")]
    Fault(String),
    /// The session is over.
    #[error("the session has ended")]
    Closed,
}

/// Why a move cannot take the place of the one that moves.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the move cannot take the place of the one before without a stop: {0}")]
pub struct ReplaceError(pub(crate) String);

/// Why no command is let go in single step.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum StepError {
    /// Commands are not executed one by one.
    #[error("single step is off: all commands are executed one after the other")]
    Off,
    /// The command before has not ended.
    #[error("the command before has not ended")]
    Moving,
    /// Nothing waits.
    #[error("no command waits")]
    Empty,
}

/// How long the worker may continue to plan after the arm rests and the session is over; its result
/// is not needed then.
const LAST_THOUGHT: Duration = Duration::from_millis(500);

/// Time limit for the arm to come to rest at the end.
const LAST_REST: Duration = Duration::from_secs(8);

/// What is asked of the worker.
enum Order {
    /// There is something new in the inbox.
    Look,
    Jog(Jog, Sender<Result<(), JogError>>),
    Replace(Vec<Located>, Sender<Result<Vec<u32>, ReplaceError>>),
    Close,
}

/// What both sides see.
#[derive(Debug)]
struct Shared {
    status: Mutex<Status>,
    samples: Mutex<Vec<RunSample>>,
    inbox: Mutex<Inbox>,
}

impl Shared {
    /// The waiting commands. The lock is held for a few instructions only, never while planning.
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What is known of the motion without asking the worker, which may be planning.
struct Live {
    /// Fills in the present state.
    fill: Box<dyn Fn(&mut Status) + Send + Sync>,
    /// Reads the samples of the servo thread.
    read: Box<dyn Fn() + Send + Sync>,
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Live")
    }
}

/// A running session on one arm. Dropping it stops the arm on the path.
#[derive(Debug)]
pub struct Session {
    orders: Sender<Order>,
    notes: Receiver<Note>,
    shared: Arc<Shared>,
    worker: Option<JoinHandle<()>>,
    steering: Steering,
    live: Live,
    /// What the operating system refused to the real-time thread, in one sentence.
    pub warning: Option<String>,
    /// The driver's name.
    pub driver: String,
    /// Joint positions at the start, rad or m.
    pub start: Vec<f64>,
}

/// What the worker sends once the executor runs.
struct Begun {
    warning: Option<String>,
    driver: String,
    start: Vec<f64>,
    steering: Steering,
    live: Live,
}

impl Session {
    /// Finds the driver, opens a session with it and starts to take commands.
    ///
    /// # Errors
    /// [`SessionError`]: the robot's description, no driver, a driver that
    /// refuses, another engine on the same arm.
    pub fn start(robot: &Robot, config: &SessionConfig) -> Result<Self, SessionError> {
        let (orders, receiver) = mpsc::channel();
        let (tell, notes) = mpsc::channel();
        let (begin, begun) = mpsc::sync_channel(1);
        let shared = Arc::new(Shared {
            status: Mutex::default(),
            samples: Mutex::default(),
            inbox: Mutex::new(Inbox::new(config.capacity)),
        });
        let (robot, config, seen) = (robot.clone(), config.clone(), Arc::clone(&shared));
        let worker = std::thread::Builder::new()
            .name("planner".to_owned())
            .stack_size(16 << 20)
            .spawn(move || {
                let ends = worker::Ends {
                    orders: receiver,
                    notes: tell,
                    shared: seen,
                };
                with_dof!(robot.dof(), N => worker::run::<N>(&robot, &config, ends, &begin));
            })
            .map_err(|cause| SessionError::Thread {
                cause: cause.to_string(),
            })?;
        let begun = begun.recv().unwrap_or(Err(SessionError::Closed))?;
        let Begun {
            warning,
            driver,
            start,
            steering,
            live,
        } = begun;
        Ok(Self {
            orders,
            notes,
            shared,
            worker: Some(worker),
            steering,
            live,
            warning,
            driver,
            start,
        })
    }

    /// Appends commands to the queue: all of them or none. Does not wait for the planner.
    ///
    /// # Errors
    /// [`SubmitError`], and the queue is as before.
    pub fn submit(&self, commands: Vec<Located>) -> Result<Vec<u32>, SubmitError> {
        self.give(commands.into_iter().map(Given::from).collect())
    }

    /// Appends the commands of a program that was planned: all of them or none. Each planned step
    /// is executed as planned, if arm and modes are then those it was planned for. Any other
    /// command is planned when its turn comes, as by [`Session::submit`].
    ///
    /// # Errors
    /// [`SubmitError`], and the queue is as before.
    pub fn execute(&self, program: &Program, plan: Plan) -> Result<Vec<u32>, SubmitError> {
        let mut planned = plan.commands.into_iter().peekable();
        let given = program
            .commands
            .iter()
            .enumerate()
            .map(|(index, located)| Given::Command {
                located: located.clone(),
                planned: planned
                    .next_if(|planned| planned.index == index)
                    .map(PlannedCommand::into_step),
            });
        self.give(given.collect())
    }

    /// Appends commands that are planned or not: all of them or none. See [`Session::execute`].
    ///
    /// # Errors
    /// [`SubmitError`], and the queue is as before.
    pub fn give(&self, commands: Vec<Given>) -> Result<Vec<u32>, SubmitError> {
        let ids = self.shared.inbox().submit(commands, &self.steering)?;
        if self.orders.send(Order::Look).is_err() {
            return Err(SubmitError::Closed);
        }
        Ok(ids)
    }

    /// Has a move take the place of the one that moves now, in the same state of motion and without
    /// a stop. The move may have settings before and behind it. The old move never becomes done.
    ///
    /// # Errors
    /// [`ReplaceError`], and the old move goes on: stop it and give the new one as any other.
    pub fn replace(&self, commands: Vec<Located>) -> Result<Vec<u32>, ReplaceError> {
        let (answer, answered) = mpsc::channel();
        if self.orders.send(Order::Replace(commands, answer)).is_err() {
            return Err(ReplaceError("the session has ended".to_owned()));
        }
        let closed = || ReplaceError("the session has ended".to_owned());
        answered.recv().unwrap_or_else(|_| Err(closed()))
    }

    /// Executes commands one by one from now on, or all again. In single step each command waits for
    /// [`Session::step_on`]; what is planned ahead already is executed.
    pub fn set_single_step(&self, on: bool) {
        self.shared.inbox().set_single_step(on);
    }

    /// Lets the next command begin that waits in single step.
    ///
    /// # Errors
    /// [`StepError`], and nothing begins.
    pub fn step_on(&self) -> Result<(), StepError> {
        self.shared.inbox().step_on()
    }

    /// A handle to control the motion, for a separate thread.
    #[must_use]
    pub fn steering(&self) -> Steering {
        self.steering.clone()
    }

    /// Asks for a pause, a stop or another speed. The order goes directly to the real-time thread
    /// and acts in its next period, whatever the planner is doing. Returns the number of the order,
    /// for [`Progress::has`].
    pub fn control(&self, control: Control) -> u32 {
        self.steering.control(control)
    }

    /// The progress of the motion, as of the last servo period.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.steering.progress()
    }

    /// Jogs the arm: it moves as long as each request comes within the timeout of the one before,
    /// then stops on its path. A change of direction is a stop and a new start.
    ///
    /// # Errors
    /// [`JogError`]: a program is running, a fault is latched, or the arm cannot move in that direction.
    pub fn jog(&self, jog: Jog) -> Result<(), JogError> {
        // While a program runs, the worker may be planning; its answer is known.
        if self.shared.inbox().is_busy() {
            return Err(JogError::Program);
        }
        let (answer, answered) = mpsc::channel();
        if self.orders.send(Order::Jog(jog, answer)).is_err() {
            return Err(JogError::Closed);
        }
        answered.recv().unwrap_or(Err(JogError::Closed))
    }

    /// Asks for a new session with the driver, which clears the latched fault. Returns the number
    /// of the fault: [`Progress::fault`] shows it until it is cleared.
    ///
    /// # Errors
    /// [`NoFault`]; the request then has no later effect.
    pub fn recover(&self) -> Result<u32, NoFault> {
        self.steering.recover()
    }

    /// The next note; `None` if none comes within the time. [`Note::Closed`] is the last.
    #[must_use]
    pub fn note(&self, timeout: Duration) -> Option<Note> {
        match self.notes.recv_timeout(timeout) {
            Ok(note) => Some(note),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Note::Closed),
        }
    }

    /// The status of the session. Values of the motion are of the last servo period; those of the
    /// program are as of the planner's last turn.
    #[must_use]
    pub fn status(&self) -> Status {
        let status = self.shared.status.lock();
        let mut status = status.unwrap_or_else(PoisonError::into_inner).clone();
        (self.live.fill)(&mut status);
        let inbox = self.shared.inbox();
        status.queued = inbox.waiting();
        status.single_step = inbox.is_single_step();
        status.idle &= !inbox.is_busy();
        status
    }

    /// What was recorded since the last call, up to the last servo period, whatever the planner does.
    #[must_use]
    pub fn samples(&self) -> Vec<RunSample> {
        (self.live.read)();
        std::mem::take(
            &mut *self
                .shared
                .samples
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        )
    }

    /// Stops the arm on the path, says goodbye to the driver and ends both threads. Afterwards
    /// [`Session::samples`] returns the remaining samples, until the arm rests.
    pub fn close(&mut self) {
        self.end();
    }

    fn end(&mut self) {
        let Some(worker) = self.worker.take() else {
            return;
        };
        // Directly to the real-time thread: the worker may be planning.
        self.steering.shut_down();
        let _ = self.orders.send(Order::Close);
        let rest = Instant::now() + LAST_REST;
        while !self.steering.progress().ended && !worker.is_finished() && Instant::now() < rest {
            sleep(Duration::from_micros(500));
        }
        let patience = Instant::now() + LAST_THOUGHT;
        while !worker.is_finished() && Instant::now() < patience {
            sleep(Duration::from_micros(500));
        }
        if worker.is_finished() {
            // A worker that panicked has already printed it.
            let _ = worker.join();
        }
        // A worker that still plans is not waited for: it holds neither the driver nor a file.
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end();
    }
}
