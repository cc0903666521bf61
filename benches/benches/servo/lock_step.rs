//! How fast the whole chain runs in lock-step.

use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{Arm, Clock};
use servo::{Event, Executor, ExecutorConfig};

use crate::peer::Peer;
use crate::{N, arm, command, limits};

/// How much faster than real time the whole chain runs in lock-step with the simulated driver and
/// with MuJoCo, and the required minimum.
pub(crate) fn lock_steps(ratios: &mut Vec<(String, f64)>) {
    let arm = arm("step");
    let driver = Peer::start("driver", &arm);
    if let Some(speed) = lock_step(&arm, 60) {
        println!("lock-step with the simulated driver: {speed:.0} times real time");
        ratios.push(("lock-step-sim-of-200".to_owned(), 200.0 / speed));
    }
    drop(driver);
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let script = format!("{root}/drivers/python/mujoco_driver.py");
    let urdf = format!("{root}/robots/ur5e/robot.urdf");
    let python = Command::new("python3")
        .args([&script, &arm.to_string(), &urdf])
        .stdout(std::process::Stdio::null())
        .spawn();
    let speed = python.ok().and_then(|child| {
        let mut peer = Peer(child);
        sleep(Duration::from_secs(3));
        let alive = matches!(peer.0.try_wait(), Ok(None));
        if alive { lock_step(&arm, 20) } else { None }
    });
    match speed {
        Some(speed) => {
            println!("lock-step with MuJoCo, UR5e from its URDF: {speed:.1} times real time");
            ratios.push(("lock-step-mujoco-of-25".to_owned(), 25.0 / speed));
        }
        None => println!("python3 with mujoco and iceoryx2 is missing: no lock-step with MuJoCo"),
    }
}

/// How much faster than real time `commands` of about a second run in lock-step with the arm's
/// driver.
fn lock_step(arm: &Arm, commands: u32) -> Option<f64> {
    let config = ExecutorConfig {
        clock: Clock::LockStep,
        ..ExecutorConfig::new(arm.clone(), limits())
    };
    let (executor, mut sender, mut monitor) = Executor::<N>::start(config).ok()?;
    let start = Instant::now();
    (0..commands).for_each(|index| sender.push(command(index)).unwrap());
    while start.elapsed() < Duration::from_secs(60) {
        while let Some(event) = monitor.event() {
            match event {
                Event::Finished { command, .. } if command + 1 == commands => {
                    let ticks = executor.remote().counters().ticks;
                    return Some(ticks as f64 * 0.001 / start.elapsed().as_secs_f64());
                }
                Event::Faulted { fault, .. } => println!("fault: {fault}"),
                _ => {}
            }
        }
        sleep(Duration::from_millis(1));
    }
    None
}
