//! Lock-step: as fast as both sides can, with the same result every time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ipc::{Clock, GRIPPER, ToolAction};
use servo::{Event, Executor, Recorded, ToolOrder};
use system_tests::servo_arm::{JOINTS, driver_options, executor_config, feed, planned};

/// What a run leaves.
struct Run {
    events: Vec<Event>,
    samples: Vec<Recorded<JOINTS>>,
    seconds: f64,
}

/// Whether this command is done, and none after it.
fn has_finished(events: &[Event], last: u32) -> bool {
    let done = events.iter().rev().find_map(|event| match event {
        Event::Finished { command, .. } => Some(*command),
        Event::Faulted { fault, .. } => panic!("{fault}"),
        _ => None,
    });
    done == Some(last)
}

/// Commands 0 to `commands`, a gripper order after the first.
fn run(name: &str, commands: u32) -> Run {
    let arm = system_tests::domain::arm(&format!("servo/{name}"));
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let _stop = crate::StopOnDrop(&stop);
        let options = driver_options(arm.clone());
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        let config = executor_config(arm, Clock::LockStep);
        let start = Instant::now();
        let (executor, mut sender, mut monitor) = Executor::start(config).unwrap();
        for index in 0..commands {
            assert!(feed(&mut sender, index));
            if index == 0 {
                let order = ToolOrder::new(1000, GRIPPER, ToolAction::Close, 1.0);
                sender.tool(order).unwrap();
            }
        }
        let (mut events, mut samples) = (Vec::new(), Vec::new());
        let patience = Instant::now();
        while !has_finished(&events, commands - 1) {
            samples.extend(std::iter::from_fn(|| monitor.sample()));
            events.extend(std::iter::from_fn(|| monitor.event()));
            assert!(
                patience.elapsed() < Duration::from_secs(120),
                "not done: {events:?}"
            );
            thread::yield_now();
        }
        let seconds = start.elapsed().as_secs_f64();
        drop(executor);
        // The periods in work when the last event came.
        samples.extend(std::iter::from_fn(|| monitor.sample()));
        stop.store(true, Ordering::Relaxed);
        driver.join().unwrap();
        Run {
            events,
            samples,
            seconds,
        }
    })
}

/// The samples of each command as bits, from its start tick on.
fn bits(run: &Run, commands: u32) -> Vec<u64> {
    let mut bits = Vec::new();
    let finished = |event: &&Event| matches!(event, Event::Finished { command, .. } if *command + 1 == commands);
    let Some(Event::Finished { tick: end, .. }) = run.events.iter().find(finished) else {
        panic!()
    };
    for sample in &run.samples {
        if sample.tick <= *end && sample.path_time > 0.0 {
            bits.extend(sample.setpoint.position.iter().map(|value| value.to_bits()));
            bits.extend(sample.setpoint.velocity.iter().map(|value| value.to_bits()));
            bits.extend(sample.measured.iter().map(|value| value.to_bits()));
        }
    }
    bits
}

/// The published samples are the plan's, to 1e-9 rad, at whole periods from each command's start;
/// the driver follows closely.
#[test]
fn the_samples_are_the_plans() {
    let run = run("plan", 6);
    let mut started = [None; 6];
    for event in &run.events {
        if let Event::Started { command, tick } = event
            && *command < 6
        {
            started[*command as usize] = Some(*tick);
        }
    }
    let mut compared = 0;
    let mut worst_following = 0.0_f64;
    for sample in &run.samples {
        let Some(start) = started[sample.command as usize] else {
            continue;
        };
        if sample.tick < start {
            continue;
        }
        let plan = planned(sample.command, (sample.tick - start) as f64 * 0.001);
        let distance = (sample.setpoint.position - plan).amax();
        assert!(
            distance < 1e-9,
            "{distance} rad from the plan in period {}",
            sample.tick
        );
        for joint in 0..JOINTS {
            let error = sample.measured[joint] - sample.setpoint.position[joint];
            worst_following = worst_following.max(error.abs());
        }
        compared += 1;
    }
    assert!(compared > 5800, "{compared}");
    // A command takes 979.2 periods: it ends with the 980th. The gripper closes in 0.2 s.
    let span = started[5].unwrap() - started[1].unwrap();
    assert_eq!(span, 4 * 980);
    assert!(started[1].unwrap() - started[0].unwrap() >= 980 + 200);
    assert!(
        worst_following < 1e-4,
        "following error {worst_following} rad"
    );
    println!(
        "{compared} samples, {:.0} times real time",
        compared as f64 * 0.001 / run.seconds
    );
}

/// The same program gives the same bytes, however the processes were scheduled.
#[test]
fn two_runs_are_byte_identical() {
    let first = bits(&run("twice-a", 4), 4);
    let second = bits(&run("twice-b", 4), 4);
    assert!(first.len() > 3800 * 3 * JOINTS);
    assert!(first == second, "two runs differ");
}
