//! An engine or a driver as a separate process that tests kill and stop.
//!
//! `servo-peer driver ARM LOG` runs the simulated driver; `servo-peer engine ARM` drives it back
//! and forth for ever and prints a line for each event; a line `recover` on its standard input asks
//! for a new session. `servo-peer paced ARM COMMANDS` drives that many commands in step with any
//! driver and says how fast that was.

use std::io::{BufRead, Write, stdin, stdout};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use servo::{Event, Executor, SegmentSender};
use system_tests::domain::inherited;
use system_tests::servo_arm::{JOINTS, driver_options, executor_config, feed};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let result = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["driver", arm, log] => driver(arm, log),
        ["engine", arm] => engine(arm),
        ["paced", arm, commands] => paced(arm, commands),
        ["hostile", arm, log, kind] => hostile(arm, log, kind),
        _ => Err(
            "usage: servo-peer driver ARM LOG | engine ARM | paced ARM COMMANDS \
                  | hostile ARM LOG KIND"
                .into(),
        ),
    };
    if let Err(error) = result {
        eprintln!("{error}");
        return ExitCode::from(4);
    }
    ExitCode::SUCCESS
}

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn driver(arm: &str, log: &str) -> Outcome {
    let mut options = driver_options(inherited()?.arm(arm)?);
    options.log = Some(log.into());
    static STOP: AtomicBool = AtomicBool::new(false);
    driver_sim::run(options, &STOP)?;
    Ok(())
}

fn engine(arm: &str) -> Outcome {
    let mut config = executor_config(inherited()?.arm(arm)?, ipc::Clock::Wall);
    config.record = false;
    let (executor, mut sender, mut monitor) = Executor::<JOINTS>::start(config)?;
    let remote = executor.remote();
    static STARVE: AtomicBool = AtomicBool::new(false);
    thread::spawn(move || {
        for line in stdin().lock().lines().map_while(Result::ok) {
            match line.as_str() {
                "recover" => {
                    if let Err(error) = remote.recover() {
                        say(&error.to_string());
                    }
                }
                "starve" => STARVE.store(true, Ordering::Relaxed),
                _ => {}
            }
        }
    });
    say("ready");
    let mut next = return_home(&mut sender, &executor, 0);
    let (mut finished, mut starved) = (next, false);
    loop {
        while let Some(event) = monitor.event() {
            say(&format!("{event:?}"));
            match event {
                Event::Recovered { .. } => {
                    sender.renew();
                    next = return_home(&mut sender, &executor, next);
                    finished = next;
                }
                Event::Finished { command, .. } => finished = command + 1,
                _ => {}
            }
        }
        // A short buffer, so that requests act soon.
        let queued = next.saturating_sub(finished);
        if STARVE.load(Ordering::Relaxed) {
            if !starved && executor.remote().measured().idle {
                starved = true;
                half_a_command(&mut sender, &executor);
            }
        } else if queued < 3 && feed(&mut sender, next) {
            next += 1;
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// The first 3 s of a command of 6 s; the rest never comes.
fn half_a_command(sender: &mut SegmentSender<JOINTS>, executor: &Executor<JOINTS>) {
    let from = executor.remote().measured().setpoint;
    let to = from.map(|at| at + 0.8);
    let whole = realtime::Piece::hermite(
        6.0,
        &realtime::Sample::rest(from),
        &realtime::Sample::rest(to),
    );
    // The ring is empty.
    let _ = sender.push(realtime::Segment {
        piece: realtime::Piece {
            duration: 3.0,
            ..whole
        },
        command: 4_000_000_000,
        last: false,
    });
}

/// A driver that keeps the protocol until it has followed for a while, then goes wrong.
fn hostile(arm: &str, log: &str, kind: &str) -> Outcome {
    const PERIOD: u64 = 1_000_000;
    let arm = inherited()?.arm(arm)?;
    let link = ipc::DriverLink::open(&arm)?;
    let mut driver = driver_sim::driver(driver_options(arm))?;
    let mut log = std::fs::File::create(log)?;
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let (mut next, mut active) = (scheduling::now_ns(), 0_u64);
    loop {
        next = (next + PERIOD).max(scheduling::now_ns());
        scheduling::sleep_until_ns(next);
        if let Some(greeting) = link.greeting() {
            let ack = driver.greet(&greeting.hello, next);
            greeting.answer(old(ack, kind));
        }
        active += u64::from(driver.state() == ipc::DriverState::Active);
        let reads = kind != "slow" || active % 20 == 0 || active < 100;
        let setpoints = std::iter::from_fn(|| link.next_setpoint());
        for setpoint in setpoints.take(if reads { 64 } else { 0 }) {
            driver.receive(&setpoint, next);
            write(&mut log, &setpoint, &driver, next)?;
        }
        let mut state = *driver.step(next, PERIOD);
        if active > 900 {
            spoil(&mut state, kind, &mut random);
        }
        link.send(&state);
    }
}

/// The answer of a driver of another version.
fn old(mut ack: ipc::HelloAck, kind: &str) -> ipc::HelloAck {
    match kind {
        "old-answer" => ack.protocol = 7,
        "old-refusal" => {
            let reason = "protocol 2, expected 7";
            let verdict = ipc::Verdict::WrongProtocol;
            return ipc::HelloAck::refusal(JOINTS, verdict, reason);
        }
        _ => {}
    }
    ack
}

/// What a driver that goes wrong says.
fn spoil(state: &mut ipc::State, kind: &str, random: &mut u64) {
    let mut bits = || {
        *random ^= *random << 13;
        *random ^= *random >> 7;
        *random ^= *random << 17;
        *random
    };
    match kind {
        "nan" => state.position[2] = f64::NAN,
        "range" => state.driver_state = 77,
        "jump" => state.position[1] += 0.3,
        "random" => {
            // Sometimes all of it, otherwise everything after the head.
            if bits() % 4 == 0 {
                (state.session, state.sequence) = (bits(), bits());
                (state.protocol, state.joints) = (bits() as u32, bits() as u32);
            }
            (state.measured_ns, state.published_ns) = (bits(), bits());
            (state.driver_state, state.fault) = (bits() as u32, bits() as u32);
            let (positions, velocities) = (&mut state.position, &mut state.velocity);
            for value in positions.iter_mut().chain(velocities) {
                *value = f64::from_bits(bits());
            }
        }
        _ => {}
    }
}

/// A line like those of the simulated driver's own log.
fn write(
    log: &mut std::fs::File,
    setpoint: &ipc::Setpoint,
    driver: &driver_sim::Driver,
    now: u64,
) -> std::io::Result<()> {
    let mut line = format!(
        "{now},{},{},{},{}",
        setpoint.session, setpoint.sequence, setpoint.tick, setpoint.flags
    );
    let lists = [
        &setpoint.position,
        &setpoint.velocity,
        &setpoint.acceleration,
    ];
    for value in lists.into_iter().flat_map(|list| list.iter().take(JOINTS)) {
        line.push_str(&format!(",{value:e}"));
    }
    for joint in 0..JOINTS {
        line.push_str(&format!(",{:e}", driver.position(joint)));
    }
    writeln!(log, "{line}")
}

fn paced(arm: &str, commands: &str) -> Outcome {
    let last: u32 = commands.parse()?;
    let mut config = executor_config(inherited()?.arm(arm)?, ipc::Clock::LockStep);
    config.record = true;
    let (executor, mut sender, mut monitor) = Executor::<JOINTS>::start(config)?;
    let start = Instant::now();
    let mut next = return_home(&mut sender, &executor, 0);
    let mut worst = 0.0_f64;
    loop {
        while let Some(sample) = monitor.sample() {
            for (measured, setpoint) in sample.measured.iter().zip(&sample.setpoint.position) {
                worst = worst.max((measured - setpoint).abs());
            }
        }
        while let Some(event) = monitor.event() {
            match event {
                Event::Finished { command, .. } if command >= last => {
                    let ticks = executor.remote().counters().ticks;
                    let speed = ticks as f64 * 0.001 / start.elapsed().as_secs_f64();
                    say(&format!(
                        "{ticks} periods, {speed:.1} times real time, error {worst:e}"
                    ));
                    return Ok(());
                }
                Event::Faulted { fault, .. } => return Err(fault.to_string().into()),
                _ => {}
            }
        }
        while next <= last && sender.room() > 4000 && feed(&mut sender, next) {
            next += 1;
        }
        thread::sleep(Duration::from_micros(200));
    }
}

/// From wherever the arm is slowly to where the even commands begin.
fn return_home(sender: &mut SegmentSender<JOINTS>, executor: &Executor<JOINTS>, next: u32) -> u32 {
    let from = realtime::Sample::rest(executor.remote().measured().setpoint);
    let to = realtime::Sample::rest(system_tests::servo_arm::home());
    let piece = realtime::Piece::hermite(1.5, &from, &to);
    let command = next + next % 2;
    // The ring was emptied by the recovery.
    let _ = sender.push(realtime::Segment {
        piece,
        command,
        last: true,
    });
    command
}

fn say(line: &str) {
    let mut out = stdout().lock();
    // A test that has gone reads no more.
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}
