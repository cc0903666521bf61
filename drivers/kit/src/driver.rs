//! The driver's side of the protocol, without a clock and without a channel.

use ipc::{
    Clock, DriverState, FaultCode, Hello, HelloAck, MAX_TOOLS, Setpoint, SetpointFlags, State,
    ToolAction, Verdict, bytes_of, text_of,
};
use realtime::Bounds;

use crate::{About, DriverError, Measured, Reference, Robot};

/// How far the first setpoint of a session may be from the measured position (rad).
const FIRST: f64 = 1e-3;

/// Room for a setpoint beside what speed and time allow (rad).
const ROOM: f64 = 2e-3;

/// What an engine and the driver agreed on.
#[derive(Clone, Debug)]
struct Session {
    number: u64,
    owner: String,
    process: u32,
    period_ns: u64,
    watchdog_ns: u64,
    clock: Clock,
}

/// A robot with the driver's side of the protocol. Times go in as numbers, so that the same
/// setpoints at the same times give the same states.
#[derive(Clone, Debug)]
pub struct Driver<R> {
    robot: R,
    about: About,
    state: DriverState,
    fault: FaultCode,
    fault_joint: u32,
    session: Option<Session>,
    sessions: u64,
    measured: Vec<Measured>,
    references: Vec<Reference>,
    orders: [u32; MAX_TOOLS],
    last: Setpoint,
    fresh: bool,
    received_ns: u64,
    sequence: u64,
    missed: u64,
    missed_ever: u64,
    reported: State,
}

impl<R: Robot> Driver<R> {
    /// A robot at rest.
    ///
    /// # Errors
    /// When what it says of itself does not fit together.
    pub fn new(mut robot: R) -> Result<Self, DriverError> {
        let about = robot.about();
        about.check()?;
        let mut measured = vec![Measured::default(); about.joints()];
        robot.measure(&mut measured);
        let at = measured.iter().map(|joint| Reference::rest(joint.position));
        Ok(Self {
            state: DriverState::Disconnected,
            fault: FaultCode::None,
            fault_joint: u32::MAX,
            session: None,
            sessions: 0,
            references: at.collect(),
            orders: [0; MAX_TOOLS],
            last: Setpoint::default(),
            fresh: false,
            received_ns: 0,
            sequence: 0,
            missed: 0,
            missed_ever: 0,
            reported: State::default(),
            robot,
            about,
            measured,
        })
    }

    /// The robot.
    pub fn robot(&self) -> &R {
        &self.robot
    }

    /// Where the driver is in its life.
    pub fn state(&self) -> DriverState {
        self.state
    }

    /// The latched fault.
    pub fn fault(&self) -> FaultCode {
        self.fault
    }

    /// How many sessions were opened.
    pub fn sessions(&self) -> u64 {
        self.sessions
    }

    /// Periods without a new setpoint, in all sessions.
    pub fn missed_in_all(&self) -> u64 {
        self.missed_ever
    }

    /// The clock of the session under way.
    pub fn clock(&self) -> Option<Clock> {
        self.session.as_ref().map(|session| session.clock)
    }

    /// The period of the session under way (ns).
    pub fn period_ns(&self) -> Option<u64> {
        self.session.as_ref().map(|session| session.period_ns)
    }

    /// The watchdog of the session under way (ns).
    pub fn watchdog_ns(&self) -> Option<u64> {
        self.session.as_ref().map(|session| session.watchdog_ns)
    }

    /// Whether a setpoint belongs to the session under way.
    pub fn is_of_session(&self, setpoint: &Setpoint) -> bool {
        let session = self.session.as_ref();
        session.is_some_and(|session| session.number == setpoint.session)
    }

    /// How many joints there are.
    pub fn joints(&self) -> usize {
        self.about.joints()
    }

    /// Where a joint was measured (rad); not a number where there is no such joint.
    pub fn position(&self, joint: usize) -> f64 {
        self.measured
            .get(joint)
            .map_or(f64::NAN, |joint| joint.position)
    }

    /// The last setpoint that was accepted.
    pub fn last_setpoint(&self) -> &Setpoint {
        &self.last
    }

    /// Answers a request for a session at `now_ns`.
    pub fn greet(&mut self, hello: &Hello, now_ns: u64) -> HelloAck {
        let joints = self.joints();
        if let Some((verdict, reason)) = self.objection(hello) {
            let mut ack = HelloAck::refusal(joints, verdict, &reason);
            ack.name = bytes_of(&self.about.name);
            return ack;
        }
        self.sessions += 1;
        // Unlike any session of a driver process before, so that old setpoints do not fit.
        let number = (now_ns | 1).wrapping_add(self.sessions << 1).max(1);
        self.session = Some(Session {
            number,
            owner: text_of(&hello.name),
            process: hello.process,
            period_ns: hello.period_ns,
            watchdog_ns: hello.watchdog_ns,
            clock: Clock::from_number(hello.clock).unwrap_or(Clock::Wall),
        });
        self.state = DriverState::Synced;
        self.fault = FaultCode::None;
        self.fault_joint = u32::MAX;
        self.fresh = false;
        self.last = Setpoint::default();
        self.missed = 0;
        self.received_ns = now_ns;
        for (joint, reference) in self.measured.iter().zip(&mut self.references) {
            *reference = Reference::rest(joint.position);
        }
        self.orders = [0; MAX_TOOLS];
        self.welcome(number, hello.watchdog_ns)
    }

    fn welcome(&self, session: u64, watchdog_ns: u64) -> HelloAck {
        let mut ack = HelloAck::refusal(self.joints(), Verdict::Welcome, "");
        ack.session = session;
        ack.watchdog_ns = watchdog_ns;
        ack.name = bytes_of(&self.about.name);
        for (joint, measured) in self.measured.iter().enumerate() {
            ack.position[joint] = measured.position;
            ack.lower[joint] = self.about.lower[joint];
            ack.upper[joint] = self.about.upper[joint];
            ack.velocity[joint] = self.about.velocity[joint];
        }
        ack
    }

    /// Why there can be no session now.
    fn objection(&self, hello: &Hello) -> Option<(Verdict, String)> {
        if let Err(cause) = hello.check(self.joints()) {
            let verdict = match cause {
                ipc::MessageError::Protocol { .. } => Verdict::WrongProtocol,
                ipc::MessageError::Schema { .. } => Verdict::WrongSchema,
                ipc::MessageError::Joints { .. } => Verdict::WrongJoints,
                ipc::MessageError::Choice { .. } => Verdict::WrongClock,
                _ => Verdict::WrongPeriod,
            };
            return Some((verdict, cause.to_string()));
        }
        if self.about.model != 0 && hello.model != 0 && self.about.model != hello.model {
            return Some((
                Verdict::WrongModel,
                format!(
                    "robot model {:#x} here, {:#x} there",
                    self.about.model, hello.model
                ),
            ));
        }
        let resting = self.references.iter().all(Reference::rests);
        match (&self.session, self.state) {
            (Some(session), DriverState::Armed | DriverState::Active)
                if session.process != hello.process =>
            {
                let (owner, process) = (&session.owner, session.process);
                Some((
                    Verdict::Busy,
                    format!("driven by {owner} (process {process})"),
                ))
            }
            _ if !resting => Some((Verdict::NotReady, "the arm still moves".to_owned())),
            _ => None,
        }
    }

    /// Takes a setpoint at `now_ns`. What does not belong to the session is ignored; what makes
    /// no sense stops the arm.
    pub fn receive(&mut self, setpoint: &Setpoint, now_ns: u64) {
        let Some(session) = &self.session else { return };
        let following = matches!(
            self.state,
            DriverState::Synced | DriverState::Armed | DriverState::Active
        );
        if setpoint.session != session.number
            || setpoint.sequence <= self.last.sequence
            || !following
        {
            return;
        }
        if setpoint.check(self.joints()).is_err() {
            self.stop(FaultCode::BadSetpoint, u32::MAX);
            return;
        }
        // After a stall setpoints come together: then the time between them is that of their ticks.
        let ticks = setpoint.tick.saturating_sub(self.last.tick);
        let planned = ticks
            .saturating_mul(session.period_ns)
            .min(session.watchdog_ns);
        let elapsed = now_ns
            .saturating_sub(self.received_ns)
            .max(planned)
            .max(session.period_ns);
        if let Some(joint) = self.unreachable_joint(setpoint, elapsed as f64 * 1e-9) {
            self.stop(FaultCode::OutOfRange, joint as u32);
            return;
        }
        self.last = *setpoint;
        self.received_ns = now_ns;
        if setpoint.flags & SetpointFlags::STOP_REQUEST != 0 {
            self.stop(FaultCode::StopRequest, u32::MAX);
            return;
        }
        if setpoint.flags & SetpointFlags::GOODBYE != 0 {
            self.state = DriverState::Disconnected;
            self.session = None;
            return;
        }
        self.state = match self.state {
            DriverState::Synced => DriverState::Armed,
            _ => DriverState::Active,
        };
        self.fresh = true;
    }

    /// Answers a sign of life: in lock-step a setpoint of the period that was before. Nothing
    /// moves; the answer is the last state with a number of its own.
    pub fn sign_of_life(&mut self, setpoint: &Setpoint) -> Option<State> {
        let repeats = self.is_of_session(setpoint)
            && setpoint.tick == self.last.tick
            && setpoint.flags & (SetpointFlags::GOODBYE | SetpointFlags::STOP_REQUEST) == 0
            && self.last.sequence > 0
            && setpoint.sequence > self.last.sequence;
        if !repeats {
            return None;
        }
        self.last.sequence = setpoint.sequence;
        self.sequence += 1;
        self.reported.sequence = self.sequence;
        self.reported.setpoint_sequence = setpoint.sequence;
        Some(self.reported)
    }

    /// The first joint whose setpoint is out of range, too fast, or further away than the joint
    /// can have come in `elapsed` (s).
    fn unreachable_joint(&self, setpoint: &Setpoint, elapsed: f64) -> Option<usize> {
        let first = self.state == DriverState::Synced;
        (0..self.joints()).find(|&joint| {
            let (at, speed) = (setpoint.position[joint], setpoint.velocity[joint]);
            let most = self.about.velocity[joint] * 1.001;
            // A late setpoint follows on the last one, not on what was made up meanwhile.
            let before = if first {
                self.measured[joint].position
            } else {
                self.last.position[joint]
            };
            let room = if first { FIRST } else { ROOM + most * elapsed };
            at < self.about.lower[joint] - ROOM
                || at > self.about.upper[joint] + ROOM
                || speed.abs() > most
                || (at - before).abs() > room
        })
    }

    fn stop(&mut self, fault: FaultCode, joint: u32) {
        self.fault = fault;
        self.fault_joint = joint;
        self.state = DriverState::Stopping;
    }

    /// One period of `period_ns` that ends at `now_ns`: measures, chooses what to follow, has the
    /// robot follow it, returns the state to send.
    pub fn step(&mut self, now_ns: u64, period_ns: u64) -> State {
        let period = period_ns as f64 * 1e-9;
        self.robot.measure(&mut self.measured);
        self.watch(now_ns);
        let state = self.report(now_ns);
        self.reported = state;
        self.refer(period);
        self.give_orders();
        self.robot.follow(&self.references, period);
        state
    }

    /// Passes on the orders to tools that are new.
    fn give_orders(&mut self) {
        for (tool, order) in self.last.tools.iter().enumerate() {
            if order.order == self.orders[tool] {
                continue;
            }
            self.orders[tool] = order.order;
            match ToolAction::from_number(order.action) {
                None | Some(ToolAction::None) => {}
                Some(action) => self.robot.act(tool, action),
            }
        }
    }

    /// The watchdog, and the end of a stop.
    fn watch(&mut self, now_ns: u64) {
        let following = matches!(self.state, DriverState::Armed | DriverState::Active);
        if let Some(joint) = self.robot.fault().filter(|_| following) {
            self.stop(FaultCode::Hardware, joint);
        }
        let Some(session) = &self.session else { return };
        let silence = now_ns.saturating_sub(self.received_ns);
        match self.state {
            DriverState::Armed | DriverState::Active => {
                if !self.fresh {
                    self.missed += 1;
                    self.missed_ever += 1;
                }
                if silence > session.watchdog_ns {
                    self.stop(FaultCode::Watchdog, u32::MAX);
                }
            }
            DriverState::Synced if silence > session.watchdog_ns.max(1_000_000_000) => {
                self.stop(FaultCode::Watchdog, u32::MAX);
            }
            DriverState::Stopping if self.references.iter().all(Reference::rests) => {
                self.state = DriverState::Fault;
            }
            _ => {}
        }
    }

    /// What the joints follow in this period.
    fn refer(&mut self, period: f64) {
        let fresh = std::mem::take(&mut self.fresh);
        let setpoint = &self.last;
        for (joint, reference) in self.references.iter_mut().enumerate() {
            let rate = self.about.acceleration[joint];
            let change = self.about.jerk[joint];
            match self.state {
                DriverState::Armed | DriverState::Active if fresh => {
                    *reference = Reference {
                        position: setpoint.position[joint],
                        velocity: setpoint.velocity[joint],
                        acceleration: setpoint.acceleration[joint],
                    };
                }
                DriverState::Armed | DriverState::Active => reference.go_on(change, period),
                DriverState::Stopping | DriverState::Disconnected => {
                    reference.brake(Bounds { rate, change }, period);
                }
                _ => {}
            }
        }
    }

    fn report(&mut self, now_ns: u64) -> State {
        self.sequence += 1;
        let mut state = State {
            joints: self.joints() as u32,
            session: self.session.as_ref().map_or(0, |session| session.number),
            sequence: self.sequence,
            measured_ns: now_ns,
            published_ns: now_ns,
            setpoint_sequence: self.last.sequence,
            setpoint_published_ns: self.last.published_ns,
            setpoint_received_ns: self.received_ns,
            driver_state: self.state as u32,
            fault: self.fault as u32,
            fault_joint: self.fault_joint,
            missed: self.missed,
            ..State::default()
        };
        for (joint, measured) in self.measured.iter().enumerate() {
            state.position[joint] = measured.position;
            state.velocity[joint] = measured.velocity;
            state.effort[joint] = measured.effort;
        }
        for (tool, feedback) in state.tools.iter_mut().enumerate() {
            *feedback = self.robot.tool(tool);
            feedback.order = self.orders[tool];
        }
        state
    }
}
