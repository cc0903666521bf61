//! An engine or a driver as a process of its own, to be killed and stopped by the tests.
//!
//! `servo-peer driver ARM LOG` runs the simulated driver; `servo-peer engine ARM` drives it to
//! and fro for ever and prints a line for each event; a line `recover` on its standard input asks
//! for a new session.

use std::io::{BufRead, Write, stdin, stdout};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use engine::executor::{Event, Executor, Feeder};
use system_tests::servo_arm::{JOINTS, driver_options, executor_config, feed};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let result = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["driver", arm, log] => driver(arm, log),
        ["engine", arm] => engine(arm),
        _ => Err("usage: servo-peer driver ARM LOG | engine ARM".into()),
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
    let mut next = 0;
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
