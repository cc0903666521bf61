//! The driver's side of the protocol, without a clock and without a channel.

use std::collections::VecDeque;

use ipc::{Clock, DriverState, FaultCode, MAX_TOOLS, Setpoint, SetpointFlags, State};

use crate::{
    About, DriverError, Limiter, Measured, Measurement, Outputs, Reference, Robot, Sensors,
};

/// How far the first setpoint of a session may be from the commanded position (rad).
const FIRST: f64 = 1e-3;

/// Tolerance of a setpoint's position beyond what speed and time allow (rad).
const ROOM: f64 = 2e-3;

/// Tolerance of a setpoint's speed where little is allowed (rad/s).
const SLOW: f64 = 1e-3;

/// Largest velocity and acceleration of a setpoint, as a multiple of the joint's limit: tolerance
/// for rounding.
const MARGIN: f64 = 1.001;

/// How many setpoints wait for their period at most: as many as the channel holds.
pub(crate) const WAITING: usize = 16;

/// How long a robot that is getting ready waits for the next request of its engine (ns).
const BEGINNING: u64 = 2_000_000_000;

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
    pub(crate) limiters: Vec<Limiter>,
    pub(crate) state: DriverState,
    pub(crate) fault: FaultCode,
    pub(crate) fault_joint: u32,
    /// The maker's number and name of the fault.
    pub(crate) fault_code: u32,
    pub(crate) fault_text: [u8; 96],
    /// The arm does not follow any more: the references follow the arm.
    pub(crate) lost: bool,
    /// When the robot was asked to get ready; none if it was not, or has ended.
    pub(crate) begun_ns: Option<u64>,
    pub(crate) session: Option<Session>,
    pub(crate) sessions: u64,
    pub(crate) leaving: bool,
    pub(crate) measured: Vec<Measured>,
    pub(crate) measurement: Measurement,
    /// What the arm's controller commands (rad), and whether it says so.
    pub(crate) commanded: Vec<f64>,
    pub(crate) says_commanded: bool,
    /// What the robot follows.
    pub(crate) references: Vec<Reference>,
    /// The newest setpoint, extrapolated to the present time.
    pub(crate) targets: Vec<Reference>,
    /// Feed-forward efforts (N m).
    pub(crate) efforts: Vec<f64>,
    /// The time of the last reference (ns).
    pub(crate) at_ns: u64,
    pub(crate) orders: [u32; MAX_TOOLS],
    pub(crate) payload: u32,
    pub(crate) outputs: Outputs,
    pub(crate) sensors: Sensors,
    pub(crate) last: Setpoint,
    /// Whether a setpoint came since the last period.
    pub(crate) came: bool,
    /// All that came since the last period, for a robot whose controller has a clock of its own.
    pub(crate) waiting: VecDeque<Setpoint>,
    pub(crate) received_ns: u64,
    /// When the newest setpoint was sent, by its own time stamp.
    pub(crate) newest_ns: u64,
    /// When the last period was; 0 before the first of a session.
    pub(crate) stepped_ns: u64,
    pub(crate) sequence: u64,
    pub(crate) missed: u64,
    missed_ever: u64,
    /// The last state: that of a period is written over it.
    pub(crate) reported: State,
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
        let measurement = robot.measure(&mut measured);
        let at: Vec<Reference> = measured
            .iter()
            .map(|joint| Reference::rest(joint.position))
            .collect();
        let mut commanded: Vec<f64> = measured.iter().map(|joint| joint.position).collect();
        let says_commanded = robot.commanded(&mut commanded);
        Ok(Self {
            measurement,
            commanded,
            says_commanded,
            efforts: vec![0.0; about.joints()],
            at_ns: 0,
            payload: 0,
            outputs: Outputs::default(),
            sensors: Sensors::default(),
            fault_code: 0,
            fault_text: [0; 96],
            lost: false,
            begun_ns: None,
            came: false,
            waiting: VecDeque::with_capacity(WAITING),
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

    /// Changes the robot, for tests of drivers.
    pub fn change_robot(&mut self, change: impl FnOnce(&mut R)) {
        change(&mut self.robot);
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
        setpoint.write_over(&mut self.last);
        self.received_ns = now_ns;
        if setpoint.flags & SetpointFlags::STOP_REQUEST != 0 {
            self.stop(FaultCode::StopRequest, u32::MAX);
            return;
        }
        if setpoint.flags & SetpointFlags::GOODBYE != 0 {
            self.state = DriverState::Disconnected;
            self.session = None;
            self.close();
            return;
        }
        self.state = match self.state {
            DriverState::Synced => DriverState::Armed,
            _ => DriverState::Active,
        };
        self.came = true;
        if self.about.own_clock {
            if self.waiting.len() == WAITING {
                self.waiting.pop_front();
            }
            self.waiting.push_back(*setpoint);
        }
    }

    /// Answers a sign of life: in lock-step, a setpoint that repeats the last period. Nothing
    /// moves; the answer is the last state with a new sequence number.
    pub fn sign_of_life(&mut self, setpoint: &Setpoint) -> Option<&State> {
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
        Some(&self.reported)
    }

    /// The first joint whose setpoint is out of range, too fast, accelerates too much, or is further
    /// away than the joint can have come in `elapsed` (s).
    fn unreachable_joint(&self, setpoint: &Setpoint, elapsed: f64) -> Option<usize> {
        let first = self.state == DriverState::Synced;
        (0..self.joints()).find(|&joint| {
            let (at, speed) = (setpoint.position[joint], setpoint.velocity[joint]);
            let most = self.about.velocity[joint] * MARGIN;
            let here = most.min(self.about.speed(joint, at, speed) * MARGIN + SLOW);
            let force = self.about.acceleration[joint] * MARGIN;
            // A late setpoint continues the last one, not the extrapolation meanwhile.
            let before = if first {
                self.commanded[joint]
            } else {
                self.last.position[joint]
            };
            let room = if first { FIRST } else { ROOM + most * elapsed };
            at < self.about.lower[joint] - ROOM
                || at > self.about.upper[joint] + ROOM
                || speed.abs() > here
                || setpoint.acceleration[joint].abs() > force
                || (at - before).abs() > room
        })
    }

    fn stop(&mut self, fault: FaultCode, joint: u32) {
        self.fault = fault;
        self.fault_joint = joint;
        self.state = DriverState::Stopping;
    }

    /// The robot need not be ready any more.
    pub(crate) fn close(&mut self) {
        if self.begun_ns.take().is_some() {
            self.robot.end();
        }
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

    pub(crate) fn is_following(&self) -> bool {
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
    pub fn step(&mut self, now_ns: u64, period_ns: u64) -> &State {
        self.measurement = self.robot.measure(&mut self.measured);
        for (commanded, measured) in self.commanded.iter_mut().zip(&self.measured) {
            *commanded = measured.position;
        }
        self.says_commanded = self.robot.commanded(&mut self.commanded);
        self.watch(now_ns);
        self.stepped_ns = now_ns;
        self.report(now_ns);
        self.give_orders();
        self.refer(now_ns, period_ns);
        &self.reported
    }

    /// The watchdog, and the end of a stop.
    fn watch(&mut self, now_ns: u64) {
        self.watch_robot(now_ns);
        if self.has_stalled(now_ns) {
            self.stop(FaultCode::Stalled, u32::MAX);
        }
        let Some(session) = &self.session else { return };
        // By its own time stamp: a setpoint that waited while the driver did not run is not new.
        let silence = now_ns.saturating_sub(self.newest_ns);
        match self.state {
            DriverState::Armed | DriverState::Active => {
                if !self.came {
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
                self.close();
            }
            _ => {}
        }
    }

    /// A fault of the robot, and a robot that gets ready for nobody.
    fn watch_robot(&mut self, now_ns: u64) {
        let moves = self.state != DriverState::Fault && self.session.is_some();
        if let Some(fault) = self.robot.fault().filter(|_| moves && !self.lost) {
            self.lost = true;
            if self.state != DriverState::Stopping {
                self.stop(FaultCode::Hardware, fault.joint);
            }
            (self.fault_code, self.fault_text) = (fault.code, fault.text);
        }
        let waits = self.session.is_none() || self.state == DriverState::Fault;
        let asked = self.begun_ns.filter(|_| waits);
        if asked.is_some_and(|asked| now_ns.saturating_sub(asked) > BEGINNING) {
            self.close();
        }
    }
}
