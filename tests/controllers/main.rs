//! Drivers of real arms against foreign controllers, or stand-ins for them, as real processes.
//!
//! Where a controller or a client is not installed, its tests are reported as ignored:
//! `pip install franka-sim==1.1.7` brings the one of Franka arms, `pip install ur_rtde==1.6.5` a
//! client for the arms of Universal Robots, `pip install RSIPI==0.3.0` the echo server of KUKA arms;
//! `CANTER_FRANKA_PYTHON`, `CANTER_UR_PYTHON` and `CANTER_RSI_PYTHON` name the Python that has them
//! (franka-sim needs older packages than the others). On a machine that stalls, the controller of Franka arms sees steps
//! beyond its maker's limits and stops the arm: these tests have further tries.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "figures of a test")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;
mod cia402;
mod drives;
mod franka;
mod franka_floor;
mod franka_trials;
mod kuka;
mod payloads;
mod robot_folder;
mod ur;
mod ur_controller;
mod watch;

use libtest_mimic::{Arguments, Trial};

/// A test and its name.
type Test = (&'static str, fn());

/// The driver of Franka arms.
const FRANKA: [Test; 7] = [
    (
        "franka::the_simulated_servo_is_stable",
        franka::the_simulated_servo_is_stable,
    ),
    (
        "franka::a_smooth_path_of_a_hundred_poses",
        franka::a_smooth_path_of_a_hundred_poses,
    ),
    ("franka::pick_and_place", franka::pick_and_place),
    ("franka::kills_and_restarts", franka::kills_and_restarts),
    ("franka::fast_to_the_ends", franka::fast_to_the_ends),
    ("franka::the_driver_conforms", franka::the_driver_conforms),
    (
        "franka::the_controller_is_told_the_payload",
        franka::the_controller_is_told_the_payload,
    ),
];

/// The same with stalls and kills at random moments, as often as the environment asks for.
const TRIALS: [Test; 2] = [
    ("franka::stalls_and_kills", franka_trials::stalls_and_kills),
    (
        "franka::cycles_that_any_client_misses",
        franka_floor::cycles_that_any_client_misses,
    ),
];

/// The driver of arms of Universal Robots, and the stand-in for their controller.
const UNIVERSAL: [Test; 9] = [
    (
        "motion::servoj_obeys_its_law",
        ur_controller::motion::servoj_obeys_its_law,
    ),
    ("ur::programs_at_500_hz", ur::programs_at_500_hz),
    ("ur::programs_at_125_hz", ur::programs_at_125_hz),
    (
        "ur::the_slider_slows_down_on_the_path",
        ur::the_slider_slows_down_on_the_path,
    ),
    (
        "ur::a_protective_stop_is_unlocked_by_the_next_run",
        ur::a_protective_stop_is_unlocked_by_the_next_run,
    ),
    (
        "ur::a_program_that_ends_is_started_again",
        ur::a_program_that_ends_is_started_again,
    ),
    (
        "ur::what_cannot_be_driven_is_refused_in_words",
        ur::what_cannot_be_driven_is_refused_in_words,
    ),
    ("ur::the_driver_conforms", ur::the_driver_conforms),
    (
        "ur::the_controller_is_told_the_payload",
        ur::the_controller_is_told_the_payload,
    ),
];

/// The stand-in, seen by a client of others.
const OUTSIDE: [Test; 1] = [(
    "ur::a_client_from_outside_reads_the_states",
    ur::a_client_from_outside_reads_the_states,
)];

/// The engine with the simulated driver.
const SIMULATED: [Test; 1] = [(
    "payloads::a_tool_change_tells_the_payload",
    payloads::a_tool_change_tells_the_payload,
)];

/// The driver of KUKA arms.
const RSI: [Test; 2] = [
    (
        "kuka::programs_and_a_pulled_cable",
        kuka::programs_and_a_pulled_cable,
    ),
    ("kuka::the_driver_conforms", kuka::the_driver_conforms),
];

/// The driver of CiA 402 drives.
const ETHERCAT: [Test; 9] = [
    (
        "cia402::the_doctor_measures_the_bus",
        cia402::the_doctor_measures_the_bus,
    ),
    (
        "cia402::programs_without_clocks",
        cia402::programs_without_clocks,
    ),
    (
        "cia402::programs_by_the_clock_of_the_drives",
        cia402::programs_by_the_clock_of_the_drives,
    ),
    (
        "cia402::a_drive_that_fails_stops_all",
        cia402::a_drive_that_fails_stops_all,
    ),
    (
        "cia402::a_slow_drive_is_named",
        cia402::a_slow_drive_is_named,
    ),
    (
        "cia402::a_cut_cable_is_mended",
        cia402::a_cut_cable_is_mended,
    ),
    (
        "cia402::the_watchdog_stops_the_drives",
        cia402::the_watchdog_stops_the_drives,
    ),
    (
        "cia402::what_does_not_fit_is_refused_in_words",
        cia402::what_does_not_fit_is_refused_in_words,
    ),
    ("cia402::the_driver_conforms", cia402::the_driver_conforms),
];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.first().is_some_and(|word| word == cia402::STAND_IN) {
        return drives::run(&words[1..]);
    }
    let mut arguments = Arguments::from_args();
    // The gripper of the controller has a fixed port.
    arguments.test_threads = Some(1);
    let mut trials = Vec::new();
    for (tests, missing) in [
        (&FRANKA[..], franka::missing()),
        (&TRIALS, franka::missing().or(franka_trials::unasked())),
        (&UNIVERSAL, None),
        (&SIMULATED, None),
        (&OUTSIDE, ur::missing()),
        (&RSI, kuka::missing()),
        (&ETHERCAT, cia402::missing()),
    ] {
        if let Some(reason) = &missing {
            eprintln!("ignored: {reason}");
        }
        trials.extend(tests.iter().map(|&(name, test)| {
            let run = move || {
                test();
                Ok(())
            };
            Trial::test(name, run).with_ignored_flag(missing.is_some())
        }));
    }
    libtest_mimic::run(&arguments, trials).exit();
}
