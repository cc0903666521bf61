//! Drivers of real arms against foreign controllers, as real processes.
//!
//! Where a controller is not installed, its tests are reported as ignored:
//! `pip install franka-sim==1.1.7` brings the one of Franka arms, and `CANTER_FRANKA_PYTHON` names the
//! Python that has it. They need a machine that is nearly idle: the controller stops the arm at the
//! first step that is beyond its maker's limits, and a machine that stalls brings such steps.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;
mod franka;

use libtest_mimic::{Arguments, Trial};

fn main() {
    let tests: Vec<(&str, fn())> = vec![
        ("franka::pick_and_place", franka::pick_and_place),
        ("franka::kills_and_restarts", franka::kills_and_restarts),
        ("franka::the_driver_conforms", franka::the_driver_conforms),
    ];
    let mut arguments = Arguments::from_args();
    // The gripper of the controller has a fixed port.
    arguments.test_threads = Some(1);
    let missing = franka::missing();
    if let Some(reason) = &missing {
        eprintln!("ignored: {reason}");
    }
    let trial = |(name, test): (&str, fn())| {
        Trial::test(name, move || {
            test();
            Ok(())
        })
        .with_ignored_flag(missing.is_some())
    };
    let trials = tests.into_iter().map(trial).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
