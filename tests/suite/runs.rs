//! `canter run` and the commands around a running engine, as real processes.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::{canter, command};

/// An arm name that no other test uses.
fn arm(name: &str) -> String {
    format!("test{}/{name}", std::process::id())
}

/// Rows of a CSV: command, then the numbers of these columns.
fn columns(path: &std::path::Path, names: &[String]) -> Vec<(usize, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let wanted: Vec<usize> = names.iter().map(|name| at(name)).collect();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        (
            cells[at("command")] as usize,
            wanted.iter().map(|index| cells[*index]).collect(),
        )
    };
    lines.map(row).collect()
}

/// The README's first command: every command done, periods that add up, setpoints equal to those
/// of the dry run, the measured way near the published one.
#[test]
fn a_run_publishes_what_was_planned() {
    let folder = tempfile::tempdir().unwrap();
    let (planned, published) = (
        folder.path().join("plan.csv"),
        folder.path().join("run.csv"),
    );
    let program = "examples/pick_and_place.canon";
    let plan = canter([
        "plan",
        program,
        "-r",
        "ur5e",
        "--samples",
        planned.to_str().unwrap(),
    ]);
    assert_eq!(plan.code, 0, "{}", plan.stderr);
    let arm = arm("published");
    let samples = published.to_str().unwrap();
    let run = canter([
        "run",
        program,
        "-r",
        "ur5e",
        "--json",
        "--arm",
        &arm,
        "--samples",
        samples,
    ]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let notes: Vec<Value> = run
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let done = notes.iter().filter(|note| note["event"] == "done").count();
    let summary = notes.last().unwrap();
    assert_eq!((summary["event"].as_str(), done), (Some("summary"), 24));
    let cycles = &summary["cycles"];
    let count = |key: &str| cycles[key].as_u64().unwrap();
    assert_eq!(count("ticks"), count("published") + count("skipped"));
    assert!(summary["off_path_m"].as_f64().unwrap() < 2e-3, "{summary}");

    let joints: Vec<String> = (1..=6).map(|joint| format!("q{joint}")).collect();
    let planned = columns(&planned, &joints);
    let mut wanted = joints.clone();
    wanted.push("path_time_s".to_owned());
    let published = columns(&published, &wanted);
    let mut compared = 0;
    for command in 0..24 {
        let dry: Vec<_> = planned.iter().filter(|row| row.0 == command).collect();
        if dry.windows(2).all(|pair| pair[0].1 == pair[1].1) {
            continue; // nothing moves
        }
        let wet = published
            .iter()
            .filter(|row| row.0 == command && row.1[6] > 0.0);
        for wet in wet {
            // Late periods are left out, so rows are matched by the time on the path, in periods;
            // the dry run's first row of a command is one period after its start.
            let at = wet.1[6] / 0.001;
            let Some(dry) = dry.get((at.round() as usize).wrapping_sub(1)) else {
                continue;
            };
            if (at - at.round()).abs() > 1e-6 {
                continue; // between two rows of the dry run
            }
            for joint in 0..6 {
                let gap = (wet.1[joint] - dry.1[joint]).abs();
                assert!(
                    gap <= 1e-9,
                    "command {command} at {} s: {gap} rad",
                    wet.1[6]
                );
            }
            compared += 1;
        }
    }
    assert!(compared > 4000, "only {compared} setpoints were compared");
}

/// An engine as a process; killed when the test fails before its end.
struct Engine(Child);

impl Engine {
    fn start(arm: &str) -> Self {
        let mut child = command(["engine", "--robot", "ur5e", "--arm", arm])
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.contains("engine of ur5e"), "{line}");
        Self(child)
    }

    fn end(mut self) -> Option<i32> {
        self.0.wait().unwrap().code()
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        // It has ended, unless the test is failing.
        let _ = self.0.kill();
    }
}

fn status(arm: &str) -> Value {
    let ran = canter(["status", "--json", "--arm", arm]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).unwrap()
}

/// Waits until the status is as wanted.
fn wait_for(arm: &str, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        let now = status(arm);
        if wanted(&now) {
            return now;
        }
        assert!(
            Instant::now() < deadline,
            "{what} did not come about: {now}"
        );
    }
}

#[test]
fn an_engine_serves_clients() {
    let arm = arm("served");
    let engine = Engine::start(&arm);
    let second = canter(["engine", "--robot", "ur5e", "--arm", &arm]);
    assert_eq!(
        second.code, 4,
        "a second engine on the same arm: {}",
        second.stderr
    );

    let sent = canter([
        "send",
        "examples/inches_and_degrees.canon",
        "--no-wait",
        "--arm",
        &arm,
    ]);
    assert_eq!(sent.code, 0, "{}", sent.stderr);
    wait_for(&arm, "motion", |now| now["path_rate"].as_f64() > Some(0.5));
    assert_eq!(canter(["pause", "--arm", &arm]).code, 0);
    wait_for(&arm, "rest", |now| {
        now["held"] == true && now["path_rate"] == 0.0
    });
    assert_eq!(canter(["resume", "--arm", &arm]).code, 0);
    wait_for(&arm, "motion again", |now| {
        now["path_rate"].as_f64() > Some(0.5)
    });
    assert_eq!(canter(["override", "20", "--arm", &arm]).code, 0);
    assert_eq!(canter(["abort", "--arm", &arm]).code, 0);
    wait_for(&arm, "an empty queue", |now| now["idle"] == true);

    let bad = canter([
        "send",
        "tests/data/bad_inputs/unknown_unit.canon",
        "--arm",
        &arm,
    ]);
    assert!([1, 3].contains(&bad.code), "{}", bad.stderr);
    assert_eq!(canter(["shutdown", "--arm", &arm]).code, 0);
    assert_eq!(engine.end(), Some(0));
    let gone = canter(["status", "--arm", &arm]);
    assert_eq!((gone.code, gone.stdout.as_str()), (4, ""));
}

/// A jog lasts as long as its client asks; a second client is refused by name meanwhile, and when
/// the first is killed the arm stops by itself, on its way and without a fault.
#[test]
fn a_jog_needs_its_client_alive() {
    let arm = arm("jog");
    let engine = Engine::start(&arm);
    let joint = |now: &Value| now["joints"][0].as_f64().unwrap();
    let before = joint(&status(&arm));
    let ran = canter(["jog", "j1=0.1", "--seconds", "0.5", "--arm", &arm]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let now = wait_for(&arm, "rest", |now| now["idle"] == true);
    let moved = joint(&now) - before;
    // A tenth of 3.14 rad/s, for as long as the client lived and a little longer.
    assert!(moved > 0.02 && moved < 2.0, "{moved} rad");

    let mut first = command(["jog", "z=0.02", "--arm", &arm]).spawn().unwrap();
    wait_for(&arm, "a jog", |now| now["command"] == "jog");
    let second = canter(["jog", "z=-0.02", "--seconds", "0.1", "--arm", &arm]);
    assert_eq!(second.code, 1, "{}", second.stderr);
    let refusal = "commanded by \"canter jog\"";
    assert!(second.stderr.contains(refusal), "{}", second.stderr);
    first.kill().unwrap();
    first.wait().unwrap();
    let now = wait_for(&arm, "rest", |now| now["idle"] == true);
    assert!(now["fault"].is_null(), "{now}");

    // Out of reach, or of range, it says why and nothing moves.
    let ran = canter(["jog", "j7=0.1", "--arm", &arm]);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert_eq!(canter(["shutdown", "--arm", &arm]).code, 0);
    assert_eq!(engine.end(), Some(0));
}

#[test]
fn without_a_driver_nothing_starts() {
    let arm = arm("lonely");
    let program = "examples/pick_and_place.canon";
    let ran = canter([
        "run", program, "-r", "ur5e", "--driver", "external", "--arm", &arm,
    ]);
    assert_eq!((ran.code, ran.stdout.as_str()), (4, ""), "{}", ran.stderr);
    assert!(ran.stderr.contains("driver"), "{}", ran.stderr);
}
