//! An engine or a driver as a process of its own, to be killed and stopped by the tests.
//!
//! `servo-peer driver ARM LOG` runs the simulated driver; `servo-peer engine ARM` drives it to
//! and fro for ever and prints a line for each event; a line `recover` on its standard input asks
//! for a new session. `servo-peer paced ARM COMMANDS` drives that many commands in step with any
//! driver and says how fast that was.

use std::io::{BufRead, Write, stdin, stdout};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant};

use engine::executor::{Event, Executor, Feeder};
use system_tests::servo_arm::{JOINTS, driver_options, executor_config, feed};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let result = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["driver", arm, log] => driver(arm, log),
        ["engine", arm] => engine(arm),
        ["paced", arm, commands] => paced(arm, commands),
        _ => Err("usage: servo-peer driver ARM LOG | engine ARM | paced ARM COMMANDS".into()),
    };
    if let Err(error) = result {
        eprintln!("{error}");
        return ExitCode::from(4);
    }
    ExitCode::SUCCESS
}

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn driver(arm: &str, log: &str) -> Outcome {
    let mut options = driver_options(arm.parse()?);
    options.log = Some(log.into());
    static STOP: AtomicBool = AtomicBool::new(false);
    driver_sim::run(options, &STOP)?;
    Ok(())
}

fn engine(arm: &str) -> Outcome {
    let mut config = executor_config(arm.parse()?, ipc::Clock::Wall);
    config.record = false;
    let (executor, mut feeder, mut monitor) = Executor::<JOINTS>::start(config)?;
    let remote = executor.remote();
    thread::spawn(move || {
        for line in stdin().lock().lines().map_while(Result::ok) {
            if line == "recover" {
                remote.recover();
            }
        }
    });
    say("ready");
    let mut next = return_home(&mut feeder, &executor, 0);
    loop {
        while let Some(event) = monitor.event() {
            say(&format!("{event:?}"));
            if matches!(event, Event::Recovered { .. }) {
                feeder.renew();
                next = return_home(&mut feeder, &executor, next);
            }
        }
        while feeder.room() > 4000 && feed(&mut feeder, next) {
            next += 1;
        }
        thread::sleep(Duration::from_millis(1));
    }
}

fn paced(arm: &str, commands: &str) -> Outcome {
    let last: u32 = commands.parse()?;
    let mut config = executor_config(arm.parse()?, ipc::Clock::LockStep);
    config.record = true;
    let (executor, mut feeder, mut monitor) = Executor::<JOINTS>::start(config)?;
    let start = Instant::now();
    let mut next = return_home(&mut feeder, &executor, 0);
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
        while next <= last && feeder.room() > 4000 && feed(&mut feeder, next) {
            next += 1;
        }
        thread::sleep(Duration::from_micros(200));
    }
}

/// From wherever the arm is slowly to where the even commands begin.
fn return_home(feeder: &mut Feeder<JOINTS>, executor: &Executor<JOINTS>, next: u32) -> u32 {
    let from = realtime::Sample::rest(executor.remote().measured().setpoint);
    let to = realtime::Sample::rest(system_tests::servo_arm::home());
    let piece = realtime::Piece::hermite(1.5, &from, &to);
    let command = next + next % 2;
    // The ring was emptied by the recovery.
    let _ = feeder.push(realtime::Segment {
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
