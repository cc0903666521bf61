//! The driver's side of the protocol, without a clock and without a channel.

use ipc::{Clock, DriverState, FaultCode, MAX_TOOLS, Setpoint, SetpointFlags, State, ToolAction};

use crate::{About, DriverError, Limiter, Measured, Reference, Robot};

/// How far the first setpoint of a session may be from the measured position (rad).
const FIRST: f64 = 1e-3;

/// Tolerance of a setpoint's position beyond what speed and time allow (rad).
const ROOM: f64 = 2e-3;

/// Largest velocity and acceleration of a setpoint, as a multiple of the joint's limit: tolerance
/// for rounding.
const MARGIN: f64 = 1.001;

/// What an engine and the driver agreed on.
#[derive(Clone, Debug)]
pub(crate) struct Session {
    pub(crate) number: u64,
    pub(crate) owner: String,
    pub(crate) process: u32,
    pub(crate) period_ns: u64,
    pub(crate) watchdog_ns: u64,
    pub(crate) clock: Clock,
}

/// A robot with the driver's side of the protocol. Times are arguments, so the same setpoints at
/// the same times give the same states.
#[derive(Clone, Debug)]
pub struct Driver<R> {
    pub(crate) robot: R,
    pub(crate) about: About,
    limiters: Vec<Limiter>,
    pub(crate) state: DriverState,
    pub(crate) fault: FaultCode,
    pub(crate) fault_joint: u32,
    pub(crate) session: Option<Session>,
    pub(crate) sessions: u64,
    pub(crate) leaving: bool,
    pub(crate) measured: Vec<Measured>,
    /// What the robot follows.
    pub(crate) references: Vec<Reference>,
    /// The newest setpoint, extrapolated to the present time.
    pub(crate) targets: Vec<Reference>,
    pub(crate) orders: [u32; MAX_TOOLS],
    pub(crate) last: Setpoint,
    pub(crate) fresh: bool,
    pub(crate) received_ns: u64,
    /// When the newest setpoint was sent, by its own time stamp.
    pub(crate) newest_ns: u64,
    /// When the last period was; 0 before the first of a session.
    pub(crate) stepped_ns: u64,
    sequence: u64,
    pub(crate) missed: u64,
    missed_ever: u64,
    reported: State,
}

impl<R: Robot> Driver<R> {
    /// A robot at rest.
    ///
    /// # Errors
    /// When the robot's description is not consistent.
    pub fn new(mut robot: R) -> Result<Self, DriverError> {
        let about = robot.about();
        about.check()?;
        let mut measured = vec![Measured::default(); about.joints()];
        robot.measure(&mut measured);
        let at: Vec<Reference> = measured
            .iter()
            .map(|joint| Reference::rest(joint.position))
            .collect();
        Ok(Self {
            limiters: about.limiters(),
            state: DriverState::Disconnected,
            fault: FaultCode::None,
            fault_joint: u32::MAX,
            session: None,
            sessions: 0,
            leaving: false,
            references: at.clone(),
            targets: at,
            orders: [0; MAX_TOOLS],
            last: Setpoint::default(),
            fresh: false,
            received_ns: 0,
            newest_ns: 0,
            stepped_ns: 0,
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

    /// The clock of the current session.
    pub fn clock(&self) -> Option<Clock> {
        self.session.as_ref().map(|session| session.clock)
    }

    /// The period of the current session (ns).
    pub fn period_ns(&self) -> Option<u64> {
        self.session.as_ref().map(|session| session.period_ns)
    }

    /// The watchdog of the current session (ns).
    pub fn watchdog_ns(&self) -> Option<u64> {
        self.session.as_ref().map(|session| session.watchdog_ns)
    }

    /// Whether a setpoint belongs to the current session.
    pub fn is_of_session(&self, setpoint: &Setpoint) -> bool {
        let session = self.session.as_ref();
        session.is_some_and(|session| session.number == setpoint.session)
    }

    /// How many joints there are.
    pub fn joints(&self) -> usize {
        self.about.joints()
    }

    /// The measured position of a joint (rad); NaN if there is no such joint.
    pub fn position(&self, joint: usize) -> f64 {
        self.measured
            .get(joint)
            .map_or(f64::NAN, |joint| joint.position)
    }

    /// The last setpoint that was accepted.
    pub fn last_setpoint(&self) -> &Setpoint {
        &self.last
    }

    /// Receives a setpoint at `now_ns`. A setpoint of another session is ignored; an invalid one
    /// stops the arm.
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
        if self.has_stalled(now_ns) {
            self.stop(FaultCode::Stalled, u32::MAX);
            return;
        }
        let wall = session.clock == Clock::Wall;
        // Both sides read the same clock: a time far in the future is invalid.
        let future = wall && setpoint.published_ns > now_ns.saturating_add(session.watchdog_ns);
        if future || setpoint.check(self.joints()).is_err() {
            self.stop(FaultCode::BadSetpoint, u32::MAX);
            return;
        }
        // After a stall, setpoints arrive together: then the time between them is that of their
        // ticks.
        let ticks = setpoint.tick.saturating_sub(self.last.tick);
        let planned = ticks.saturating_mul(session.period_ns);
        let elapsed = now_ns
            .saturating_sub(self.received_ns)
            .max(planned)
            .clamp(session.period_ns, session.watchdog_ns);
        let newest_ns = if wall {
            setpoint.published_ns.min(now_ns)
        } else {
            now_ns
        };
        if let Some(joint) = self.unreachable_joint(setpoint, elapsed as f64 * 1e-9) {
            self.stop(FaultCode::OutOfRange, joint as u32);
            return;
        }
        self.newest_ns = newest_ns;
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

    /// Answers a sign of life: in lock-step, a setpoint that repeats the last period. Nothing
    /// moves; the answer is the last state with a new sequence number.
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

    /// The first joint whose setpoint is out of range, too fast, accelerates too much, or is further
    /// away than the joint can have come in `elapsed` (s).
    fn unreachable_joint(&self, setpoint: &Setpoint, elapsed: f64) -> Option<usize> {
        let first = self.state == DriverState::Synced;
        (0..self.joints()).find(|&joint| {
            let (at, speed) = (setpoint.position[joint], setpoint.velocity[joint]);
            let most = self.about.velocity[joint] * MARGIN;
            let force = self.about.acceleration[joint] * MARGIN;
            // A late setpoint continues the last one, not the extrapolation meanwhile.
            let before = if first {
                self.measured[joint].position
            } else {
                self.last.position[joint]
            };
            let room = if first { FIRST } else { ROOM + most * elapsed };
            at < self.about.lower[joint] - ROOM
                || at > self.about.upper[joint] + ROOM
                || speed.abs() > most
                || setpoint.acceleration[joint].abs() > force
                || (at - before).abs() > room
        })
    }

    fn stop(&mut self, fault: FaultCode, joint: u32) {
        self.fault = fault;
        self.fault_joint = joint;
        self.state = DriverState::Stopping;
    }

    /// Begins to end the driver: an open session ends with [`FaultCode::Ended`], the arm stops
    /// within its limits, and no new session is opened. Returns whether the arm moves.
    pub fn leave(&mut self) -> bool {
        self.leaving = true;
        if self.is_following() || self.state == DriverState::Synced {
            self.stop(FaultCode::Ended, u32::MAX);
        }
        !self.is_resting()
    }

    /// Whether what the robot follows rests.
    pub fn is_resting(&self) -> bool {
        self.references.iter().all(Reference::rests)
    }

    fn is_following(&self) -> bool {
        matches!(self.state, DriverState::Armed | DriverState::Active)
    }

    /// Whether, at `now_ns`, the driver itself did not run for longer than the watchdog.
    fn has_stalled(&self, now_ns: u64) -> bool {
        let Some(session) = &self.session else {
            return false;
        };
        session.clock == Clock::Wall
            && self.stepped_ns > 0
            && self.is_following()
            && now_ns.saturating_sub(self.stepped_ns) > session.watchdog_ns
    }

    /// One period of `period_ns` that ends at `now_ns`: measures, chooses the reference, has the
    /// robot follow it, and returns the state to send.
    pub fn step(&mut self, now_ns: u64, period_ns: u64) -> State {
        let period = period_ns as f64 * 1e-9;
        self.robot.measure(&mut self.measured);
        self.watch(now_ns);
        self.stepped_ns = now_ns;
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
        if let Some(joint) = self.robot.fault().filter(|_| self.is_following()) {
            self.stop(FaultCode::Hardware, joint);
        } else if self.has_stalled(now_ns) {
            self.stop(FaultCode::Stalled, u32::MAX);
        }
        let Some(session) = &self.session else { return };
        // By its own time stamp: a setpoint that waited while the driver did not run is not new.
        let silence = now_ns.saturating_sub(self.newest_ns);
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
            DriverState::Stopping if self.is_resting() => {
                self.state = DriverState::Fault;
            }
            _ => {}
        }
    }

    /// The reference of the joints in this period: the setpoint, its extrapolation, or a stop;
    /// always within the limits of the joints.
    fn refer(&mut self, period: f64) {
        let fresh = std::mem::take(&mut self.fresh);
        let setpoint = &self.last;
        let following = self.is_following();
        let stopping = matches!(
            self.state,
            DriverState::Stopping | DriverState::Disconnected
        );
        let joints = self.references.iter_mut().zip(&mut self.targets);
        for (joint, (limiter, (reference, target))) in self.limiters.iter().zip(joints).enumerate()
        {
            if following {
                *target = if fresh {
                    Reference {
                        position: setpoint.position[joint],
                        velocity: setpoint.velocity[joint],
                        acceleration: setpoint.acceleration[joint],
                    }
                } else {
                    limiter.go_on(target, period)
                };
                *reference = limiter.approach(reference, target, period);
            } else if stopping {
                *reference = limiter.stop(reference, period);
            } else {
                *reference = Reference::rest(reference.position);
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
