//! `canter driver`, `canter doctor` and `canter run --driver`, as real processes.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use system_tests::killed::Killed;

use crate::canter::{canter, command};

/// An arm name that no other test uses.
fn arm(name: &str) -> String {
    format!("drivers{}/{name}", std::process::id())
}

/// A driver in a separate process, ended when dropped.
struct Driver {
    _process: Killed,
}

impl Driver {
    fn start(words: &[&str]) -> Self {
        let child = command([&["driver"], words].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self {
            _process: Killed(child),
        }
    }
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn the_simulated_driver_passes_its_test() {
    let arm = arm("sim");
    let _driver = Driver::start(&["sim", "--robot", "ur5e", "--arm", &arm]);
    let ran = canter(["driver", "test", "--arm", &arm, "--json"]);
    let report = json(&ran.stdout);
    assert_eq!(ran.code, 0, "{report:#}");
    assert_eq!(
        (&report["driver"], &report["joints"]),
        (&"sim".into(), &6.into())
    );
    let clauses = report["clauses"].as_array().unwrap();
    assert!(clauses.len() >= 18);
    // It serves every period that the protocol has.
    let skipped = "a period beyond its longest is refused";
    assert!(
        clauses
            .iter()
            .all(|clause| clause["verdict"] == "pass" || clause["name"] == skipped),
        "{report:#}"
    );
    // The doctor opens a session with it too, and its limits allow those of the robot.
    let words = [
        "doctor",
        "--arm",
        &arm,
        "--robot",
        "ur5e",
        "--seconds",
        "0.2",
        "--json",
    ];
    let report = json(&canter(words).stdout);
    let health = |name: &str| {
        let checks = report["checks"].as_array().unwrap();
        let found = checks.iter().find(|check| check["name"] == name);
        found.map(|check| check["health"].clone())
    };
    assert_eq!(health("driver handshake"), Some("ok".into()), "{report:#}");
    assert_eq!(health("limits of robot and driver"), Some("ok".into()));
}

/// Waits until a joint of `arm` moves with more than 0.05 rad/s.
fn wait_for_motion(arm: &str) {
    let observer = ipc::Observer::open(&system_tests::domain::arm(arm)).unwrap();
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        if let Some(state) = observer.next_state() {
            let following = state.driver() == ipc::DriverState::Active;
            if following && state.velocity.iter().any(|speed| speed.abs() > 0.05) {
                return;
            }
        } else {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    panic!("{arm} does not move");
}

/// A driver that is told to end in motion, twice: it brakes, says so, and the engine names it.
fn ends_in_motion(mut driver: Command, name: &str, signal: i32) {
    let arm = arm(name);
    let driver = driver.arg(&arm).stderr(Stdio::piped()).spawn().unwrap();
    let program = "examples/pick_and_place.canon";
    let words = ["run", program, "-r", "ur5e", "--arm", &arm];
    let run = command([&words[..], &["--driver", "external"]].concat())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_motion(&arm);
    system_tests::signal::send(&driver, signal);
    std::thread::sleep(Duration::from_millis(20));
    system_tests::signal::send(&driver, signal);
    let driver = driver.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&driver.stderr).into_owned();
    assert!(driver.status.success(), "{}: {said}", driver.status);
    assert!(
        said.contains("braked to rest within the joint limits"),
        "{said}"
    );
    let run = run.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("the driver was told to end"), "{said}");
    assert!(!run.status.success(), "{said}");
}

#[test]
fn a_simulated_driver_that_ends_brakes_first() {
    for (name, signal) in [
        ("int", libc::SIGINT),
        ("term", libc::SIGTERM),
        ("hup", libc::SIGHUP),
    ] {
        let sim = command(["driver", "sim", "--robot", "ur5e", "--arm"]);
        ends_in_motion(sim, name, signal);
    }
}

/// The template in Python, where Python has iceoryx2.
#[test]
fn a_python_driver_that_ends_brakes_first() {
    if !python_has("iceoryx2") {
        return println!("ignored: python3 has no iceoryx2 (pip install iceoryx2==0.9.3)");
    }
    for (name, signal) in [("python-int", libc::SIGINT), ("python-hup", libc::SIGHUP)] {
        let mut python = Command::new("python3");
        system_tests::domain::join(&mut python);
        python.arg("-B");
        python.arg(system_tests::repository::root().join("drivers/python/template.py"));
        ends_in_motion(python, name, signal);
    }
}

/// The Python kit has the same properties as the Rust kit, in virtual time.
#[test]
fn the_python_kit_keeps_the_limits() {
    let laws = system_tests::repository::root().join("drivers/python/tests/laws.py");
    let ran = Command::new("python3").arg("-B").arg(laws).output();
    let ran = match ran {
        Err(error) => return println!("ignored: no python3 ({error})"),
        Ok(ran) => ran,
    };
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(ran.status.success(), "{said}");
}

/// Whether Python can import a package.
fn python_has(package: &str) -> bool {
    let status = Command::new("python3")
        .args(["-c", &format!("import {package}")])
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

#[test]
fn without_a_driver_nothing_is_tested() {
    let arm = arm("nobody");
    let ran = canter(["driver", "test", "--arm", &arm]);
    assert_eq!(ran.code, 4, "{ran:?}");
    assert!(ran.stderr.contains("no driver answered"), "{}", ran.stderr);
    let ran = canter(["doctor", "--arm", &arm, "--seconds", "0.2"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    let remedy = format!("-> canter driver sim --robot ROBOT --arm {arm}");
    assert!(ran.stdout.contains(&remedy), "{}", ran.stdout);
}

#[test]
fn mujoco_without_its_python_says_so() {
    let program = "examples/pick_and_place.canon";
    let arm = arm("no-python");
    let words = ["run", program, "-r", "ur5e", "--arm", &arm];
    let more = ["--driver", "mujoco", "--python", "/nonexistent/python"];
    let start = Instant::now();
    let ran = canter([&words[..], &more].concat());
    assert_eq!(ran.code, 4, "{ran:?}");
    assert!(
        ran.stderr.contains("cannot start /nonexistent/python"),
        "{}",
        ran.stderr
    );
    assert!(start.elapsed() < Duration::from_secs(60));
}

/// The samples of the README's program in lock-step, in `runs` runs with a driver.
fn samples_in_step(driver: &str, runs: usize) -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let run = |index: usize| {
        let name = format!("{driver}-in-step-{index}");
        let (path, arm) = (folder.path().join(&name), arm(&name));
        let program = "examples/pick_and_place.canon";
        let words = ["run", program, "-r", "ur5e", "--arm", &arm];
        let more = ["--driver", driver, "--lock-step", "--samples"];
        let ran = canter([&words[..], &more, &[path.to_str().unwrap()]].concat());
        assert_eq!(ran.code, 0, "{ran:?}");
        std::fs::read(path).unwrap()
    };
    (0..runs).map(run).collect()
}

/// The first line in which two runs differ, from both.
fn first_difference(runs: &[Vec<u8>]) -> Option<[String; 2]> {
    let lines = |run: &[u8]| String::from_utf8(run.to_vec()).unwrap();
    let first = lines(&runs[0]);
    runs[1..].iter().find(|run| **run != runs[0]).map(|other| {
        let other = lines(other);
        let end = std::iter::repeat("(end)");
        let mut pairs = first
            .lines()
            .chain(end.clone())
            .zip(other.lines().chain(end));
        let (one, two) = pairs.find(|(one, two)| one != two).unwrap();
        [one.to_owned(), two.to_owned()]
    })
}

/// As the README says: the same result every time, however fast the planner is.
#[test]
fn in_step_is_the_same_every_time() {
    let runs = samples_in_step("sim", 6);
    assert!(runs[0].len() > 100_000);
    assert_eq!(first_difference(&runs), None);
}

/// As the README says: a physics simulation executes the same program, twice with the same result.
#[test]
fn mujoco_in_step_is_the_same_every_time() {
    if !python_has("mujoco, iceoryx2") {
        println!("ignored: python3 has no mujoco or no iceoryx2");
        return;
    }
    let runs = samples_in_step("mujoco", 2);
    assert!(runs[0].len() > 100_000);
    assert_eq!(first_difference(&runs), None);
}
