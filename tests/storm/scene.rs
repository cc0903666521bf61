//! One arm in the test of random stalls and kills.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{DriverState, FaultCode, Observer, State};
use system_tests::servo_arm::JOINTS;
use system_tests::witness::Worst;

use crate::peer::Peer;

/// How long something that must come may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Silence that must latch (ms): the watchdog and the patience are 100 ms, and reading a signal
/// takes its time.
const TOO_LONG: u64 = 110;

/// What came out of a storm.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub(crate) stalls: usize,
    pub(crate) kills: usize,
    /// How the driver named its latch, and how often.
    pub(crate) driver: BTreeMap<String, usize>,
    /// How the engine named its fault, and how often.
    pub(crate) engine: BTreeMap<String, usize>,
    /// Faults that the test did not cause: a busy machine stalls by itself.
    pub(crate) by_themselves: usize,
    /// The driver's output, over all joints and periods.
    pub(crate) worst: Worst,
    /// What should not have been.
    pub(crate) broken: Vec<String>,
}

impl Tally {
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.stalls += other.stalls;
        self.kills += other.kills;
        self.by_themselves += other.by_themselves;
        self.worst = self.worst.and(other.worst);
        self.broken.extend(other.broken);
        for (name, count) in other.driver {
            *self.driver.entry(name).or_default() += count;
        }
        for (name, count) in other.engine {
            *self.engine.entry(name).or_default() += count;
        }
        self
    }
}

/// An engine, a driver, and an observer of both.
pub(crate) struct Arm {
    name: String,
    folder: tempfile::TempDir,
    drivers: usize,
    observer: Observer,
    state: State,
    driver: Peer,
    engine: Peer,
    random: u64,
    tally: Tally,
}

impl Arm {
    pub(crate) fn new(number: usize, seed: u64) -> Self {
        let name = format!("storm-{}/{number}", std::process::id());
        let folder = tempfile::tempdir().unwrap();
        let observer = Observer::open(&system_tests::domain::arm(&name)).unwrap();
        let file = folder.path().join("0");
        let driver = Peer::start(&["driver", &name, file.to_str().unwrap()]);
        let engine = Peer::start(&["engine", &name]);
        Self {
            name,
            folder,
            drivers: 1,
            observer,
            state: State::default(),
            driver,
            engine,
            random: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
            tally: Tally::default(),
        }
    }

    pub(crate) fn tally(self) -> Tally {
        let mut tally = self.tally.clone();
        for number in 0..self.drivers {
            tally.worst = tally.worst.and(Worst::read(&self.file(number)).unwrap());
        }
        tally
    }

    pub(crate) fn run(&mut self, stalls: usize, kills: usize) {
        while self.tally.stalls < stalls || self.tally.kills < kills {
            self.wait_for_motion();
            let stall = self.tally.stalls < stalls;
            if stall && (self.below(2) == 0 || self.tally.kills == kills) {
                self.tally.stalls += 1;
                self.stall();
            } else {
                self.tally.kills += 1;
                self.kill();
            }
        }
    }

    fn file(&self, number: usize) -> PathBuf {
        self.folder.path().join(number.to_string())
    }

    /// A number from 0 to `end`, without it.
    fn below(&mut self, end: u64) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random % end
    }

    fn broken(&mut self, what: &str) {
        let state = (self.state.driver().name(), self.state.fault_code());
        let engine: Vec<_> = self.tally.engine.keys().cloned().collect();
        self.tally
            .broken
            .push(format!("{what}; driver {state:?}; engine had {engine:?}"));
    }

    /// Reads the states that wait; keeps the newest.
    fn look(&mut self) {
        while let Some(state) = self.observer.next_state() {
            self.state = state;
        }
    }

    fn speed(&self) -> f64 {
        let speeds = self.state.velocity.iter().take(JOINTS);
        speeds.fold(0.0, |most, speed| most.max(speed.abs()))
    }

    /// Waits until the arm moves, at a random time of its motion.
    fn wait_for_motion(&mut self) {
        let moment = Duration::from_millis(self.below(1300));
        let end = Instant::now() + PATIENCE;
        let mut since = None;
        while Instant::now() < end {
            self.look();
            // The engine may have one of its own while the driver follows it to rest.
            let engine = self.fault(Duration::ZERO);
            if engine || self.state.driver() == DriverState::Fault {
                // The test did not cause it.
                self.tally.by_themselves += 1;
                self.recover();
                since = None;
            }
            let active = self.state.driver() == DriverState::Active;
            if active && self.speed() > 0.05 {
                let since = since.get_or_insert_with(Instant::now);
                if since.elapsed() >= moment {
                    return;
                }
            }
            sleep(Duration::from_millis(1));
        }
        panic!("{}: it does not move: {:?}", self.name, self.state.driver());
    }

    /// Waits for the driver's latch and counts its name.
    fn latch(&mut self, wanted: &[FaultCode], why: &str) {
        let end = Instant::now() + Duration::from_secs(3);
        while self.state.driver() != DriverState::Fault && Instant::now() < end {
            self.look();
            sleep(Duration::from_micros(300));
        }
        if self.state.driver() != DriverState::Fault || !wanted.contains(&self.state.fault_code()) {
            self.broken(&format!("{why}: no latch by one of {wanted:?}"));
        }
        let name = format!("{:?}", self.state.fault_code());
        *self.tally.driver.entry(name).or_default() += 1;
    }

    /// Waits for the engine's fault and counts its name; says whether it came.
    fn fault(&mut self, time: Duration) -> bool {
        let Some(line) = self.engine.line_with(&["Faulted"], time) else {
            return false;
        };
        let name = line.split("fault: ").nth(1).unwrap_or(&line);
        let word = name.split([' ', ',']).next().unwrap_or(name);
        let code = name.split("code: ").nth(1).unwrap_or_default();
        let code = code.split([' ', ',']).next().unwrap_or_default();
        let name = format!("{word} {code}");
        *self.tally.engine.entry(name).or_default() += 1;
        true
    }

    /// Asks for new sessions until there is one.
    fn recover(&mut self) {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            sleep(Duration::from_millis(100));
            self.engine.say("recover");
            let answer = self.engine.line_with(
                &["Recovered", "NoSession", "NoFault"],
                Duration::from_secs(2),
            );
            // What was said before it is old.
            self.look();
            let answer = answer.unwrap_or_default();
            let none = answer.contains("NoFault") && self.state.driver() != DriverState::Fault;
            if none || answer.contains("Recovered") {
                self.state = State::default();
                return;
            }
        }
        panic!("{}: no new session", self.name);
    }

    /// Stops one of the two for 5 to 1000 ms.
    fn stall(&mut self) {
        let engine = self.below(2) == 0;
        let most = if self.below(2) == 0 { 100 } else { 1000 };
        let time = 5 + self.below(most - 4);
        let victim = if engine { &self.engine } else { &self.driver };
        victim.signal(libc::SIGSTOP);
        sleep(Duration::from_millis(time));
        let victim = if engine { &self.engine } else { &self.driver };
        victim.signal(libc::SIGCONT);
        let who = if engine { "engine" } else { "driver" };
        let why = format!("{who} stopped for {time} ms");
        if time > TOO_LONG {
            let names = [FaultCode::Watchdog, FaultCode::Stalled];
            self.latch(&names, &why);
            if !self.fault(Duration::from_secs(3)) {
                self.broken(&format!("{why}: the engine named nothing"));
            }
            self.recover();
        } else if self.fault(Duration::from_millis(400)) {
            // Short, but the engine or the driver found it too long: it must be able to go on.
            self.recover();
        }
    }

    /// Kills or ends one of the two.
    fn kill(&mut self) {
        match self.below(3) {
            0 => self.kill_engine(),
            1 => self.kill_driver(),
            _ => self.end_driver(),
        }
    }

    fn kill_engine(&mut self) {
        self.engine.kill();
        self.latch(&[FaultCode::Watchdog, FaultCode::Stalled], "engine killed");
        self.engine = Peer::start(&["engine", &self.name]);
        // It opens a session by itself.
        if self.engine.line_with(&["Started"], PATIENCE).is_none() {
            self.broken("a new engine does not start");
        }
        self.look();
        self.state = State::default();
    }

    fn new_driver(&mut self) {
        let file = self.file(self.drivers);
        self.drivers += 1;
        self.driver = Peer::start(&["driver", &self.name, file.to_str().unwrap()]);
        self.recover();
    }

    fn kill_driver(&mut self) {
        self.driver.kill();
        if !self.fault(Duration::from_secs(3)) {
            self.broken("driver killed: the engine named nothing");
        }
        self.new_driver();
    }

    /// Ends the driver by a signal, at times by two.
    fn end_driver(&mut self) {
        let signal = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP][self.below(3) as usize];
        let twice = self.below(2) == 0;
        self.driver.signal(signal);
        if twice {
            sleep(Duration::from_millis(20));
            self.driver.signal(signal);
        }
        let names = [FaultCode::Ended, FaultCode::Watchdog, FaultCode::Stalled];
        self.latch(&names, "driver told to end");
        let said = self.driver.line_with(&["braked to rest"], PATIENCE);
        let status = self.driver.child.wait().unwrap();
        if said.is_none() || !status.success() {
            self.broken(&format!("driver told to end: said {said:?}, {status}"));
        }
        if !self.fault(Duration::from_secs(3)) {
            self.broken("driver told to end: the engine named nothing");
        }
        self.new_driver();
    }
}
