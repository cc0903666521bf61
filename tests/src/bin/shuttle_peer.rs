//! An engine or a driver as a separate process, for the test of random stalls and kills.
//!
//! `shuttle-peer driver ARM FILE` runs the simulated driver under a witness that writes to FILE.
//! `shuttle-peer engine ARM` drives all joints from one end of their range to the other, as fast as
//! a quintic keeps the limits, and prints a line for each event; a line `recover` on its standard
//! input asks for a new session.

use std::io::{BufRead, Write, stdin, stdout};
use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use driver_kit::RunOptions;
use realtime::{Piece, Sample, Segment};
use servo::{Event, Executor, SegmentSender};
use system_tests::domain::inherited;
use system_tests::servo_arm::{JOINTS, Joints, driver_options, executor_config, limits};
use system_tests::witness::Witness;

/// The ends of the ranges (rad).
const ENDS: [f64; 2] = [-1.0, 1.0];

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let result = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["driver", arm, file] => driver(arm, file),
        ["engine", arm] => engine(arm),
        _ => Err("usage: shuttle-peer driver ARM FILE | engine ARM".into()),
    };
    if let Err(error) = result {
        eprintln!("{error}");
        return ExitCode::from(4);
    }
    ExitCode::SUCCESS
}

fn driver(arm: &str, file: &str) -> Outcome {
    let arm = inherited()?.arm(arm)?;
    let mut options = driver_options(arm.clone());
    options.position = vec![0.0; JOINTS];
    options.lower = vec![ENDS[0]; JOINTS];
    options.upper = vec![ENDS[1]; JOINTS];
    let robot = Witness::new(driver_sim::Simulated::new(options)?, Path::new(file))?;
    let stop = driver_kit::asked_to_end()?;
    let report = driver_kit::run(&arm, robot, &RunOptions::default(), &stop)?;
    if let Some(braked) = report.braked {
        eprintln!("{braked}");
    }
    Ok(())
}

fn engine(arm: &str) -> Outcome {
    let mut config = executor_config(inherited()?.arm(arm)?, ipc::Clock::Wall);
    config.record = false;
    let (executor, mut sender, mut monitor) = Executor::<JOINTS>::start(config)?;
    let remote = executor.remote();
    thread::spawn(move || {
        for line in stdin().lock().lines().map_while(Result::ok) {
            if line == "recover" && remote.recover().is_err() {
                say("NoFault");
            }
        }
    });
    let mut from = executor.remote().measured().setpoint;
    let (mut next, mut finished) = (0_u32, 0_u32);
    loop {
        while let Some(event) = monitor.event() {
            say(&format!("{event:?}"));
            match event {
                Event::Recovered { .. } => {
                    sender.renew();
                    from = executor.remote().measured().setpoint;
                    finished = next;
                }
                Event::Finished { command, .. } => finished = command + 1,
                _ => {}
            }
        }
        if next.saturating_sub(finished) < 3 {
            let to = Joints::from_element(ENDS[next as usize % 2]);
            if shuttle(&mut sender, next, [from, to]) {
                (next, from) = (next + 1, to);
            }
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Sends a move from rest to rest; returns whether there was room.
fn shuttle(sender: &mut SegmentSender<JOINTS>, command: u32, [from, to]: [Joints; 2]) -> bool {
    let limits = limits();
    let (mut far, mut duration) = (0.0_f64, 0.1_f64);
    for joint in 0..JOINTS {
        let distance = (to[joint] - from[joint]).abs();
        far = far.max(distance);
        let speed = 1.875 * distance / limits.velocity[joint];
        let force = (5.7736 * distance / limits.acceleration[joint]).sqrt();
        let jerk = (60.0 * distance / limits.jerk[joint]).cbrt();
        duration = duration.max(speed).max(force).max(jerk);
    }
    let piece = Piece::hermite(duration, &Sample::rest(from), &Sample::rest(to));
    let segment = Segment {
        piece,
        command,
        last: true,
    };
    sender.push(segment).is_ok()
}

fn say(line: &str) {
    let mut out = stdout().lock();
    // A test that has gone reads no more.
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}
