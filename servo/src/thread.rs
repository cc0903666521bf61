//! The real-time thread: a clock, the link to the driver, and the runner between them.

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::sync::mpsc::SyncSender;
use std::thread;
use std::time::Instant;

use ipc::{Clock, DriverState, EngineLink, Greeted, Hello, Setpoint, SetpointFlags, text_of};
use scheduling::{Granted, Turns, now_ns, request_real_time, sleep_until_ns};

use super::config::{ExecutorConfig, ExecutorError};
use super::event::{Fault, ShortText};
use super::remote::Shared;
use super::runner::{Runner, Tick};

/// How long a driver of a lock-step session may take for a period.
const LOCK_STEP_PATIENCE: Duration = Duration::from_secs(2);

/// Time between two signs of life while virtual time is stopped.
const SIGN_OF_LIFE: Duration = Duration::from_millis(100);

/// How long the thread tries to come to rest, driver included, before it leaves anyway.
const LEAVE: Duration = Duration::from_secs(5);

/// What the thread sends when it has started.
#[derive(Debug)]
pub(super) struct Begun {
    pub(super) warning: Option<String>,
    pub(super) driver: String,
}

/// The link, and when the last period was.
struct Loop<'a, const N: usize> {
    config: &'a ExecutorConfig<N>,
    link: EngineLink,
    runner: Runner<N>,
    shared: std::sync::Arc<Shared<N>>,
    tick: u64,
    /// When period 0 began (ns).
    origin: u64,
    leaving: Option<Instant>,
    /// Since when a driver that gets ready is asked for a new session, and when it is asked again.
    asking: Option<[Instant; 2]>,
    /// What the driver waits for.
    waits: String,
    turns: Turns,
}

/// How many states are read at once at most: a driver that floods them does not hold the period.
const A_LOOK: usize = 64;

/// Time between two requests for a new session.
const AGAIN: Duration = Duration::from_millis(100);

/// The thread. First reports whether it starts.
pub(super) fn main<const N: usize>(
    config: &ExecutorConfig<N>,
    runner: Runner<N>,
    tell: &SyncSender<Result<Begun, ExecutorError>>,
) {
    let shared = runner.shared();
    let begun = EngineLink::open(&config.arm)
        .map_err(ExecutorError::from)
        .and_then(|link| {
            let mut all = Loop {
                config,
                link,
                runner,
                shared: std::sync::Arc::clone(&shared),
                tick: 0,
                origin: 0,
                leaving: None,
                asking: None,
                waits: String::new(),
                turns: Turns::new(),
            };
            all.greet().map(|driver| (all, driver))
        });
    let (mut all, driver) = match begun {
        Ok(begun) => begun,
        Err(error) => {
            // The caller has ended; the thread ends too.
            shared.orders.end();
            let _ = tell.send(Err(error));
            return;
        }
    };
    // A thread that waits actively, as in lock-step, must not be a real-time thread.
    let granted = match config.clock {
        Clock::Wall => request_real_time(config.real_time),
        Clock::LockStep => Granted::default(),
    };
    // The caller may have ended; then the drop of its handle ends the thread.
    let _ = tell.send(Ok(Begun {
        warning: granted.warning(),
        driver,
    }));
    match config.clock {
        Clock::Wall => all.by_the_clock(),
        Clock::LockStep => all.in_step(),
    }
    all.runner.end();
    shared.orders.end();
}

impl<const N: usize> Loop<'_, N> {
    fn hello(&self) -> Hello {
        let config = self.config;
        let watchdog = config.watchdog.as_nanos() as u64;
        Hello {
            model: config.model,
            ..Hello::new(N, config.period_ns(), watchdog, config.clock)
        }
    }

    /// Opens the first session; returns the driver's name.
    fn greet(&mut self) -> Result<String, ExecutorError> {
        let (hello, patience) = (self.hello(), self.config.get_ready);
        let (on_wait, mut waits) = (self.config.on_wait, String::new());
        let times = [self.config.connect, patience];
        let ack = self.link.greet(&hello, times, |reason| {
            if reason != waits {
                reason.clone_into(&mut waits);
                on_wait(reason);
            }
        })?;
        self.runner.open(&ack);
        Ok(text_of(&ack.name))
    }

    /// Opens a new session if the operator asked for one. A driver that gets ready is asked again,
    /// between periods in which nothing moves.
    fn recover(&mut self) {
        if !self.runner.wants_session() {
            self.asking = None;
            return;
        }
        let now = Instant::now();
        let [since, next] = self.asking.unwrap_or([now; 2]);
        if now < next {
            return;
        }
        let timeout = self.config.connect.min(Duration::from_secs(1));
        self.asking = None;
        match self.link.ask(&self.hello(), timeout) {
            Ok(Greeted::Welcome(ack)) => {
                self.runner.open(&ack);
                self.runner.recovered();
                self.waits.clear();
            }
            Ok(Greeted::Waits { reason, .. }) if since.elapsed() < self.config.get_ready => {
                self.asking = Some([since, Instant::now() + AGAIN]);
                if reason != self.waits {
                    (self.config.on_wait)(&reason);
                    self.waits = reason;
                }
            }
            Ok(Greeted::Waits { reason, .. }) => self.no_session(&reason),
            Err(error) => self.no_session(&error.to_string()),
        }
        // The handshake took time; the periods start again instead of being late.
        self.origin = now_ns().saturating_sub(self.tick * self.config.period_ns());
    }

    fn no_session(&mut self, reason: &str) {
        let reason = ShortText::new(reason);
        self.runner.fail(Fault::NoSession { reason });
    }

    /// Whether the thread should end now: it was asked to before this period, and arm and driver rest.
    fn leaves(&mut self) -> bool {
        if !self.shared.orders.is_shutting_down() {
            return false;
        }
        self.runner.leave();
        let Some(since) = self.leaving else {
            // One more period, so that a lock-step run ends with the same one each time.
            self.leaving = Some(Instant::now());
            return false;
        };
        self.runner.may_leave() || since.elapsed() > LEAVE
    }

    /// Tells the driver that the session ends, if the arm rests.
    fn say_goodbye(&self) {
        let last = *self.runner.last();
        if last.flags & SetpointFlags::HOLD != 0 && last.session == self.runner.session() {
            let flags = last.flags | SetpointFlags::GOODBYE;
            self.link.send(&Setpoint {
                flags,
                sequence: last.sequence + 1,
                ..last
            });
        }
    }

    /// The work of a period: receives, computes and sends.
    fn work(&mut self, came: bool, tick: Tick) {
        let setpoint = self.runner.tick(came, tick);
        if !self.link.send(setpoint) {
            self.shared.unsent.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sends the last setpoint once more.
    fn repeat(&mut self) {
        if !self.link.send(self.runner.again()) {
            self.shared.unsent.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Receives the states that came since the last period, the newest last; says whether one came.
    /// There is one in each period: one that was sent within the last `period` (ns) before `now_ns` is
    /// the newest, and nobody looks for another.
    fn receive(&mut self, now_ns: u64, period: u64) -> bool {
        let mut came = false;
        for _ in 0..A_LOOK {
            let incoming = self.runner.incoming();
            if !self.link.take_state(incoming) {
                break;
            }
            came = true;
            let age = now_ns.checked_sub(incoming.published_ns);
            if age.is_some_and(|age| age < period) {
                break;
            }
        }
        came
    }

    /// Periods by the wall clock: absolute deadlines; late periods are left out.
    fn by_the_clock(&mut self) {
        let period = self.config.period_ns();
        self.origin = now_ns() + period;
        let mut timer = PeriodicTimer::new(period);
        loop {
            let begin = self.origin + self.tick * period;
            timer.sleep(begin);
            // While it waits actively for the period: what the driver said is at hand when it begins.
            let came = self.receive(now_ns(), period);
            let now_ns = timer.wait(begin);
            let late = now_ns.saturating_sub(begin);
            self.shared.latency.count(late);
            let skipped = late / period;
            self.tick += skipped;
            let tick = Tick {
                number: self.tick,
                begin_ns: begin + skipped * period,
                now_ns,
                skipped,
            };
            self.work(came, tick);
            let work = scheduling::now_ns().saturating_sub(now_ns);
            self.shared.work.count(work);
            self.tick += 1;
            if self.leaves() {
                return self.say_goodbye();
            }
            self.recover();
        }
    }

    /// Periods in step with the driver: each state releases the next setpoint.
    fn in_step(&mut self) {
        loop {
            if self.wait_for_state() && self.stand() {
                self.virtual_period(true);
            } else if self.shared.orders.is_shutting_down() {
                return;
            } else {
                let silent_ms = LOCK_STEP_PATIENCE.as_millis() as u64;
                self.runner.latch(Fault::DriverLost { silent_ms });
                self.stop_alone();
            }
            if self.leaves() {
                return self.say_goodbye();
            }
            self.recover();
            while self.runner.samples_wait() && !self.shared.orders.is_shutting_down() {
                thread::yield_now();
            }
        }
    }

    /// Stops virtual time as long as the runner allows it; says whether there is a state, and not the
    /// end of the driver.
    fn stand(&mut self) -> bool {
        let mut since = Instant::now();
        let mut turns = 0_u32;
        // A sign of life repeats a period, so the first period of a session comes before it.
        let mine = self.runner.last().sequence > 0;
        while self.config.wait_for_planner && mine && self.runner.may_stand() {
            if self.shared.orders.is_shutting_down() {
                self.leaving.get_or_insert_with(Instant::now);
                break;
            }
            if self.runner.wants_session() {
                break;
            }
            turns = turns.saturating_add(1);
            if turns < 200 {
                thread::yield_now();
            } else {
                thread::sleep(Duration::from_micros(20));
            }
            if since.elapsed() > SIGN_OF_LIFE {
                since = Instant::now();
                self.repeat();
                if !self.wait_for_state() {
                    return false;
                }
                let driver = self.runner.incoming().driver();
                if matches!(driver, DriverState::Stopping | DriverState::Fault) {
                    break;
                }
            }
        }
        true
    }

    /// The driver of a lock-step session has ended: the motion comes to rest in virtual time.
    fn stop_alone(&mut self) {
        for _ in 0..100_000 {
            if self.runner.may_leave() {
                return;
            }
            self.virtual_period(false);
        }
    }

    /// One period of virtual time.
    fn virtual_period(&mut self, came: bool) {
        let begin_ns = self.tick * self.config.period_ns();
        let tick = Tick {
            number: self.tick,
            begin_ns,
            now_ns: begin_ns,
            skipped: 0,
        };
        self.work(came, tick);
        self.tick += 1;
    }

    /// Receives the next state of the session. `false` when none came for a long time, when the thread
    /// should end, or when a new session is wanted.
    fn wait_for_state(&mut self) -> bool {
        let start = Instant::now();
        loop {
            if self.link.take_state(self.runner.incoming()) {
                if self.runner.incoming().session == self.runner.session() {
                    self.turns.next();
                    return true;
                }
                continue;
            }
            if self.turns.wait() {
                let ends = self.shared.orders.is_shutting_down()
                    && start.elapsed() > Duration::from_millis(200);
                if ends || self.runner.wants_session() || start.elapsed() > LOCK_STEP_PATIENCE {
                    return false;
                }
            }
        }
    }
}

/// Waits until a time: sleeps until a little earlier, by the usual wake-up delay and what is done before the time, and
/// waits actively for the rest.
struct PeriodicTimer {
    /// How much earlier (ns): three of four delays are shorter.
    early: u64,
    /// The most of it (ns).
    most: u64,
}

impl PeriodicTimer {
    /// Divisor of the period: the longest active wait is this part of it.
    const AWAKE: u64 = 50;

    /// Change of the estimate (ns per period) after a shorter delay; after a longer one three times that.
    const STEP: u64 = 25;

    fn new(period: u64) -> Self {
        Self {
            early: 0,
            most: period / Self::AWAKE,
        }
    }

    /// Sleeps until a little before `begin` (ns).
    fn sleep(&self, begin: u64) {
        sleep_until_ns(begin.saturating_sub(self.early));
    }

    /// Waits actively until `begin` (ns), after [`Self::sleep`] and what is done before; returns the time then.
    fn wait(&mut self, begin: u64) -> u64 {
        let bed = begin.saturating_sub(self.early);
        let mut now = now_ns();
        // It stands where three are shorter for each one that is longer.
        self.early = if now.saturating_sub(bed) > self.early {
            (self.early + 3 * Self::STEP).min(self.most)
        } else {
            self.early.saturating_sub(Self::STEP)
        };
        while now < begin {
            core::hint::spin_loop();
            now = now_ns();
        }
        now
    }
}
