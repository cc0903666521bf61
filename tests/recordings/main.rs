//! Recordings of running arms: what is written can be read, judged, and executed again with equal
//! bits; a kill loses a second at most; a fault leaves the minute before it.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::canter::{Ran, canter, command};
use system_tests::signal;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(120);

const PROGRAM: &str = "examples/pick_and_place.canon";

/// An arm name that no other test uses.
fn arm(name: &str) -> String {
    format!("recordings{}/{name}", std::process::id())
}

/// A process that is killed when a test fails before its end.
struct Peer(Child);

impl Drop for Peer {
    fn drop(&mut self) {
        // It has ended, unless the test is failing.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An engine that serves, with more options; its standard error is read on.
fn engine(arm: &str, options: &[String]) -> Peer {
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
    Peer(child)
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
#[test]
fn a_recorded_run_is_judged_and_executed_again() {
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
#[test]
fn an_arm_is_recorded_from_outside() {
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
    let end = Instant::now() + PATIENCE;
    loop {
        let ran = canter(["status", "--json", "--arm", arm]);
        let now: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        if now["idle"] == true && now["queued"] == 0 {
            return;
        }
        assert!(Instant::now() < end, "{now}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The file that is being written is read after a kill, up to the last second or two.
#[test]
fn a_kill_loses_a_moment_at_most() {
    let folder = tempfile::tempdir().unwrap();
    for (number, life_ms) in [(0, 2300), (1, 3100)] {
        let file = folder.path().join(format!("killed{number}.mcap"));
        let record = format!("--record={}", file.display());
        let mut engine = engine(&arm(&format!("killed{number}")), &[record]);
        std::thread::sleep(Duration::from_millis(life_ms));
        engine.0.kill().unwrap();
        engine.0.wait().unwrap();
        let part = folder.path().join(format!("killed{number}.mcap.part"));
        let recorded = recorder::read(&part).unwrap();
        assert!(recorded.cut.is_some());
        let seconds = recorded.samples.len() as f64 * 1e-3;
        // A machine under load may have started late.
        assert!(seconds > 0.3, "{seconds} s of {life_ms} ms");
        let ran = canter(["record", "--recover", &part.display().to_string()]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let whole = recorder::read(&file).unwrap();
        assert_eq!(whole.cut, None);
        assert_eq!(whole.samples, recorded.samples);
    }
}

/// A fault writes the time before it to a file that its message names.
#[test]
fn a_fault_leaves_the_minute_before_it() {
    let arm = arm("fault");
    let folder = tempfile::tempdir().unwrap();
    let faults = format!("--faults={}", folder.path().display());
    let engine = engine(&arm, &[faults]);
    assert_eq!(canter(["send", PROGRAM, "--arm", &arm]).code, 0);
    std::thread::sleep(Duration::from_millis(1200));
    // Longer than the watchdog of engine and driver.
    signal::send(&engine.0, libc::SIGSTOP);
    std::thread::sleep(Duration::from_millis(600));
    signal::send(&engine.0, libc::SIGCONT);
    let end = Instant::now() + PATIENCE;
    let fault = loop {
        let ran = canter(["status", "--json", "--arm", &arm]);
        let now: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        if let Some(fault) = now["fault"]
            .as_str()
            .filter(|fault| fault.contains(".mcap"))
        {
            break fault.to_owned();
        }
        assert!(Instant::now() < end, "no fault with a file: {now}");
        std::thread::sleep(Duration::from_millis(50));
    };
    let named = fault.rsplit(' ').next().map(PathBuf::from).unwrap();
    assert!(named.starts_with(folder.path()), "{fault}");
    while !named.exists() {
        assert!(Instant::now() < end, "{} is not finished", named.display());
        std::thread::sleep(Duration::from_millis(50));
    }
    let recorded = recorder::read(&named).unwrap();
    assert_eq!(recorded.head.reason, "fault");
    assert_eq!(recorded.programs.len(), 1);
    assert!(recorded.samples.len() > 500, "{}", recorded.samples.len());
    assert!(
        recorded
            .notes
            .iter()
            .any(|note| note.json.contains("faulted"))
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The Python library reads the file, with equal counts and values.
#[test]
#[ignore = "needs Python with mcap and mcap-ros2-support: pip install mcap mcap-ros2-support"]
fn python_reads_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded_run(&file, "python");
    let script = "import sys, json\n\
        from mcap.reader import make_reader\n\
        from mcap_ros2.decoder import DecoderFactory\n\
        n = {}; s = 0.0\n\
        reader = make_reader(open(sys.argv[1], 'rb'), validate_crcs=True, \
        decoder_factories=[DecoderFactory()])\n\
        for schema, channel, message, ros in reader.iter_decoded_messages():\n    \
        n[channel.topic] = n.get(channel.topic, 0) + 1\n    \
        s += sum(ros.position) if channel.topic == '/canter/setpoint' else 0.0\n\
        print(json.dumps([n, s]))\n";
    let python = std::process::Command::new("python3")
        .args(["-c", script])
        .arg(&file)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&python.stderr);
    assert!(python.status.success(), "{text}");
    let found: serde_json::Value = serde_json::from_slice(&python.stdout).unwrap();
    let ours = recorder::read(&file).unwrap();
    let sum: f64 = ours
        .samples
        .iter()
        .map(|sample| sample.position[..6].iter().sum::<f64>())
        .sum();
    assert_eq!(found[0]["/canter/setpoint"], ours.samples.len());
    assert_eq!(found[0]["/canter/state"], ours.samples.len());
    assert_eq!(found[0]["/robot_description"], 1);
    assert!(
        (found[1].as_f64().unwrap() - sum).abs() < 1e-6,
        "{found} {sum}"
    );
}
