//! Runs a driver with shared memory and a clock.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ipc::{Arm, Clock, DriverLink, Setpoint};
use scheduling::{RealTimeRequest, Turns, now_ns, request_real_time, sleep_until_ns};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::log::Log;
use crate::{Driver, DriverError, Robot};

/// The period without a session (ns).
const IDLE_NS: u64 = 2_000_000;

/// For how many periods a driver that ends reports it.
const FAREWELL: u32 = 20;

/// How long lock-step waits for the engine before it counts as gone (ns).
const LOCK_STEP_PATIENCE_NS: u64 = 1_000_000_000;

/// What a run of the driver came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriverReport {
    /// Periods.
    pub periods: u64,
    /// Periods of sessions without a new setpoint.
    pub missed: u64,
    /// Sessions.
    pub sessions: u64,
    /// What the operating system refused, in one sentence.
    pub warning: Option<String>,
    /// If the driver was told to end while the arm moved: what it did, in one sentence.
    pub braked: Option<String>,
}

/// How a driver runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunOptions {
    /// File for the received setpoints, as CSV.
    pub log: Option<PathBuf>,
    /// What the process asks of the operating system; nothing of it in lock-step.
    pub real_time: RealTimeRequest,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            log: None,
            real_time: RealTimeRequest {
                priority: 50,
                ..RealTimeRequest::default()
            },
        }
    }
}

/// A flag for [`run`] that SIGINT, SIGTERM and SIGHUP set: with these an operator ends a driver. A
/// second signal has no effect, so that it does not interrupt the braking.
///
/// # Errors
/// [`DriverError::Signals`] when signals cannot be received.
pub fn asked_to_end() -> Result<Arc<AtomicBool>, DriverError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(|cause| {
            DriverError::Signals {
                cause: cause.to_string(),
            }
        })?;
    }
    Ok(stop)
}

/// Drives `robot` as `arm` until `stop` becomes true. If the arm moves then, it is first braked
/// within its limits, and the engine gets [`ipc::FaultCode::Ended`].
///
/// # Errors
/// When the robot's description is not consistent, the arm already has a driver, or shared memory
/// cannot be used.
pub fn run<R: Robot>(
    arm: &Arm,
    robot: R,
    options: &RunOptions,
    stop: &AtomicBool,
) -> Result<DriverReport, DriverError> {
    let real_time = options.real_time;
    let link = DriverLink::open(arm)?;
    // Before the first session: with much memory it takes some tenths of a second.
    let locked = request_real_time(RealTimeRequest {
        priority: 0,
        processor: None,
        low_latency: false,
        ..real_time
    });
    let mut log = Log::open(options.log.as_deref())?;
    let mut driver = Driver::new(robot)?;
    let mut report = DriverReport {
        warning: locked.warning(),
        ..DriverReport::default()
    };
    let mut incoming = Setpoint::default();
    // In lock-step the driver may spin, which a real-time thread must not do.
    let mut granted = None;
    while !stop.load(Ordering::Relaxed) {
        match driver.clock() {
            Some(Clock::LockStep) => {
                report.periods += lock_step(&link, &mut driver, &mut log, stop)
            }
            _ => {
                if driver.clock().is_some() && granted.is_none() {
                    let mut given = request_real_time(RealTimeRequest {
                        lock_memory: false,
                        ..real_time
                    });
                    given.refused.splice(0..0, locked.refused.iter().cloned());
                    report.warning = given.warning();
                    granted = Some(given);
                }
                report.periods += 1;
                wall_period(&link, &mut driver, &mut log, &mut incoming);
            }
        }
    }
    report.braked = end(&link, &mut driver, &mut log, &mut incoming);
    report.missed = driver.missed_in_all();
    report.sessions = driver.sessions();
    Ok(report)
}

/// Brings the arm to rest and informs the engine; returns what was done if the arm moved.
fn end<R: Robot>(
    link: &DriverLink,
    driver: &mut Driver<R>,
    log: &mut Log,
    incoming: &mut Setpoint,
) -> Option<String> {
    let period = driver.period_ns().unwrap_or(IDLE_NS);
    let paced = driver.clock() == Some(Clock::LockStep);
    let told = driver.clock().is_some();
    let moves = driver.leave();
    let (mut periods, mut more) = (0_u64, if told { FAREWELL } else { 0 });
    // Braking ends, but with a very small limit it may take long.
    while periods < 1_000_000 && (!driver.is_resting() || more > 0) {
        if driver.is_resting() {
            more -= 1;
        } else {
            periods += 1;
        }
        if paced {
            // Nothing sets the pace any more; the last states get time to be read.
            answer_greeting(link, driver);
            link.send(driver.step(0, period));
            if driver.is_resting() {
                thread::sleep(Duration::from_millis(1));
            }
        } else {
            wall_period(link, driver, log, incoming);
        }
    }
    driver.close();
    moves.then(|| {
        format!(
            "told to end while the arm moved: braked to rest within the joint limits in {} ms",
            periods.saturating_mul(period) / 1_000_000
        )
    })
}

/// Answers a request for a session if one waits.
fn answer_greeting<R: Robot>(link: &DriverLink, driver: &mut Driver<R>) {
    if let Some(greeting) = link.greeting() {
        let ack = driver.greet(&greeting.hello, now_ns());
        greeting.answer(ack);
    }
}

/// One period by the clock: 0.4 periods after the engine's. Setpoints are received in `incoming`.
fn wall_period<R: Robot>(
    link: &DriverLink,
    driver: &mut Driver<R>,
    log: &mut Log,
    incoming: &mut Setpoint,
) {
    let period = driver.period_ns().unwrap_or(IDLE_NS);
    let phase = match driver.last_setpoint().tick_ns {
        0 => 0,
        tick => tick + period * 2 / 5,
    };
    let now = now_ns();
    let next = now + period - (now.wrapping_sub(phase)) % period;
    sleep_until_ns(next);
    answer_greeting(link, driver);
    if driver.clock() == Some(Clock::LockStep) {
        return;
    }
    while link.take_setpoint(incoming) {
        // Read again each time: a process may be stopped anywhere, and the age of a setpoint
        // counts.
        let now = now_ns();
        driver.receive(incoming, now);
        log.write(incoming, driver, now);
    }
    link.send(driver.step(now_ns(), period));
}

/// Periods as fast as the engine asks for them; time is that of the setpoints. Returns after a few
/// thousand periods, or when the engine sends nothing.
fn lock_step<R: Robot>(
    link: &DriverLink,
    driver: &mut Driver<R>,
    log: &mut Log,
    stop: &AtomicBool,
) -> u64 {
    let Some(period) = driver.period_ns() else {
        return 0;
    };
    // A separate time that is the same in every run.
    let mut virtual_ns = driver
        .last_setpoint()
        .tick
        .saturating_add(1)
        .saturating_mul(period);
    if driver.last_setpoint().sequence == 0 {
        link.send(driver.step(0, period));
    }
    let mut turns = Turns::new();
    for periods in 1..=4096 {
        let Some(setpoint) = wait_for_setpoint(link, driver, (&mut turns, stop)) else {
            return periods;
        };
        if let Some(state) = driver.sign_of_life(&setpoint) {
            link.send(state);
            continue;
        }
        virtual_ns = virtual_ns.max(setpoint.tick.saturating_mul(period));
        driver.receive(&setpoint, virtual_ns);
        log.write(&setpoint, driver, virtual_ns);
        link.send(driver.step(virtual_ns, period));
        if driver.clock() != Some(Clock::LockStep) {
            return periods;
        }
    }
    4096
}

/// Waits for the next setpoint. If none comes, the driver stops the arm in virtual time and latches.
fn wait_for_setpoint<R: Robot>(
    link: &DriverLink,
    driver: &mut Driver<R>,
    (turns, stop): (&mut Turns, &AtomicBool),
) -> Option<Setpoint> {
    let start = Instant::now();
    loop {
        if let Some(setpoint) = link.next_setpoint() {
            // A setpoint that was sent before the session began releases no state.
            if driver.is_of_session(&setpoint) {
                turns.next();
                return Some(setpoint);
            }
            continue;
        }
        if turns.wait() {
            let sessions = driver.sessions();
            answer_greeting(link, driver);
            if driver.sessions() != sessions || stop.load(Ordering::Relaxed) {
                return None;
            }
            if start.elapsed() > Duration::from_nanos(LOCK_STEP_PATIENCE_NS) {
                give_up(link, driver);
                return None;
            }
        }
    }
}

/// The engine of a lock-step session has ended: the arm stops in virtual time.
fn give_up<R: Robot>(link: &DriverLink, driver: &mut Driver<R>) {
    let (Some(period), Some(watchdog)) = (driver.period_ns(), driver.watchdog_ns()) else {
        return;
    };
    let mut now = driver
        .last_setpoint()
        .tick
        .saturating_mul(period)
        .saturating_add(watchdog);
    for _ in 0..100_000 {
        if driver.state() == ipc::DriverState::Fault {
            break;
        }
        now = now.saturating_add(period.max(watchdog));
        link.send(driver.step(now, period));
    }
    thread::sleep(Duration::from_millis(2));
    link.send(driver.step(now, period));
}
