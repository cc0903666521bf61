//! An engine that does what a test wants, and what it sees of the driver.

use core::time::Duration;
use std::time::Instant;

use ipc::{
    DriverState, EngineLink, GRIPPER, Hello, HelloAck, IpcError, Setpoint, SetpointFlags, State,
    ToolAction,
};
use scheduling::{now_ns, sleep_until_ns};

/// Period of the test (ns).
pub(crate) const PERIOD: u64 = 1_000_000;

/// Watchdog of the test (ns).
pub(crate) const WATCHDOG: u64 = 50_000_000;

/// How often a clause is tried.
const TRIES: u32 = 3;

/// What a clause comes to: what was seen, as good or as bad.
pub(crate) type Seen = Result<String, String>;

/// What [`Seen`] begins with where a driver has nothing to try the clause on.
pub(crate) const NOT_TRIED: &str = "not tried: ";

/// One trial with an open session.
pub(crate) type Trial = fn(&mut Player) -> Seen;

/// An engine that does what a test wants.
pub(crate) struct Player {
    pub(crate) link: EngineLink,
    pub(crate) hello: Hello,
    pub(crate) ack: HelloAck,
    /// The last good state of the session.
    pub(crate) state: State,
    pub(crate) sequence: u64,
    next_ns: u64,
    /// Number and action of the order to the gripper.
    pub(crate) order: (u32, ToolAction),
}

impl Player {
    pub(crate) fn new(link: EngineLink, hello: Hello, ack: HelloAck) -> Self {
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

    pub(crate) fn joints(&self) -> usize {
        self.hello.joints as usize
    }

    /// Whether the driver refuses a request that is wrong in one way.
    pub(crate) fn refuses(&self, change: impl Fn(&mut Hello)) -> Seen {
        let mut hello = self.hello;
        change(&mut hello);
        match self.link.ask(&hello, Duration::from_secs(2)) {
            Err(IpcError::Refused { reason, .. }) => Ok(reason),
            Err(other) => Err(other.to_string()),
            Ok(_) => Err("it opened a session".to_owned()),
        }
    }

    /// Whether it refuses a period that it says it cannot serve.
    pub(crate) fn refuses_period(&self) -> Seen {
        let [least, most] = self.ack.periods_ns;
        if least == 0 || least > most || most > 1_000_000_000 {
            return Err(format!("it says it serves periods of {least} to {most} ns"));
        }
        if most > 500_000_000 {
            return Ok(format!(
                "{NOT_TRIED}it serves periods of {least} to {most} ns"
            ));
        }
        self.refuses(|hello| {
            hello.period_ns = 2 * most;
            hello.watchdog_ns = 4 * most;
        })
    }

    /// Runs a clause; one that fails is tried again, because a machine that stalls for longer than
    /// the watchdog fails it too. What was seen says which try it was.
    pub(crate) fn attempt(&mut self, clause: Trial) -> Seen {
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
        let times = [Duration::from_secs(1), ipc::READY];
        self.ack = loop {
            match self.link.greet(&self.hello, times, |_| {}) {
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
    pub(crate) fn setpoint(&mut self, [offset, velocity, acceleration]: [f64; 3]) -> Setpoint {
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
            position: self.ack.commanded,
            ..Setpoint::default()
        };
        for joint in 0..self.joints() {
            // Towards the middle of the range, so that no end is in the way.
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
    pub(crate) fn period(&mut self, setpoint: Option<Setpoint>) -> usize {
        sleep_until_ns(self.next_ns);
        self.next_ns = (self.next_ns + PERIOD).max(now_ns());
        if let Some(setpoint) = setpoint {
            self.link.send(&setpoint);
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

    pub(crate) fn hold(&mut self, periods: u32) {
        for _ in 0..periods {
            let setpoint = self.setpoint([0.0; 3]);
            self.period(Some(setpoint));
        }
    }

    /// Largest distance from where the session began (rad).
    pub(crate) fn moved(&self) -> f64 {
        (0..self.joints())
            .map(|joint| (self.state.position[joint] - self.ack.position[joint]).abs())
            .fold(0.0, f64::max)
    }

    /// Whether the driver has said anything in this session; what it has not is no position.
    pub(crate) fn heard(&self) -> Result<(), String> {
        if self.state.sequence == 0 {
            return Err("it sent no state".to_owned());
        }
        Ok(())
    }

    pub(crate) fn expect(&self, wanted: &[DriverState], seen: &str) -> Seen {
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

    /// Counts states of the session until there are `wanted` of them or the time is over.
    pub(crate) fn states_within(&mut self, time: Duration, wanted: usize) -> usize {
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

    pub(crate) fn say_goodbye(&mut self) {
        let mut setpoint = self.setpoint([0.0; 3]);
        setpoint.flags |= SetpointFlags::GOODBYE | SetpointFlags::HOLD;
        self.link.send(&setpoint);
    }
}
