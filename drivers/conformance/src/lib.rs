//! Plays the engine against any driver and reports, clause by clause, whether it follows the
//! protocol of `docs/driver-protocol.md`.
//!
//! The joints move by a few hundredths of a rad; keep away from a real arm nevertheless.

use core::time::Duration;
use std::time::Instant;

use ipc::{
    Arm, Clock, DriverState, EngineLink, GRIPPER, Hello, HelloAck, IpcError, Setpoint,
    SetpointFlags, State, ToolAction, ToolStatus, text_of,
};
use scheduling::{now_ns, sleep_until_ns};
use serde::Serialize;

/// Period of the test (ns).
const PERIOD: u64 = 1_000_000;

/// Watchdog of the test (ns).
const WATCHDOG: u64 = 50_000_000;

/// How often a clause is tried.
const TRIES: u32 = 3;

/// How long the motion to follow takes (s), and how far it goes (rad).
const SWING: (f64, f64) = (1.0, 0.02);

/// Whether a driver follows a clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It does.
    Pass,
    /// It does not.
    Fail,
    /// It has no such part.
    Skip,
}

/// One clause of the protocol with its verdict.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Clause {
    /// The clause's name.
    pub name: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// What was observed.
    pub seen: String,
}

/// The result of testing a driver.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ConformanceReport {
    /// The driver's name.
    pub driver: String,
    /// How many joints it has.
    pub joints: usize,
    /// All clauses, in the order they were tried.
    pub clauses: Vec<Clause>,
}

/// The result of a clause: what was observed, as pass or as failure.
type Seen = Result<String, String>;

/// Prefix of [`Seen`] if a driver has nothing to try the clause on.
const NOT_TRIED: &str = "not tried: ";

/// A clause and how it is tried.
type Named<F> = (&'static str, F);

/// One trial with an open session.
type Trial = fn(&mut Player) -> Seen;

/// Tests the driver of `arm`. Takes about ten seconds.
///
/// # Errors
/// When there is no driver, or an engine already drives it.
pub fn test_driver(arm: &Arm) -> Result<ConformanceReport, IpcError> {
    let link = EngineLink::open(arm)?;
    let joints = link.joints(Duration::from_secs(3))?;
    let hello = Hello::new(joints, PERIOD, WATCHDOG, Clock::Wall);
    let ack = link.greet(&hello, Duration::from_secs(3))?;
    let mut player = Player::new(link, hello, ack);
    let mut clauses = vec![judge(
        "handshake",
        Ok(format!("session {:#x}", player.ack.session)),
    )];
    let requests: [Named<fn(&mut Hello)>; 4] = [
        ("wrong protocol is refused", |hello| hello.protocol += 1),
        ("wrong layout is refused", |hello| hello.schema ^= 1),
        ("wrong joint count is refused", |hello| hello.joints += 1),
        ("wrong period is refused", |hello| hello.period_ns = 1),
    ];
    clauses.extend(requests.map(|(name, change)| judge(name, player.refuses(change))));
    let driver = text_of(&player.ack.name);
    let sessions: [Named<Trial>; 15] = [
        ("states come at the rate", Player::rate),
        ("a setpoint of another session is ignored", Player::foreign),
        ("becomes active by holding", Player::holds),
        ("follows a motion", Player::follows),
        ("the gripper answers", Player::gripper),
        ("silence trips the watchdog and latches", Player::silence),
        ("a new session begins where the arm is", Player::holds),
        ("a jump is not followed and latches", |player| {
            player.spoil(|s| s.position[0] += 0.4)
        }),
        ("a position out of range latches", Player::leaves_range),
        ("a number that is not finite latches", |player| {
            player.spoil(|s| s.position[0] = f64::NAN)
        }),
        ("an acceleration beyond any limit latches", |player| {
            player.spoil(|setpoint| setpoint.acceleration[0] = 1e6)
        }),
        ("setpoints that are too old are silence", Player::outdated),
        ("a stop request stops and latches", |player| {
            player.spoil(|setpoint| setpoint.flags |= SetpointFlags::STOP_REQUEST)
        }),
        ("in lock-step one state per setpoint", Player::lock_step),
        ("goodbye ends the session without a fault", Player::goodbye),
    ];
    clauses.extend(sessions.map(|(name, clause)| judge(name, player.attempt(clause))));
    Ok(ConformanceReport {
        driver,
        joints,
        clauses,
    })
}

/// Converts what was observed into a verdict.
fn judge(name: &'static str, seen: Seen) -> Clause {
    let (verdict, seen) = match seen {
        Ok(seen) => match seen.strip_prefix(NOT_TRIED) {
            Some(reason) => (Verdict::Skip, reason.to_owned()),
            None => (Verdict::Pass, seen),
        },
        Err(seen) => (Verdict::Fail, seen),
    };
    Clause {
        name,
        verdict,
        seen,
    }
}

/// An engine that a test controls.
struct Player {
    link: EngineLink,
    hello: Hello,
    ack: HelloAck,
    state: State,
    sequence: u64,
    next_ns: u64,
    order: (u32, ToolAction),
}

impl Player {
    fn new(link: EngineLink, hello: Hello, ack: HelloAck) -> Self {
        let order = (0, ToolAction::None);
        Self {
            link,
            hello,
            ack,
            state: State::default(),
            sequence: 0,
            next_ns: 0,
            order,
        }
    }

    fn joints(&self) -> usize {
        self.hello.joints as usize
    }

    /// Whether the driver refuses a request that is wrong in one way.
    fn refuses(&self, change: impl Fn(&mut Hello)) -> Seen {
        let mut hello = self.hello;
        change(&mut hello);
        match self.link.greet(&hello, Duration::from_secs(2)) {
            Err(IpcError::Refused { reason, .. }) => Ok(reason),
            Err(other) => Err(other.to_string()),
            Ok(_) => Err("it opened a session".to_owned()),
        }
    }

    /// Runs a clause; one that fails is tried again, because a machine that stalls for longer than
    /// the watchdog fails it too. The observation says which try it was.
    fn attempt(&mut self, clause: Trial) -> Seen {
        let first = self.reopen(clause);
        (2..=TRIES).fold(first, |before, number| match before {
            Err(reason) => self
                .reopen(clause)
                .map(|seen| format!("{seen} (try {number}; before: {reason})")),
            passed => passed,
        })
    }

    /// Opens a new session, then runs a clause.
    fn reopen(&mut self, clause: Trial) -> Seen {
        let end = Instant::now() + Duration::from_secs(4);
        self.ack = loop {
            match self.link.greet(&self.hello, Duration::from_secs(1)) {
                Ok(ack) => break ack,
                // It may still be stopping.
                Err(_) if Instant::now() < end => std::thread::sleep(Duration::from_millis(50)),
                Err(error) => return Err(format!("no session: {error}")),
            }
        };
        self.state = State::default();
        self.sequence = 0;
        self.order = (0, ToolAction::None);
        self.next_ns = now_ns() + PERIOD;
        clause(self)
    }

    /// A setpoint `offset` (rad) from where the session began.
    fn setpoint(&mut self, [offset, velocity, acceleration]: [f64; 3]) -> Setpoint {
        self.sequence += 1;
        let mut setpoint = Setpoint {
            joints: self.hello.joints,
            session: self.ack.session,
            sequence: self.sequence,
            tick: self.sequence,
            published_ns: now_ns(),
            tick_ns: self.next_ns,
            period_ns: PERIOD,
            watchdog_ns: WATCHDOG,
            valid: u32::MAX >> (32 - self.hello.joints),
            position: self.ack.position,
            ..Setpoint::default()
        };
        for joint in 0..self.joints() {
            // Towards the middle of the range, away from its ends.
            let middle = (self.ack.lower[joint] + self.ack.upper[joint]) / 2.0;
            let sign = if self.ack.position[joint] > middle {
                -1.0
            } else {
                1.0
            };
            setpoint.position[joint] += sign * offset;
            setpoint.velocity[joint] = sign * velocity;
            setpoint.acceleration[joint] = sign * acceleration;
        }
        setpoint.tools[GRIPPER].order = self.order.0;
        setpoint.tools[GRIPPER].action = self.order.1 as u32;
        setpoint
    }

    /// Waits for the next period, sends, reads the newest state; counts the states.
    fn period(&mut self, setpoint: Option<Setpoint>) -> usize {
        sleep_until_ns(self.next_ns);
        self.next_ns = (self.next_ns + PERIOD).max(now_ns());
        if let Some(setpoint) = setpoint {
            self.link.send(setpoint);
        }
        let mut states = 0;
        while let Some(state) = self.link.next_state() {
            states += 1;
            if state.session == self.ack.session && state.check(self.joints()).is_ok() {
                self.state = state;
            }
        }
        states
    }

    fn hold(&mut self, periods: u32) {
        for _ in 0..periods {
            let setpoint = self.setpoint([0.0; 3]);
            self.period(Some(setpoint));
        }
    }

    /// Largest distance from where the session began (rad).
    fn moved(&self) -> f64 {
        (0..self.joints())
            .map(|joint| (self.state.position[joint] - self.ack.position[joint]).abs())
            .fold(0.0, f64::max)
    }

    /// Whether the driver has sent a state in this session; without one there is no position.
    fn heard(&self) -> Result<(), String> {
        if self.state.sequence == 0 {
            return Err("it sent no state".to_owned());
        }
        Ok(())
    }

    fn expect(&self, wanted: &[DriverState], seen: &str) -> Seen {
        self.heard()?;
        let driver = self.state.driver();
        let text = format!(
            "{seen}driver is {}, {:.4} rad moved",
            driver.name(),
            self.moved()
        );
        if wanted.contains(&driver) {
            Ok(text)
        } else {
            Err(text)
        }
    }

    fn rate(&mut self) -> Seen {
        let mut states = 0;
        for _ in 0..500 {
            let setpoint = self.setpoint([0.0; 3]);
            states += self.period(Some(setpoint));
        }
        let seen = format!("{states} states in 500 periods");
        if (400..=550).contains(&states) {
            Ok(seen)
        } else {
            Err(seen)
        }
    }

    fn foreign(&mut self) -> Seen {
        for _ in 0..20 {
            let mut setpoint = self.setpoint([0.0; 3]);
            setpoint.session ^= 0xff;
            self.period(Some(setpoint));
        }
        self.expect(&[DriverState::Synced], "")
    }

    fn holds(&mut self) -> Seen {
        self.hold(100);
        self.heard()?;
        if self.moved() > 0.005 {
            return Err(format!("it moved by {:.4} rad", self.moved()));
        }
        self.expect(&[DriverState::Active], "")
    }

    fn follows(&mut self) -> Seen {
        self.hold(50);
        let (duration, distance) = SWING;
        let mut worst = 0.0_f64;
        let periods = (duration * 1e9) as u64 / PERIOD;
        for period in 0..=periods {
            let u = period as f64 / periods as f64;
            let position = distance * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            let velocity = distance * 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration;
            let acceleration =
                distance * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration * duration);
            let setpoint = self.setpoint([position, velocity, acceleration]);
            self.period(Some(setpoint));
            for joint in 0..self.joints() {
                let error = setpoint.position[joint] - self.state.position[joint];
                worst = worst.max(error.abs());
            }
        }
        let seen = format!("{worst:.5} rad behind at most");
        if worst < distance / 4.0 {
            self.expect(&[DriverState::Active], &format!("{seen}; "))
        } else {
            self.expect(
                &[],
                &format!("{seen}; {}; ", self.state.fault_code().reason()),
            )
        }
    }

    fn gripper(&mut self) -> Seen {
        self.hold(50);
        let status = |player: &Self| ToolStatus::from_number(player.state.tools[GRIPPER].status);
        if status(self) == Some(ToolStatus::Unknown) {
            return Ok(format!("{NOT_TRIED}no gripper"));
        }
        let mut seen = String::new();
        let orders = [
            (ToolAction::Close, ToolStatus::Closed),
            (ToolAction::Open, ToolStatus::Open),
        ];
        for (number, (action, wanted)) in (1..).zip(orders) {
            self.order = (number, action);
            let start = Instant::now();
            while status(self) != Some(wanted) || self.state.tools[GRIPPER].order != number {
                self.hold(1);
                if start.elapsed() > Duration::from_secs(5) {
                    return Err(format!("{action:?}: {:?} after 5 s", status(self)));
                }
            }
            seen.push_str(&format!(
                "{action:?} in {} ms; ",
                start.elapsed().as_millis()
            ));
        }
        Ok(seen)
    }

    fn silence(&mut self) -> Seen {
        self.hold(100);
        let start = Instant::now();
        while !matches!(self.state.driver(), DriverState::Fault) {
            self.period(None);
            if start.elapsed() > Duration::from_secs(3) {
                return self.expect(&[DriverState::Fault], "after 3 s of silence ");
            }
        }
        let seen = format!("latched after {} ms; ", start.elapsed().as_millis());
        if start.elapsed() < Duration::from_nanos(WATCHDOG) {
            return Err(format!(
                "{seen}before the watchdog of {} ms",
                WATCHDOG / 1_000_000
            ));
        }
        self.hold(100);
        self.expect(&[DriverState::Fault], &seen)
    }

    /// Setpoints that were sent longer ago than the watchdog, by their time stamp.
    fn outdated(&mut self) -> Seen {
        self.hold(100);
        for _ in 0..100 {
            let mut setpoint = self.setpoint([0.0; 3]);
            setpoint.published_ns = setpoint.published_ns.saturating_sub(2 * WATCHDOG);
            self.period(Some(setpoint));
        }
        let reason = format!("{}; ", self.state.fault_code().reason());
        self.expect(&[DriverState::Stopping, DriverState::Fault], &reason)
    }

    /// Holds, sends one invalid setpoint, holds again: the driver must have latched.
    fn spoil(&mut self, change: impl Fn(&mut Setpoint)) -> Seen {
        self.hold(100);
        let mut setpoint = self.setpoint([0.0; 3]);
        change(&mut setpoint);
        self.period(Some(setpoint));
        self.hold(100);
        self.heard()?;
        let reason = format!("{}; ", self.state.fault_code().reason());
        if self.moved() > 0.05 {
            return Err(format!("{reason}it moved by {:.3} rad", self.moved()));
        }
        self.expect(&[DriverState::Stopping, DriverState::Fault], &reason)
    }

    /// A setpoint beyond the end of a joint's range.
    fn leaves_range(&mut self) -> Seen {
        let upper = self.ack.upper[0];
        if upper > 100.0 {
            return Ok(format!("{NOT_TRIED}no end of the first joint's range"));
        }
        self.spoil(|setpoint| setpoint.position[0] = upper + 0.1)
    }

    /// A lock-step session: one state after the handshake, then one per setpoint.
    fn lock_step(&mut self) -> Seen {
        const SETPOINTS: usize = 200;
        self.hold(10);
        self.say_goodbye();
        let hello = Hello {
            clock: Clock::LockStep as u32,
            ..self.hello
        };
        match self.link.greet(&hello, Duration::from_secs(2)) {
            Ok(ack) => self.ack = ack,
            Err(IpcError::Refused { reason, .. }) => {
                return Ok(format!("{NOT_TRIED}no lock-step: {reason}"));
            }
            Err(error) => return Err(error.to_string()),
        }
        self.sequence = 0;
        let start = Instant::now();
        let mut states = self.states_within(Duration::from_secs(2), 1);
        for sent in 0..SETPOINTS {
            if states != sent + 1 {
                return Err(format!("{states} states after {sent} setpoints"));
            }
            let setpoint = self.setpoint([0.0; 3]);
            self.link.send(setpoint);
            states += self.states_within(Duration::from_secs(1), 1);
        }
        let speed = SETPOINTS as f64 * PERIOD as f64 * 1e-9 / start.elapsed().as_secs_f64();
        states += self.states_within(Duration::from_millis(50), 1000);
        self.say_goodbye();
        let seen = format!(
            "{states} states, the first before {SETPOINTS} setpoints; {speed:.0} x real time"
        );
        if states == SETPOINTS + 1 {
            Ok(seen)
        } else {
            Err(seen)
        }
    }

    /// Counts states of the session until there are `wanted` of them or the time is over.
    fn states_within(&mut self, time: Duration, wanted: usize) -> usize {
        let end = Instant::now() + time;
        let mut states = 0;
        while states < wanted && Instant::now() < end {
            match self.link.next_state() {
                Some(state) if state.session == self.ack.session => {
                    self.state = state;
                    states += 1;
                }
                Some(_) => {}
                None => std::thread::yield_now(),
            }
        }
        states
    }

    fn say_goodbye(&mut self) {
        let mut setpoint = self.setpoint([0.0; 3]);
        setpoint.flags |= SetpointFlags::GOODBYE | SetpointFlags::HOLD;
        self.link.send(setpoint);
    }

    fn goodbye(&mut self) -> Seen {
        self.hold(50);
        self.say_goodbye();
        let end = Instant::now() + Duration::from_secs(1);
        while Instant::now() < end {
            if let Some(state) = self.link.last_state()
                && state.driver() == DriverState::Disconnected
            {
                return Ok("driver is disconnected".to_owned());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        self.expect(&[DriverState::Disconnected], "")
    }
}
