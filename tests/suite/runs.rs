//! `canter run` and the commands around a running engine, as real processes.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::canter::{canter, command};
use crate::status::{status, wait_for};
use system_tests::killed::Killed;
use system_tests::signal;

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

/// Compares the published setpoints of a run (CSV) with those of the dry run, for this many
/// commands; returns how many were compared.
pub(crate) fn same_setpoints(
    planned: &std::path::Path,
    published: &std::path::Path,
    commands: usize,
) -> usize {
    let joints: Vec<String> = (1..=6).map(|joint| format!("q{joint}")).collect();
    let planned = columns(planned, &joints);
    let mut wanted = joints.clone();
    wanted.push("path_time_s".to_owned());
    let published = columns(published, &wanted);
    let mut compared = 0;
    for command in 0..commands {
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
    compared
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
    // In a period that is late on either side the driver goes on while the plan waits, or the plan while
    // the driver waits: 0.6 m/s at most, there and back.
    let late = count("skipped") + count("driver_missed");
    let ahead = late as f64 * 1e-3 * 0.6 * 2.0;
    let off_path = summary["off_path_m"].as_f64().unwrap();
    assert!(off_path < 2e-3 + ahead, "{summary}");

    let compared = same_setpoints(&planned, &published, 24);
    assert!(compared > 4000, "only {compared} setpoints were compared");
    measured_way(&folder.path().join("run.csv"), program, off_path);
}

/// The measured path keeps the tolerances of the program: 10 mm at the intermediate poses, in their
/// order, and 0.5 mm at the end of each move. The plan uses a tolerance whole: `off_path` (m), the
/// arm's greatest distance from its setpoint, comes on top while it moves.
fn measured_way(samples: &std::path::Path, program: &str, off_path: f64) {
    let axes = ["x", "y", "z"].map(|axis| format!("measured_{axis}_m"));
    let rows = columns(samples, &axes);
    let text = std::fs::read_to_string(system_tests::repository::root().join(program)).unwrap();
    let reading = crcl::text::read(&text, &crcl::ReadOptions::default());
    let mut passed = 0;
    let moves: Vec<(usize, &[crcl::Pose])> = (reading.program.iter().enumerate())
        .filter_map(|(index, command)| match command {
            crcl::Command::MoveTo { pose } | crcl::Command::MoveStraightTo { pose } => {
                Some((index, std::slice::from_ref(pose)))
            }
            crcl::Command::MoveSmoothlyTo { poses } => Some((index, poses.as_slice())),
            _ => None,
        })
        .collect();
    for (number, (index, poses)) in moves.iter().enumerate() {
        // The arm is behind its setpoints, more so after a late period: what follows a move, up to the
        // next one's end, shows where it came to rest.
        let last = moves.get(number + 1).map_or(usize::MAX, |next| next.0);
        let rows = rows.iter().filter(|row| (*index..=last).contains(&row.0));
        let mut rows = rows.peekable();
        for (number, pose) in poses.iter().enumerate() {
            let crcl::Pose::Axes { point, .. } = pose else {
                panic!("the example has poses by axes")
            };
            let tolerance = if number + 1 == poses.len() {
                5e-4
            } else {
                1e-2 + off_path
            };
            let distance = |at: &[f64]| {
                let squares = at
                    .iter()
                    .zip(point)
                    .map(|(at, mm)| (at - mm * 1e-3).powi(2));
                squares.sum::<f64>().sqrt()
            };
            let mut least = f64::INFINITY;
            let found = rows.by_ref().any(|row| {
                least = least.min(distance(&row.1));
                least <= tolerance
            });
            assert!(
                found,
                "command {index} passes pose {number} in {least} m, not in {tolerance} m"
            );
            passed += 1;
        }
    }
    assert_eq!(passed, 8);
}

/// Starts a run of the example, with its answers line by line, and waits until `command` of it is
/// done.
fn started(
    arguments: &[&str],
    command_done: usize,
) -> (Child, std::io::Lines<BufReader<ChildStdout>>) {
    let mut child = command(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut done = 0;
    while done < command_done {
        let line = lines.next().expect("the run ended early").unwrap();
        done += usize::from(line.contains("\"done\""));
    }
    (child, lines)
}

const EXAMPLE: &str = "examples/pick_and_place.canon";

/// Setpoints of the last rows of a recording.
fn last_rest(samples: &std::path::Path) -> f64 {
    let names: Vec<String> = (1..=6).map(|joint| format!("dq{joint}")).collect();
    let rows = columns(samples, &names);
    let (_, last) = rows.last().unwrap();
    last.iter().map(|speed| speed.abs()).fold(0.0, f64::max)
}

#[test]
fn ctrl_c_stops_on_the_path_and_cleans_up() {
    for presses in [1, 2] {
        let arm = arm(&format!("interrupted{presses}"));
        let folder = tempfile::tempdir().unwrap();
        let samples = folder.path().join("run.csv");
        let text = samples.to_str().unwrap();
        let (mut child, lines) = started(
            &[
                "run",
                EXAMPLE,
                "-r",
                "ur5e",
                "--json",
                "--arm",
                &arm,
                "--samples",
                text,
            ],
            12,
        );
        for _ in 0..presses {
            std::thread::sleep(Duration::from_millis(150));
            signal::send(&child, libc::SIGINT);
        }
        assert_eq!(child.wait().unwrap().code(), Some(5), "{presses} times");
        let answers: Vec<String> = lines.map(Result::unwrap).collect();
        let summary: Value = serde_json::from_str(answers.last().unwrap()).unwrap();
        assert_eq!(summary["exit"], 5);
        assert!(summary["done"].as_u64().unwrap() < 24, "{summary}");
        assert!(last_rest(&samples) < 1e-6, "the last setpoint still moves");
        // Engine and driver are gone.
        assert_eq!(canter(["status", "--arm", &arm]).code, 4);
        let alone = canter([
            "engine", "-r", "ur5e", "--driver", "external", "--arm", &arm,
        ]);
        assert_eq!(alone.code, 4, "{}", alone.stderr);
    }
}

/// A separate driver for an arm; killed when the test fails before its end.
fn driver(arm: &str, options: &[&str]) -> Engine {
    let arguments = ["driver", "sim", "-r", "ur5e", "--arm", arm];
    let child = command(arguments.iter().chain(options))
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    Engine(Killed(child))
}

#[test]
fn an_arm_that_does_not_follow_is_stopped_by_the_guard() {
    let arm = arm("sluggish");
    let _driver = driver(&arm, &["--delay", "150"]);
    let ran = canter([
        "run", EXAMPLE, "-r", "ur5e", "--driver", "external", "--arm", &arm,
    ]);
    assert_eq!(ran.code, 6, "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stderr.contains("following error"), "{}", ran.stderr);
}

#[test]
fn a_driver_that_dies_is_told() {
    let arm = arm("dying");
    let mut driver = driver(&arm, &[]);
    let (mut child, lines) = started(
        &[
            "run", EXAMPLE, "-r", "ur5e", "--driver", "external", "--json", "--arm", &arm,
        ],
        12,
    );
    std::thread::sleep(Duration::from_millis(100));
    driver.0.kill().unwrap();
    driver.0.wait().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(7));
    let answers: Vec<String> = lines.map(Result::unwrap).collect();
    assert!(
        answers.iter().any(|line| line.contains("\"faulted\"")),
        "{answers:?}"
    );
}

/// A program that cannot be executed from the position of an external arm moves nothing.
#[test]
fn an_external_arm_is_asked_where_it_stands() {
    let arm = arm("elsewhere");
    let _driver = driver(&arm, &[]);
    let program = "InitCanon()\nMoveTo({{400, -100, 300}, {0,0,-1}, {1,0,0}})\n\
        MoveTo({{4000, -100, 300}, {0,0,-1}, {1,0,0}})\nEndCanon(0)\n";
    let run = [
        "run", "-", "-r", "ur5e", "--driver", "external", "--arm", &arm,
    ];
    let ran = crate::canter::canter_reading(run, program.as_bytes());
    assert_eq!(ran.code, 1, "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stderr.contains("out of reach"), "{}", ran.stderr);
    assert!(!ran.stdout.contains("MoveTo"), "{}", ran.stdout);
    let mut skip = run.to_vec();
    skip.extend(["--on-refusal", "skip"]);
    let ran = crate::canter::canter_reading(skip, program.as_bytes());
    assert_eq!(ran.code, 1, "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout.contains("3 of 4 commands done"),
        "{}",
        ran.stdout
    );
}

/// An engine as a process; killed when the test fails before its end.
struct Engine(Killed);

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
        Self(Killed(child))
    }

    fn end(mut self) -> Option<i32> {
        self.0.wait().unwrap().code()
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
    wait_for(&arm, "motion", |now| {
        now["time_scaling"].as_f64() > Some(0.5)
    });
    assert_eq!(canter(["pause", "--arm", &arm]).code, 0);
    wait_for(&arm, "rest", |now| {
        now["held"] == true && now["time_scaling"] == 0.0
    });
    assert_eq!(canter(["resume", "--arm", &arm]).code, 0);
    wait_for(&arm, "motion again", |now| {
        now["time_scaling"].as_f64() > Some(0.5)
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
    // A tenth of 3.14 rad/s, for as long as the client lived and a little longer.
    let now = wait_for(&arm, "rest after a move", |now| {
        now["idle"] == true && joint(now) - before > 0.02
    });
    let moved = joint(&now) - before;
    assert!(moved < 2.0, "{moved} rad");

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

/// An arm that has a driver gets no second one, and the first is left alone.
#[test]
fn an_arm_that_is_taken_is_left_alone() {
    let arm = arm("taken");
    let mut other = driver(&arm, &[]);
    std::thread::sleep(Duration::from_millis(500));
    let ran = canter(["run", EXAMPLE, "-r", "ur5e", "--arm", &arm]);
    assert_eq!((ran.code, ran.stdout.as_str()), (4, ""), "{}", ran.stderr);
    assert!(ran.stderr.contains("already taken"), "{}", ran.stderr);
    assert_eq!(other.0.try_wait().unwrap(), None);
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
