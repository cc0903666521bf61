//! The worker: takes commands, plans ahead, feeds the executor, reports in order.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use ipc::Clock;
use kinematics::Chain;
use nalgebra::SVector;
use realtime::{Piece, Segment};
use trajectory::ToolLimits;

use super::jog::Jogging;
use super::note::{Blame, Note};
use super::status::state_name;
use super::{Begun, Order, RunSample, SessionConfig, SessionError, Shared, SubmitError};
use crate::queue::{Full, Queue};
use planner::controller::{Controller, Step};
use planner::dry_run::FailurePolicy;
use planner::robot::Robot;
use planner::task::{Task, ToolAction};
use servo::{
    Control, Event, Executor, ExecutorConfig, Fault, Feeder, Monitor, Recorded, Remote, ToolOrder,
};

/// How many commands are planned ahead of the one that moves.
const AHEAD: usize = 8;
/// How many reported commands the tool is known of, for samples that come late.
const CHAINS: usize = 64;
/// How long a tool may take beyond its nominal time, s.
const TOOL_PATIENCE: f64 = 5.0;

/// The worker's ends of the channels.
pub(super) struct Ends {
    pub orders: Receiver<Order>,
    pub notes: Sender<Note>,
    pub shared: Arc<Shared>,
}

/// What still has to go through the ring.
pub(super) enum Work<const N: usize> {
    Motion(Segment<N>),
    Tool(ToolOrder),
}

/// A command that left the queue and is not yet reported.
pub(super) struct InFlight<const N: usize> {
    id: u32,
    line: usize,
    name: &'static str,
    planned_s: f64,
    chain: Chain<N>,
    started: Option<u64>,
    finished: Option<u64>,
    /// What is reported beside `Done` when its turn comes.
    says: Option<Note>,
    /// A refused command is reported as such and not as done.
    refused: bool,
}

pub(super) struct Worker<'a, const N: usize> {
    config: &'a SessionConfig,
    /// Largest speeds of the controlled point, for jogs.
    pub(super) most: ToolLimits,
    pub(super) controller: Controller<N>,
    pub(super) queue: Queue,
    pub(super) feeder: Feeder<N>,
    monitor: Monitor<N>,
    pub(super) remote: Remote<N>,
    pub(super) work: VecDeque<Work<N>>,
    pub(super) flight: VecDeque<InFlight<N>>,
    pub(super) jogging: Option<Jogging>,
    /// Tool in force for recorded samples, of the last commands that were reported.
    chains: VecDeque<(u32, Chain<N>)>,
    pub(super) held: bool,
    pub(super) fault: Option<String>,
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
    };
    worker.write_status(robot, &executor.driver);
    let _ = begin.send(Ok(begun));
    while !worker.closing {
        worker.turn();
        worker.write_status(robot, &executor.driver);
    }
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
    let limits = controller.limits();
    let limits = realtime::Limits {
        lower: limits.lower,
        upper: limits.upper,
        velocity: limits.velocity,
        acceleration: limits.acceleration,
        jerk: limits.jerk,
    };
    let mut wanted = ExecutorConfig::new(config.arm.clone(), limits);
    wanted.rate_hz = config.rate_hz;
    wanted.clock = config.clock;
    wanted.wait_for_planner = config.clock == Clock::LockStep;
    wanted.record = config.record;
    wanted.connect = config.connect;
    wanted.model = ipc::model_hash(robot.urdf.as_bytes());
    let (executor, feeder, monitor) = Executor::start(wanted)?;
    let remote = executor.remote();
    controller.set_joints(remote.measured().setpoint);
    let worker = Worker {
        config,
        most: robot.motion_limits(),
        queue: Queue::new(config.capacity),
        chains: VecDeque::from([(0, *controller.chain())]),
        controller,
        feeder,
        monitor,
        remote,
        work: VecDeque::new(),
        flight: VecDeque::new(),
        jogging: None,
        held: false,
        fault: None,
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
        if self.may_take() {
            self.feeder.settle(None);
            self.take_next();
        }
        let all_fits = self.feed();
        if !all_fits || !self.may_take() {
            self.feeder.settle(Some(self.monitor.seen()));
        }
    }

    /// Whether the next command can be planned now.
    fn may_take(&self) -> bool {
        self.flight.len() < AHEAD
            && self.work.is_empty()
            && !self.held
            && self.fault.is_none()
            && !self.queue.is_empty()
            && self.jogging.is_none()
    }

    fn read_orders(&mut self) {
        let busy = !self.work.is_empty() || (!self.queue.is_empty() && self.flight.len() < AHEAD);
        // In lock-step the other side waits for us.
        let stepping = self.config.clock == Clock::LockStep && !self.flight.is_empty();
        let wait = Duration::from_micros(if busy || stepping { 20 } else { 500 });
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
            Order::Submit(commands, answer) => {
                let result = self.submit(commands);
                // The client may have gone; its commands stay.
                let _ = answer.send(result);
            }
            Order::Control(control) => self.control(control),
            Order::Jog(jog, answer) => {
                let result = self.jog(jog);
                // Who asked may have gone; the dead man's switch ends the jog.
                let _ = answer.send(result);
            }
            Order::Recover => self.remote.recover(),
            Order::Close => self.closing = true,
        }
    }

    fn submit(&mut self, commands: Vec<crcl::Located>) -> Result<Vec<u32>, SubmitError> {
        if let Some(fault) = &self.fault {
            return Err(SubmitError::Fault(fault.clone()));
        }
        if self.queue.len() + commands.len() > self.config.capacity {
            return Err(SubmitError::Full(Full {
                capacity: self.config.capacity,
            }));
        }
        let mut ids = Vec::with_capacity(commands.len());
        for located in commands {
            if let crcl::Command::StopMotion { emergency } = located.command
                && !self.flight.is_empty()
            {
                // A stop does not wait behind what it is to stop.
                self.control(Control::Stop {
                    fast: emergency != 0,
                });
            }
            ids.push(self.queue.push(located)?);
        }
        Ok(ids)
    }

    fn control(&mut self, control: Control) {
        if control == Control::Resume {
            self.held = false;
        }
        self.remote.control(control);
    }

    /// Takes the next command off the queue and turns it into work.
    fn take_next(&mut self) {
        let Some(queued) = self.queue.pop() else {
            return;
        };
        let command = &queued.located.command;
        let mut flight = InFlight {
            id: queued.id,
            line: queued.located.line,
            name: command.name(),
            planned_s: 0.0,
            chain: *self.controller.chain(),
            started: None,
            finished: None,
            says: None,
            refused: false,
        };
        match self.controller.step(command) {
            Ok(step) => {
                flight.planned_s = step.ticks as f64 / self.config.rate_hz;
                self.enlist(&mut flight, step);
            }
            Err(error) => {
                let dropped = match self.config.on_refusal {
                    FailurePolicy::Abort => {
                        self.controller.abort();
                        self.queue.flush()
                    }
                    FailurePolicy::Hold => {
                        self.held = true;
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
                flight.finished = Some(0);
            }
        }
        self.flight.push_back(flight);
    }

    /// The work of one step; a command without work is finished at once.
    fn enlist(&mut self, flight: &mut InFlight<N>, step: Step<N>) {
        let command = flight.id;
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
                let order = tool_order(command, action, flight.planned_s);
                self.work.push_back(Work::Tool(order));
                return;
            }
            _ => {}
        }
        let pieces = step
            .planned
            .as_ref()
            .map_or(&[][..], |planned| planned.trajectory.pieces());
        for (index, piece) in pieces.iter().enumerate() {
            let last = index + 1 == pieces.len();
            self.work.push_back(Work::Motion(Segment {
                piece: *piece,
                command,
                last,
            }));
        }
        if pieces.is_empty() {
            flight.finished = Some(0);
        }
    }

    /// Hands over what fits into the ring; says whether all of it did.
    fn feed(&mut self) -> bool {
        while let Some(work) = self.work.front() {
            let taken = match work {
                Work::Motion(segment) => self.feeder.push(*segment),
                Work::Tool(order) => self.feeder.tool(*order),
            };
            if taken.is_err() {
                return false;
            }
            self.work.pop_front();
        }
        true
    }

    fn read_reports(&mut self) {
        while let Some(sample) = self.monitor.sample() {
            self.record(&sample);
        }
        while let Some(event) = self.monitor.event() {
            self.on_event(event);
        }
    }

    fn on_event(&mut self, event: Event) {
        match event {
            Event::Started { command, tick } => {
                let Some(flight) = self.flight.iter_mut().find(|f| f.id == command) else {
                    return;
                };
                flight.started = Some(tick);
                let (id, line, name) = (flight.id, flight.line, flight.name);
                let planned_s = flight.planned_s;
                // What came before has ended, and is reported before.
                self.report_done();
                self.say(Note::Started {
                    id,
                    line,
                    name,
                    planned_s,
                    tick,
                });
            }
            Event::Finished { command, .. } if self.jog_finished(command) => {}
            Event::Finished { command, tick } => {
                if let Some(flight) = self.flight.iter_mut().find(|f| f.id == command) {
                    flight.finished = Some(tick);
                }
                self.report_done();
            }
            Event::Stopped { .. } => self.say(Note::Stopped),
            Event::Aborted { .. } if self.rest_from_jog() => {}
            Event::Aborted { .. } => {
                let dropped = self.drop_all();
                self.say(Note::Aborted { dropped });
            }
            Event::Faulted { fault, tick } => {
                let (blame, reason) = (blame(&fault), fault.to_string());
                let dropped = self.drop_all();
                self.fault = Some(reason.clone());
                self.say(Note::Faulted {
                    blame,
                    reason,
                    tick,
                    dropped,
                });
            }
            Event::Recovered { .. } => {
                let dropped = self.drop_all();
                self.fault = None;
                tracing::debug!(dropped, "recovered");
                self.say(Note::Recovered);
            }
            Event::Ended { .. } => self.closing = true,
        }
    }

    /// Forgets all that is planned or queued and begins again from where the arm is.
    fn drop_all(&mut self) -> usize {
        let dropped = self.queue.flush() + self.flight.len();
        self.work.clear();
        self.flight.clear();
        self.jogging = None;
        self.feeder.renew();
        self.held = false;
        self.controller.abort();
        self.controller.set_joints(self.remote.measured().setpoint);
        dropped
    }

    /// Reports, in order, every command that has ended.
    fn report_done(&mut self) {
        while self
            .flight
            .front()
            .is_some_and(|flight| flight.finished.is_some())
        {
            let Some(flight) = self.flight.pop_front() else {
                return;
            };
            if let Some(note) = flight.says {
                self.say(note);
            }
            self.chains.push_back((flight.id, flight.chain));
            if self.chains.len() > CHAINS {
                self.chains.pop_front();
            }
            if flight.refused {
                continue;
            }
            let ticks = match (flight.started, flight.finished) {
                (Some(from), Some(to)) => to.saturating_sub(from),
                _ => 0,
            };
            let (id, line, name) = (flight.id, flight.line, flight.name);
            self.say(Note::Done {
                id,
                line,
                name,
                ticks,
            });
        }
    }

    fn record(&self, sample: &Recorded<N>) {
        let flying = self.flight.iter().map(|flight| (flight.id, &flight.chain));
        let reported = self.chains.iter().rev().map(|(id, chain)| (*id, chain));
        // Command 0 is the time before the first; one that is forgotten was long ago.
        let chain = flying
            .chain(reported)
            .find_map(|(id, chain)| (id == sample.command).then_some(chain))
            .unwrap_or_else(|| self.controller.chain());
        let list = |vector: &SVector<f64, N>| vector.as_slice().to_vec();
        let measured = SVector::from(sample.measured);
        let recorded = RunSample {
            tick: sample.tick,
            command: sample.command,
            path_time: sample.path_time,
            q: list(&sample.setpoint.position),
            dq: list(&sample.setpoint.velocity),
            ddq: list(&sample.setpoint.acceleration),
            measured: sample.measured.to_vec(),
            workstation_from_tool: chain.forward(&sample.setpoint.position),
            measured_pose: chain.forward(&measured),
        };
        let samples = &self.ends.shared.samples;
        samples
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(recorded);
    }

    fn write_status(&self, robot: &Robot, driver: &str) {
        let now = self.remote.measured();
        let mut status = self
            .ends
            .shared
            .status
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        self.config.arm.to_string().clone_into(&mut status.arm);
        robot.name.clone_into(&mut status.robot);
        driver.clone_into(&mut status.driver);
        status.state = state_name(self.controller.modal().state());
        let jog = self.jogging.as_ref().map(|_| "jog");
        status.command = self.flight.front().map(|flight| flight.name).or(jog);
        status.queued = self.queue.len() + self.flight.len().saturating_sub(1);
        status.idle =
            now.idle && self.flight.is_empty() && self.queue.is_empty() && self.jogging.is_none();
        status.held = now.held || self.held;
        status.fault.clone_from(&self.fault);
        status.path_rate = now.path_rate;
        status.joints = now.position.as_slice().to_vec();
        status.setpoint = now.setpoint.as_slice().to_vec();
        status.set_pose(&self.controller.chain().forward(&now.position));
        status.settings = Some(self.controller.modal().settings().clone());
        status.cycles = self.remote.counters().into();
    }

    pub(super) fn say(&self, note: Note) {
        // Nobody has to listen.
        let _ = self.ends.notes.send(note);
    }
}

fn tool_order(command: u32, action: ToolAction, nominal: f64) -> ToolOrder {
    let (tool, action) = match action {
        ToolAction::OpenGripper => (ipc::GRIPPER, ipc::ToolAction::Open),
        ToolAction::CloseGripper => (ipc::GRIPPER, ipc::ToolAction::Close),
        ToolAction::OpenToolChanger => (ipc::TOOL_CHANGER, ipc::ToolAction::Open),
        ToolAction::CloseToolChanger => (ipc::TOOL_CHANGER, ipc::ToolAction::Close),
    };
    ToolOrder {
        command,
        tool,
        action,
        timeout: nominal + TOOL_PATIENCE,
    }
}

fn blame(fault: &Fault) -> Blame {
    match fault {
        Fault::Limit(_) | Fault::BrokenSegment | Fault::Stalled { .. } => Blame::Guard,
        _ => Blame::Driver,
    }
}
