//! The driver of arms of Universal Robots against a stand-in for their controller.

use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::canter::{Ran, canter, command};
use crate::robot_folder::{MASSES, with_masses};
use crate::ur_controller::Controller;
use crate::ur_controller::state::{PLAYING, Record, STOPPED, Setting, State};

const ROBOT: &str = "ur5e";
const PROGRAM: &str = "examples/pick_and_place.canon";

/// Why there is no client from outside, or nothing if there is one.
pub(crate) fn missing() -> Option<String> {
    let ran = Command::new(python())
        .args(["-c", "import rtde_receive"])
        .stderr(Stdio::null())
        .status();
    match ran {
        Ok(status) if status.success() => None,
        Ok(_) => Some(format!("{} has no ur_rtde==1.6.5", python())),
        Err(error) => Some(format!("no {}: {error}", python())),
    }
}

/// The Python that has the client.
fn python() -> String {
    std::env::var("CANTER_UR_PYTHON").unwrap_or("python3".to_owned())
}

/// Where the robot's folder has it at home (rad).
fn home() -> [f64; 6] {
    let robot = planner::robot::load(ROBOT).unwrap();
    robot.home.try_into().unwrap()
}

/// A driver of one controller, ended when dropped.
struct Cell {
    controller: Controller,
    arm: String,
    driver: Child,
}

impl Cell {
    fn start(name: &str, setting: Setting) -> Self {
        let controller = Controller::start(setting);
        let arm = format!("ur{}/{name}", std::process::id());
        let words = [
            "driver",
            "ur",
            "--robot",
            ROBOT,
            "--arm",
            &arm,
            "--port",
            "0",
            "--gripper-output",
            "3",
            "--address",
            &controller.address,
        ];
        let driver = command(words).stdout(Stdio::null()).spawn().unwrap();
        Self {
            controller,
            arm,
            driver,
        }
    }

    fn words(&self) -> [&str; 8] {
        [
            "run", PROGRAM, "--robot", ROBOT, "--driver", "external", "--arm", &self.arm,
        ]
    }

    fn run(&self) -> Ran {
        canter(self.words())
    }

    /// A run that goes on until it ends by itself; the arm moves.
    fn begin(&self) -> Child {
        let mut command = command(self.words());
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = child.spawn().unwrap();
        self.controller.wait("the arm moves", |state| {
            state.motion.qd.iter().any(|speed| speed.abs() > 0.1)
        });
        child
    }

    fn records(&self) -> Vec<Record> {
        std::mem::take(&mut self.controller.state().records)
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// How many runs the environment asks for; one without.
fn runs() -> usize {
    let text = std::env::var("CANTER_UR_RUNS").unwrap_or_default();
    text.parse().unwrap_or(1)
}

/// A robot that is switched off gets ready, follows programs, and its gripper closes and opens.
fn programs(name: &str, setting: Setting) {
    let cell = Cell::start(name, setting);
    for number in 0..runs() {
        let ran = cell.run();
        let said = cell.controller.state().said.clone();
        assert_eq!(ran.code, 0, "run {number}: {ran:?}\n{said:?}");
        cell.controller
            .wait("the program ends", |state: &State| state.runtime == STOPPED);
    }
    let records = cell.records();
    let servos = cell.controller.state().servos;
    let (most, around) = hardest(&records);
    println!("{servos} calls of servoj, largest acceleration {most:.2} rad/s2");
    assert!(most < 12.0, "{most} rad/s2 where 5 were planned\n{around}");
    // It was opened last.
    assert_eq!(cell.controller.state().outputs, 0);
}

/// The largest acceleration of a joint (rad/s²), and the cycles around it.
fn hardest(records: &[Record]) -> (f64, String) {
    let mut found = (0.0, 0, 0);
    for (place, record) in records.iter().enumerate() {
        for (joint, value) in record.qdd.iter().enumerate() {
            if value.abs() > found.0 {
                found = (value.abs(), place, joint);
            }
        }
    }
    let (most, place, joint) = found;
    let mut text = String::from("time, setpoints, target, acceleration\n");
    for record in &records[place.saturating_sub(12)..records.len().min(place + 4)] {
        let (target, qdd) = (record.target[joint], record.qdd[joint]);
        let line = format!(
            "{:.3} {} {target:.6} {qdd:.2}\n",
            record.time, record.setpoints
        );
        text.push_str(&line);
    }
    (most, text)
}

/// e-Series, 500 Hz.
pub(crate) fn programs_at_500_hz() {
    programs("e", Setting::e_series(home()));
}

/// CB3, 125 Hz.
pub(crate) fn programs_at_125_hz() {
    programs("cb3", Setting::cb3(home()));
}

/// Where the joints went, without the time: places that are a milliradian apart (rad).
fn way(records: &[Record]) -> Vec<[f64; 6]> {
    let mut way: Vec<[f64; 6]> = Vec::new();
    for record in records {
        if way
            .last()
            .is_none_or(|last| far(last, &record.actual) > 1e-3)
        {
            way.push(record.actual);
        }
    }
    way
}

/// The largest difference of a joint (rad).
fn far(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The largest distance of a place of one way from another way, which goes the same way (rad).
fn apart(one: &[[f64; 6]], other: &[[f64; 6]]) -> f64 {
    let mut from: usize = 0;
    one.iter().fold(0.0, |worst: f64, at| {
        let near = other[from..].iter().take(60).enumerate();
        let distances = near.map(|(place, there)| (far(at, there), place));
        let (distance, place) =
            distances.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
        from += place;
        worst.max(distance)
    })
}

/// The slider on the pendant goes to 30 % in the middle: the arm stays on its way, and takes longer.
pub(crate) fn the_slider_slows_down_on_the_path() {
    let cell = Cell::start("slider", Setting::e_series(home()));
    // The first run begins at home, the others where the program ends.
    for _ in 0..2 {
        cell.records();
        let ran = cell.run();
        assert_eq!(ran.code, 0, "{ran:?}");
    }
    let full = cell.records();
    let child = cell.begin();
    cell.controller.state().slider = 0.3;
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let slow = cell.records();
    let lasted = |records: &[Record]| records[records.len() - 1].time - records[0].time;
    let (short, long) = (lasted(&full), lasted(&slow));
    let worst = apart(&way(&slow), &way(&full));
    println!("{short:.2} s, {long:.2} s at 30 %, apart by {worst:.4} rad");
    assert!(long > 1.5 * short, "{long} s, {short} s at full speed");
    assert!(worst < 0.05, "{worst} rad from the way at full speed");
}

/// A protective stop in the middle: the run says so with the controller's number, and the next run
/// unlocks it.
pub(crate) fn a_protective_stop_is_unlocked_by_the_next_run() {
    let cell = Cell::start("protective", Setting::e_series(home()));
    let child = cell.begin();
    {
        let mut state = cell.controller.state();
        state.alarm(204, 3, "Path sanity check failed");
        state.protective_stop();
    }
    let output = child.wait_with_output().unwrap();
    let words = said(&output);
    assert_eq!(output.status.code(), Some(7), "{words}");
    assert!(words.contains("C204A3"), "{words}");
    assert!(words.contains("protective stop"), "{words}");
    let ran = cell.run();
    assert_eq!(ran.code, 0, "after the protective stop: {ran:?}");
}

/// The program is stopped on the pendant, and the driver is killed: the arm rests, and the next run
/// works.
pub(crate) fn a_program_that_ends_is_started_again() {
    let mut cell = Cell::start("pendant", Setting::e_series(home()));
    let child = cell.begin();
    cell.controller.press_stop();
    let output = child.wait_with_output().unwrap();
    let words = said(&output);
    assert_eq!(output.status.code(), Some(7), "{words}");
    assert!(words.contains("stopped on the pendant"), "{words}");
    let child = cell.begin();
    cell.driver.kill().unwrap();
    cell.driver.wait().unwrap();
    // The program on the robot stops the arm by itself.
    cell.controller
        .wait("the program ends", |state| state.runtime == STOPPED);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", said(&output));
    let rests = |state: &State| state.motion.qd.iter().all(|speed| *speed == 0.0);
    cell.controller.wait("the arm rests", rests);
    let texts = cell.controller.state().said.clone();
    assert!(!texts.iter().any(|text| text.contains("line")), "{texts:?}");
}

/// Software that is too old, local control, and another program: each is refused in words.
pub(crate) fn what_cannot_be_driven_is_refused_in_words() {
    let refused = |name: &str, setting: Setting, words: &str| {
        let cell = Cell::start(name, setting);
        // The driver says so as soon as it has looked.
        let start = Instant::now();
        loop {
            let ran = cell.run();
            assert_eq!(ran.code, 4, "{ran:?}");
            if ran.stderr.contains(words) {
                return;
            }
            assert!(start.elapsed() < Duration::from_secs(20), "{ran:?}");
        }
    };
    let good = Setting::e_series(home());
    refused(
        "old",
        Setting {
            version: [3, 2, 19171, 0],
            ..Setting::cb3(home())
        },
        "expected 3.7 or newer",
    );
    refused(
        "local",
        Setting {
            remote: false,
            ..good.clone()
        },
        "switch to remote control",
    );
    let cell = Cell::start("other", good);
    cell.controller.state().robot_mode = 7;
    cell.controller.state().runtime = PLAYING;
    let ran = cell.run();
    assert_eq!(ran.code, 4, "{ran:?}");
    assert!(ran.stderr.contains("another program"), "{ran:?}");
}

/// The robot's folder has masses: the controller is told that of the mounted end effector.
pub(crate) fn the_controller_is_told_the_payload() {
    let cell = Cell::start("payload", Setting::e_series(home()));
    let folder = with_masses(ROBOT);
    let mut words = cell.words();
    words[3] = folder.path().to_str().unwrap();
    let ran = canter(words);
    assert_eq!(ran.code, 0, "{ran:?}");
    assert_eq!(cell.controller.state().payload, MASSES[0]);
}

/// `canter driver test` on it: nothing fails.
pub(crate) fn the_driver_conforms() {
    let cell = Cell::start("conforms", Setting::e_series(home()));
    let ran = canter(["driver", "test", "--arm", &cell.arm]);
    println!("{}", ran.stdout);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
}

/// A client that others wrote reads the states of the stand-in: 500 a second, and the joints move.
pub(crate) fn a_client_from_outside_reads_the_states() {
    let cell = Cell::start("outside", Setting::e_series(home()));
    let child = cell.begin();
    let script = system_tests::repository::root().join("tests/controllers/ur_client.py");
    let read = Command::new(python())
        .arg(script)
        .arg(&cell.controller.address)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&read.stdout).into_owned();
    assert!(read.status.success(), "{words}{}", said(&read));
    println!("{}", words.trim());
    let numbers: Vec<f64> = words
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    let [a_second, moved] = numbers[..] else {
        panic!("{words}");
    };
    assert!(
        (a_second - 500.0).abs() < 25.0,
        "{a_second} states a second"
    );
    assert!(moved > 0.05, "{moved} rad");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    sleep(Duration::from_millis(1));
}
