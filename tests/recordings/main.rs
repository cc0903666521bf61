//! Recordings of running arms: what is written can be read, judged, and executed again with equal
//! bits; a kill loses a second at most; a fault leaves the minute before it.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;
mod faults;
mod kills;
mod readers;
mod replays;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::canter::{Ran, canter, command};

use libtest_mimic::{Arguments, Trial};
use system_tests::killed::Killed;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(120);

const PROGRAM: &str = "examples/pick_and_place.canon";

/// An arm name that no other test uses.
fn arm(name: &str) -> String {
    format!("recordings{}/{name}", std::process::id())
}

/// An engine that serves, with more options; its standard error is read on.
fn engine(arm: &str, options: &[String]) -> Killed {
    let mut child = command(["engine", "--robot", "ur5e", "--arm", arm])
        .args(options)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.contains("engine of ur5e"), "{line}");
    std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
    Killed(child)
}

/// Gives a program to an engine and looks on while it runs.
fn send(arm: &str, program: &str) -> Killed {
    let child = command(["send", program, "--arm", arm])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    Killed(child)
}

fn recorded_run(file: &Path, name: &str) -> Ran {
    let record = format!("--record={}", file.display());
    let ran = canter([
        "run",
        PROGRAM,
        "--robot",
        "ur5e",
        "--lock-step",
        "--arm",
        &arm(name),
        &record,
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stderr.contains("periods recorded in"), "{}", ran.stderr);
    ran
}

/// A recorded run is judged like its CSV, and executed again with equal bits; one changed number is
/// found, with command, time and joint.
pub(crate) fn a_recorded_run_is_judged_and_executed_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded_run(&file, "judged");
    let shown = file.display().to_string();
    let ran = canter(["verify", &shown]);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
    let ran = canter(["replay", "--check", &shown]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("are equal bit by bit"),
        "{}",
        ran.stderr
    );

    let recorded = recorder::read(&file).unwrap();
    assert!(
        recorded
            .periods
            .is_none_or(|periods| periods.unrecorded == 0)
    );
    let ticks = recorded.samples.windows(2);
    assert!(
        ticks.clone().all(|pair| pair[1].tick == pair[0].tick + 1),
        "a period is missing"
    );
    let changed = folder.path().join("changed.mcap");
    let mut writer =
        recorder::Writer::create(&changed, recorded.head.clone(), recorder::Rotation::NEVER)
            .unwrap();
    writer
        .latch(recorder::topic::PROGRAM_TOPIC, recorded.programs[0].clone())
        .unwrap();
    let moving = recorded
        .samples
        .iter()
        .position(|sample| sample.velocity[2] != 0.0)
        .unwrap();
    for (index, sample) in recorded.samples.iter().enumerate() {
        let mut sample = *sample;
        if index == moving + 700 {
            sample.position[2] = f64::from_bits(sample.position[2].to_bits() ^ 1);
        }
        writer.put(&sample).unwrap();
    }
    writer.close().unwrap();
    let ran = canter(["replay", "--check", &changed.display().to_string()]);
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("position of joint 3: recorded"),
        "{}",
        ran.stderr
    );
}

/// A recording that looks on from outside has the run, and ends with its engine.
pub(crate) fn an_arm_is_recorded_from_outside() {
    let arm = arm("outside");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("outside.mcap");
    let _engine = engine(&arm, &[]);
    let mut recording = command(["record", "--arm", &arm, "--out"])
        .arg(&file)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(recording.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.contains("recording"), "{line}");
    std::thread::sleep(Duration::from_millis(700));
    let ran = canter(["send", PROGRAM, "--arm", &arm]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    wait_until_idle(&arm);
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(canter(["shutdown", "--arm", &arm]).code, 0);
    let end = Instant::now() + PATIENCE;
    while recording.try_wait().unwrap().is_none() {
        assert!(
            Instant::now() < end,
            "the recording goes on without an engine"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let recorded = recorder::read(&file).unwrap();
    assert_eq!(recorded.cut, None);
    assert_eq!(recorded.programs.len(), 1);
    let done = |note: &recorder::RecordedNote| note.json.contains("EndCanon");
    assert!(recorded.notes.iter().any(done), "{:?}", recorded.notes);
    let moved = recorded
        .samples
        .iter()
        .any(|sample| sample.velocity[0].abs() > 0.1);
    assert!(moved && recorded.samples.len() > 1000);
}

fn wait_until_idle(arm: &str) {
    wait_for(arm, |now| now["idle"] == true && now["queued"] == 0);
}

/// Waits until the status of an arm is as wanted.
fn wait_for(arm: &str, wanted: impl Fn(&serde_json::Value) -> bool) {
    let end = Instant::now() + PATIENCE;
    loop {
        let ran = canter(["status", "--json", "--arm", arm]);
        let now: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        if wanted(&now) {
            return;
        }
        assert!(Instant::now() < end, "{now}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

macro_rules! trials {
    ($($test:path),* $(,)?) => {
        vec![$((stringify!($test), $test as fn())),*]
    };
}

/// Whether a program runs these words without an error.
fn runs(program: &str, words: [&str; 2]) -> bool {
    let ran = std::process::Command::new(program).args(words).output();
    ran.is_ok_and(|ran| ran.status.success())
}

fn main() {
    let always: Vec<(&str, fn())> = trials! {
        a_recorded_run_is_judged_and_executed_again,
        an_arm_is_recorded_from_outside,
        kills::a_kill_loses_a_moment_at_most,
        kills::a_busy_planner_keeps_nothing_back,
        faults::a_fault_leaves_the_minute_before_it,
    };
    // Minutes each: --run-ignored (nextest) or --ignored runs them.
    let long: Vec<(&str, fn())> = trials! {
        kills::fifty_kills_lose_a_moment_each,
        faults::twenty_faults_leave_the_minute_before_them,
        replays::twenty_recordings_are_executed_again,
    };
    let python = runs("python3", ["-c", "import mcap, mcap_ros2"]);
    let node = runs(
        "node",
        ["-e", "require('@mcap/core'); require('@mcap/support')"],
    );
    if !python {
        eprintln!("Python has no mcap: pip install mcap mcap-ros2-support");
    }
    if !node {
        eprintln!("node has no @mcap/core: npm install @mcap/core @mcap/support, and NODE_PATH");
    }
    let trial = |(name, test): (&str, fn()), ignored: bool| {
        Trial::test(name, move || {
            test();
            Ok(())
        })
        .with_ignored_flag(ignored)
    };
    let mut trials: Vec<Trial> = always
        .into_iter()
        .map(|found| trial(found, false))
        .collect();
    trials.extend(long.into_iter().map(|found| trial(found, true)));
    trials.push(trial(
        ("python_reads_the_file", readers::python_reads_the_file),
        !python,
    ));
    trials.push(trial(
        ("node_reads_the_file", readers::node_reads_the_file),
        !node,
    ));
    let mut arguments = Arguments::from_args();
    // Each has an engine by the clock: side by side they would take each other's time.
    arguments.test_threads = Some(1);
    libtest_mimic::run(&arguments, trials).exit();
}
