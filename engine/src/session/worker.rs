//! The worker: takes commands, plans ahead, feeds the executor, reports in order.

mod guarding;
mod in_flight;
mod jogging;
mod motion;
mod replacing;
mod reports;
mod sampling;
mod streaming;
mod tools;

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use ipc::Clock;
use kinematics::Chain;
use realtime::{Piece, Segment};
use trajectory::ToolLimits;

use in_flight::InFlight;
use jogging::Jogging;
use motion::{end_tolerance, motion};
use sampling::Sampling;
use streaming::Streaming;
use tools::{payload, tool_order};

use super::note::Note;
use super::status::state_name;
use super::{Begun, Live, Order, SessionConfig, SessionError, Shared, Status, Timing};
use crate::queue::Given;
use planner::command_error::CommandError;
use planner::controller::{AnyStep, Controller, Step};
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use planner::task::Task;
use servo::{
    Arrival, Events, Executor, ExecutorConfig, FeedForward, Monitor, Remote, SegmentSender,
    Steering, Work,
};

/// Largest number of commands in work, the one that moves among them.
const AHEAD: usize = 8;
/// How long a tool may take beyond its nominal time, s.
const TOOL_PATIENCE: f64 = 5.0;

/// The worker's ends of the channels.
pub(super) struct Ends {
    pub orders: Receiver<Order>,
    pub notes: Sender<Note>,
    pub shared: Arc<Shared>,
}

pub(super) struct Worker<'a, const N: usize> {
    config: &'a SessionConfig,
    /// Largest speeds of the controlled point, for jogs.
    pub(super) most: ToolLimits,
    pub(super) controller: Controller<N>,
    pub(super) sender: SegmentSender<N>,
    events: Events<N>,
    sampling: Arc<Mutex<Sampling<N>>>,
    pub(super) remote: Remote<N>,
    steering: Steering,
    /// How many aborts were carried out: commands of another epoch wait or are dropped.
    epoch: u32,
    /// Aborts of jogs that are not finished yet.
    pub(super) jog_aborts: u32,
    /// The chain in use, for computing the controlled point in other threads.
    seen: Arc<Mutex<Chain<N>>>,
    /// What still has to go through the ring.
    pub(super) work: VecDeque<Work<N>>,
    pub(super) flight: VecDeque<InFlight<N>>,
    jogging: Option<Jogging>,
    /// The move under way that is not planned to its end.
    streaming: Option<Streaming<N>>,
    /// Number of the newest order when a refusal held the arm; a later `Resume` releases it.
    held: Option<u32>,
    pub(super) fault: Option<String>,
    /// Whether the last command that was to take the place of another has done so; nothing as long
    /// as there is no answer.
    spliced: Option<(u32, bool)>,
    closing: bool,
    ends: Ends,
}

/// Runs a session until it is closed.
pub(super) fn run<const N: usize>(
    robot: &Robot,
    config: &SessionConfig,
    ends: Ends,
    begin: &SyncSender<Result<Begun, SessionError>>,
) {
    let (executor, mut worker) = match start::<N>(robot, config, ends) {
        Ok(started) => started,
        Err(error) => {
            // The caller waits for exactly this answer.
            let _ = begin.send(Err(error));
            return;
        }
    };
    let begun = Begun {
        warning: executor.warning.clone(),
        driver: executor.driver.clone(),
        start: worker.controller.joints().as_slice().to_vec(),
        steering: worker.steering.clone(),
        live: worker.live(),
    };
    worker.write_status(robot, &executor.driver);
    let _ = begin.send(Ok(begun));
    while !worker.closing {
        worker.turn();
        worker.write_status(robot, &executor.driver);
    }
    worker.ends.shared.inbox().close();
    executor.shutdown();
    worker.read_reports();
    worker.say(Note::Closed);
}

fn start<'a, const N: usize>(
    robot: &Robot,
    config: &'a SessionConfig,
    ends: Ends,
) -> Result<(Executor<N>, Worker<'a, N>), SessionError> {
    let mut controller = Controller::<N>::new(robot, config.rate_hz, config.default_length)?;
    let mut wanted = ExecutorConfig::new(config.arm.clone(), *controller.limits());
    wanted.rate_hz = config.rate_hz;
    wanted.clock = config.clock;
    wanted.wait_for_planner = config.clock == Clock::LockStep;
    wanted.record = config.record;
    wanted.connect = config.connect;
    wanted.on_wait = config.on_wait;
    wanted.arrival = Arrival {
        tolerance: robot.arrival.tolerance,
        patience: Duration::from_secs_f64(robot.arrival.patience),
    };
    wanted.model = ipc::model_hash(robot.urdf.as_bytes());
    wanted.feed_forward = robot
        .efforts::<N>()
        .map(|efforts| FeedForward::new(move |[q, dq, ddq]| efforts.dynamics.effort(q, dq, ddq)));
    wanted.payload = payload(controller.modal().tooling());
    let (executor, sender, monitor) = Executor::start(wanted)?;
    let Monitor { events, samples } = monitor;
    let remote = executor.remote();
    controller.set_joints(remote.measured().setpoint);
    let worker = Worker {
        config,
        most: robot.motion_limits(),
        sampling: Arc::new(Mutex::new(Sampling::new(samples, *controller.chain()))),
        seen: Arc::new(Mutex::new(*controller.chain())),
        controller,
        sender,
        events,
        steering: remote.steering(),
        epoch: remote.steering().aborts(),
        jog_aborts: 0,
        remote,
        work: VecDeque::new(),
        flight: VecDeque::new(),
        jogging: None,
        streaming: None,
        held: None,
        fault: None,
        spliced: None,
        closing: false,
        ends,
    };
    Ok((executor, worker))
}

impl<const N: usize> Worker<'_, N> {
    /// One turn: orders, reports, then the next command and what fits into the ring.
    fn turn(&mut self) {
        self.read_orders();
        self.read_reports();
        self.report_done();
        self.watch_jog();
        if self.wants_window() {
            self.sender.settle(None);
            self.plan_window();
        } else if self.may_take() {
            self.sender.settle(None);
            self.take_next();
        }
        let all_fits = self.feed();
        if !all_fits || !(self.may_take() || self.wants_window()) {
            self.sender.settle(Some(self.events.seen()));
        }
    }

    /// Whether the next command can be planned now.
    fn may_take(&self) -> bool {
        self.flight.len() < AHEAD
            && self.work.is_empty()
            && !self.is_held()
            && self.fault.is_none()
            && self.jogging.is_none()
            && self.streaming.is_none()
            // Where a guarded command ends is not known before.
            && self.flight.iter().all(|flight| flight.guarding.is_none())
            // During an abort it is not known where the next command begins.
            && self.steering.aborts() == self.epoch
            && self.ends.shared.inbox().has(self.epoch)
    }

    /// Whether a refusal holds the arm until a `Resume` comes.
    pub(super) fn is_held(&self) -> bool {
        self.held
            .is_some_and(|order| !self.steering.was_resumed_after(order))
    }

    fn read_orders(&mut self) {
        let waiting = self.ends.shared.inbox().has(self.epoch) && self.flight.len() < AHEAD;
        let busy = !self.work.is_empty() || waiting || self.streaming.is_some();
        // In lock-step the driver waits for this thread.
        let stepping = self.config.clock == Clock::LockStep && !self.flight.is_empty();
        // Nothing comes from the servo thread more often than once in a period.
        let idle = (0.5 / self.config.rate_hz).clamp(0.0005, 0.005);
        let wait = if busy || stepping { 20e-6 } else { idle };
        let wait = Duration::from_secs_f64(wait);
        let mut order = match self.ends.orders.recv_timeout(wait) {
            Ok(order) => Some(order),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Order::Close),
        };
        while let Some(given) = order {
            self.obey(given);
            order = self.ends.orders.try_recv().ok();
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            // It only ends the waiting; the inbox is read in every turn.
            Order::Look => {}
            Order::Jog(jog, answer) => {
                let result = self.jog(jog);
                // The caller may have ended; the dead man's switch ends the jog.
                let _ = answer.send(result);
            }
            Order::Replace(commands, answer) => {
                let result = self.replace(commands);
                // The caller may have ended; then the move goes on to its end.
                let _ = answer.send(result);
            }
            Order::Close => self.closing = true,
        }
    }

    /// Whether commands wait or are being executed.
    pub(super) fn has_program(&self) -> bool {
        !self.flight.is_empty() || !self.ends.shared.inbox().is_empty()
    }

    /// Takes the next command off the queue and turns it into work.
    fn take_next(&mut self) {
        let Some(queued) = self.ends.shared.inbox().take(self.epoch) else {
            return;
        };
        // Read before the command is planned: a later resume comes after the refusal was visible.
        let newest = self.steering.newest();
        let given = queued.given;
        let language = matches!(given, Given::Command { .. });
        let chain = *self.controller.chain();
        let mut flight = self.take_off(queued.id, (given.line(), given.name()), chain, newest);
        if let Some(windowed) = self.begin(&given) {
            self.stream(&mut flight, windowed);
            self.flight.push_back(flight);
            return;
        }
        match self.step(given) {
            Ok(step) => {
                flight.planned_s = step.ticks as f64 / self.config.rate_hz;
                self.enlist(&mut flight, step, language);
            }
            Err(error) => {
                self.refuse(&mut flight, error, language);
                flight.finished = Some(0);
            }
        }
        self.flight.push_back(flight);
    }

    /// A command that will be executed, with the chain that it begins with; `newest` is the newest order
    /// when it was taken.
    fn take_off(
        &self,
        id: u32,
        named: (usize, &'static str),
        chain: Chain<N>,
        newest: u32,
    ) -> InFlight<N> {
        self.sampling
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .begin(id, chain);
        InFlight::new(id, named, chain, newest)
    }

    /// A command of the language or a trajectory has failed: says so when its turn comes, and does
    /// what is to be done then.
    fn refuse(&mut self, flight: &mut InFlight<N>, error: CommandError, language: bool) {
        let dropped = match self.config.on_refusal {
            FailurePolicy::Abort => {
                if language {
                    self.controller.abort();
                }
                self.ends.shared.inbox().drop_all(None)
            }
            FailurePolicy::Hold => {
                self.held = Some(flight.newest);
                0
            }
            FailurePolicy::Skip => 0,
        };
        let (id, line, name) = (flight.id, flight.line, flight.name);
        flight.says = Some(Note::Refused {
            id,
            line,
            name,
            error,
            dropped,
        });
        flight.refused = true;
    }

    /// The step of what left the queue: planned before, or planned now.
    fn step(&mut self, given: Given) -> Result<Step<N>, CommandError> {
        let (located, planned) = match given {
            Given::Command { located, planned } => (located, planned),
            Given::Timed(timed) => return self.controller.step_timed(&timed, &self.most),
        };
        let planned = planned
            .and_then(AnyStep::into_step::<N>)
            .filter(|planned| self.controller.follow(planned));
        match planned {
            Some(planned) => Ok(planned.step),
            None => self.controller.step(&located.command),
        }
    }

    /// The work of one step; a command without work is finished at once. The tolerances of the end are
    /// for commands of the `language`.
    fn enlist(&mut self, flight: &mut InFlight<N>, step: Step<N>, language: bool) {
        let command = flight.id;
        self.enlist_guards(flight, &step);
        match step.task {
            Task::Message { text } => flight.says = Some(Note::Message { text }),
            Task::End { reason } => flight.says = Some(Note::Ended { reason }),
            Task::Dwell { .. } if step.ticks > 0 => {
                let piece = Piece::hold(*self.controller.joints(), flight.planned_s);
                self.work.push_back(Work::Motion(Segment {
                    piece,
                    command,
                    last: true,
                }));
                return;
            }
            Task::Tool(action) => {
                let tooling = self.controller.modal().tooling();
                let order = tool_order(command, action, flight.planned_s, tooling);
                self.work.push_back(Work::Tool(order));
                return;
            }
            _ => {}
        }
        let pieces = step
            .planned
            .as_ref()
            .map_or(&[][..], |planned| planned.trajectory.pieces());
        let end = end_tolerance(command, pieces, &self.controller).filter(|_| language);
        self.work.extend(motion(command, pieces, true, end));
        if !pieces.is_empty() {
            flight.motion = step.planned.map(|planned| planned.trajectory);
            return;
        }
        if flight.guarding.is_some() {
            // The guards are looked at for a period, although nothing moves.
            let piece = Piece::hold(*self.controller.joints(), 1.0 / self.config.rate_hz);
            self.work.push_back(Work::Motion(Segment {
                piece,
                command,
                last: true,
            }));
        } else {
            flight.finished = Some(0);
        }
    }

    /// Sends what fits into the ring; returns whether all of it did.
    fn feed(&mut self) -> bool {
        while let Some(work) = self.work.front() {
            if self.sender.hand_over(*work).is_err() {
                return false;
            }
            self.work.pop_front();
        }
        true
    }

    fn write_status(&self, robot: &Robot, driver: &str) {
        *self.seen.lock().unwrap_or_else(PoisonError::into_inner) = *self.controller.chain();
        self.ends.shared.inbox().set_flying(self.flight.len());
        let mut status = self
            .ends
            .shared
            .status
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        self.config.arm.to_string().clone_into(&mut status.arm);
        robot.name.clone_into(&mut status.robot);
        if status.sliding.is_empty() {
            status.sliding = robot.sliding();
            status.joint_names = robot.joint_names();
        }
        driver.clone_into(&mut status.driver);
        status.state = state_name(self.controller.modal().state());
        let jog = self.jogging.as_ref().map(|_| "jog");
        status.command = self.flight.front().map(|flight| flight.name).or(jog);
        status.idle = self.flight.is_empty() && self.jogging.is_none();
        status.held = self.is_held();
        status.plans = self.controller.plans();
        status.fault.clone_from(&self.fault);
        status.largest = Some(self.most.into());
        status.settings = Some(self.controller.modal().settings().clone());
    }

    /// Fills in a status and reads samples without this thread.
    fn live(&self) -> Live {
        let (remote, chain) = (self.remote.clone(), Arc::clone(&self.seen));
        let (sampling, seen) = (Arc::clone(&self.sampling), Arc::clone(&self.seen));
        let shared = Arc::clone(&self.ends.shared);
        let read = move || {
            let mut sampling = sampling.lock().unwrap_or_else(PoisonError::into_inner);
            sampling.read(&seen, &shared.samples);
        };
        let fill = move |status: &mut Status| {
            let now = remote.measured();
            status.idle &= now.idle;
            status.held |= now.held;
            status.time_scaling = now.time_scaling;
            status.speed_asked = now.speed_asked;
            status.joints = now.position.as_slice().to_vec();
            status.setpoint = now.setpoint.as_slice().to_vec();
            let chain = chain.lock().unwrap_or_else(PoisonError::into_inner);
            status.set_pose(&chain.forward(&now.position));
            status.cycles = remote.counters().into();
            status.timing = Timing {
                wake_up: remote.latency().into(),
                work: remote.work().into(),
            };
        };
        Live {
            fill: Box::new(fill),
            read: Box::new(read),
        }
    }

    pub(super) fn say(&self, note: Note) {
        // The receiver may have been dropped.
        let _ = self.ends.notes.send(note);
    }
}
