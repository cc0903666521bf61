//! In step with the driver: as fast as both can, and the same every time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use engine::executor::{Control, Event, Executor, Recorded, ToolOrder};
use ipc::{Clock, GRIPPER, ToolAction};
use system_tests::servo_arm::{JOINTS, driver_options, executor_config, feed, planned};

/// What a run leaves.
struct Run {
    events: Vec<Event>,
    samples: Vec<Recorded<JOINTS>>,
    seconds: f64,
}

/// Commands 0 to `commands`, a gripper order after the first, `disturb` called with each sample.
fn run(name: &str, commands: u32, disturb: impl Fn(u64) -> Option<Control>) -> Run {
    let arm: ipc::Arm = format!("servo-{}/{name}", std::process::id())
        .parse()
        .unwrap();
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let options = driver_options(arm.clone());
        let driver = scope.spawn(|| driver_sim::run(options, &stop).unwrap());
        let config = executor_config(arm, Clock::LockStep);
        let start = Instant::now();
        let (executor, mut feeder, mut monitor) = Executor::start(config).unwrap();
        let remote = executor.remote();
        for index in 0..commands {
            assert!(feed(&mut feeder, index));
            if index == 0 {
                let order = ToolOrder {
                    command: 1000,
                    tool: GRIPPER,
                    action: ToolAction::Close,
                    timeout: 1.0,
                };
                feeder.tool(order).unwrap();
            }
        }
        let (mut events, mut samples) = (Vec::new(), Vec::new());
        let patience = Instant::now();
        loop {
            while let Some(sample) = monitor.sample() {
                if let Some(control) = disturb(sample.tick) {
                    remote.control(control);
                }
                samples.push(sample);
            }
            while let Some(event) = monitor.event() {
                events.push(event);
            }
            let last = Some(commands - 1);
            let done = events.iter().rev().find_map(|event| match event {
                Event::Finished { command, .. } => Some(*command),
                Event::Faulted { fault, .. } => panic!("{fault}"),
                _ => None,
            });
            if done == last {
                break;
            }
            assert!(
                patience.elapsed() < Duration::from_secs(120),
                "not done: {events:?}"
            );
            thread::yield_now();
        }
        let seconds = start.elapsed().as_secs_f64();
        drop(executor);
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
    let run = run("plan", 6, |_| None);
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
    let first = bits(&run("twice-a", 4, |_| None), 4);
    let second = bits(&run("twice-b", 4, |_| None), 4);
    assert!(first.len() > 3800 * 3 * JOINTS);
    assert!(first == second, "two runs differ");
}

/// A pause, an override and a fast stop on the way change the time, never the way; the limits
/// hold for what was published.
#[test]
fn the_operator_changes_time_only() {
    let run = run("operator", 6, |tick| match tick {
        300 => Some(Control::Pause),
        1200 => Some(Control::Resume),
        1700 => Some(Control::Override(0.3)),
        3000 => Some(Control::Stop { fast: true }),
        4000 => Some(Control::Resume),
        5500 => Some(Control::Override(1.0)),
        _ => None,
    });
    for sample in &run.samples {
        if sample.command < 6 {
            let plan = planned(sample.command, sample.path_time);
            assert!((sample.setpoint.position - plan).amax() < 1e-9);
        }
    }
    let limits = system_tests::servo_arm::limits();
    for four in run.samples.windows(4) {
        let p = |index: usize| four[index].setpoint.position;
        let third = (p(3) - p(0) + (p(1) - p(2)) * 3.0) / 1e-9;
        let second = (p(3) - p(2) * 2.0 + p(1)) / 1e-6;
        assert!(third.amax() <= limits.jerk[0] * (1.0 + 1e-6) + 1e-5);
        assert!(second.amax() <= limits.acceleration[0] * (1.0 + 1e-6) + 1e-8);
    }
    let stopped = run
        .events
        .iter()
        .filter(|event| matches!(event, Event::Stopped { .. }))
        .count();
    assert_eq!(stopped, 2);
}
