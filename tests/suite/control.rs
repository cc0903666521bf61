//! Stopping the arm waits neither for the planner, nor for a reader of the output, nor for a note
//! that has passed.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::{canter, command};
use crate::status::{status, wait_for};
use system_tests::killed::Killed;
use system_tests::long_move::smooth_list;
use system_tests::pipe::full_pipe;
use system_tests::signal;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(120);

/// An arm name that no other test uses.
fn arm(name: &str) -> String {
    format!("control{}/{name}", std::process::id())
}

/// A process that is killed when a test fails before its end.
struct Peer(Killed);

impl Peer {
    /// Its exit code; none when it does not end within `limit`.
    fn code(&mut self, limit: Duration) -> Option<i32> {
        let end = Instant::now() + limit;
        while Instant::now() < end {
            if let Some(status) = self.0.try_wait().unwrap() {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        None
    }
}

fn engine(arm: &str, stdout: Stdio) -> Peer {
    let mut child = command(["engine", "--robot", "ur5e", "--arm", arm])
        .stderr(Stdio::piped())
        .stdout(stdout)
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.contains("engine of ur5e"), "{line}");
    // Read on, so that it has a reader for as long as it lives.
    std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
    Peer(Killed(child))
}

fn moves(now: &Value) -> bool {
    now["time_scaling"].as_f64() > Some(0.9)
}

/// A slow move of about a minute, and behind it a smooth path of `poses` poses.
fn slow_then_long(poses: usize) -> String {
    let mut text = "InitCanon()\nSetRelativeSpeed(100)\n\
        MoveTo({{400, -200, 400}, {0,0,-1}, {1,1,0}})\nSetAbsoluteSpeed(10)\n\
        MoveStraightTo({{400, 200, 400}, {0,0,-1}, {1,1,0}})\nSetRelativeSpeed(60)\n"
        .to_owned();
    text.push_str(&smooth_list(poses, 200.0));
    text.push_str("EndCanon(0)\n");
    text
}

/// While a list of 2000 poses is planned, a stop acts and its answer says that the arm rests.
#[test]
fn a_stop_does_not_wait_for_the_planner() {
    let arm = arm("planning");
    let _engine = engine(&arm, Stdio::null());
    let program = slow_then_long(2000);
    let sent = crate::canter::canter_reading(
        ["send", "-", "--no-wait", "--arm", &arm],
        program.as_bytes(),
    );
    assert_eq!(sent.code, 0, "{}", sent.stderr);
    wait_for(&arm, "the slow move", |now| {
        moves(now) && now["command"] == "MoveStraightTo"
    });
    for (word, again) in [("stop", "resume"), ("pause", "resume"), ("stop", "abort")] {
        let begun = Instant::now();
        let stopped = canter([word, "--arm", &arm]);
        let took = begun.elapsed();
        assert_eq!(stopped.code, 0, "{}", stopped.stderr);
        assert!(
            stopped.stdout.starts_with("at rest, held"),
            "{}",
            stopped.stdout
        );
        let now = status(&arm);
        assert_eq!(
            (&now["time_scaling"], &now["held"]),
            (&0.0.into(), &true.into())
        );
        // Far less than the planner or the move would take.
        assert!(took < Duration::from_secs(5), "{word} took {took:?}");
        assert_eq!(canter([again, "--arm", &arm]).code, 0);
        if again == "resume" {
            wait_for(&arm, "motion again", moves);
        }
    }
    // What is sent after the abort is executed, whatever is still being planned.
    let sent = crate::canter::canter_reading(
        ["send", "-", "--arm", &arm],
        b"InitCanon()\nMessage(\"after\")\nEndCanon(0)\n",
    );
    assert_eq!(sent.code, 0, "{}{}", sent.stdout, sent.stderr);
    assert!(sent.stdout.contains("after"), "{}", sent.stdout);
}

/// Ctrl-C ends a run while the planner works.
#[test]
fn ctrl_c_does_not_wait_for_the_planner() {
    let arm = arm("planning-run");
    let mut run = Peer(Killed(
        command([
            "run",
            "-",
            "-r",
            "ur5e",
            "--arm",
            &arm,
            "--on-refusal",
            "skip",
        ])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap(),
    ));
    let mut input = run.0.stdin.take().unwrap();
    input.write_all(slow_then_long(2000).as_bytes()).unwrap();
    drop(input);
    let deadline = Instant::now() + 5 * PATIENCE;
    while canter(["status", "--arm", &arm]).code != 0 {
        assert!(Instant::now() < deadline, "the run does not begin");
        std::thread::sleep(Duration::from_millis(50));
    }
    wait_for(&arm, "the slow move", |now| {
        moves(now) && now["command"] == "MoveStraightTo"
    });
    signal::send(&run.0, libc::SIGINT);
    assert_eq!(run.code(Duration::from_secs(8)), Some(5));
}

/// An engine whose output nobody reads stops, answers and ends as any other.
#[test]
fn output_that_nobody_reads_disables_no_stop() {
    for ending in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
        let arm = arm(&format!("unread{ending}"));
        let (_reader, writer) = full_pipe();
        let mut engine = engine(&arm, writer);
        let sent = canter([
            "send",
            "examples/pick_and_place.canon",
            "--no-wait",
            "--arm",
            &arm,
        ]);
        assert_eq!(sent.code, 0, "{}", sent.stderr);
        wait_for(&arm, "motion", moves);
        let stopped = canter(["stop", "--arm", &arm]);
        assert_eq!(stopped.code, 0, "{}", stopped.stderr);
        assert!(stopped.stdout.starts_with("at rest"), "{}", stopped.stdout);
        assert_eq!(canter(["resume", "--arm", &arm]).code, 0);
        wait_for(&arm, "motion again", moves);
        signal::send(&engine.0, ending);
        assert_eq!(engine.code(Duration::from_secs(15)), Some(5));
        assert_eq!(canter(["status", "--arm", &arm]).code, 4);
    }
}

/// A run whose output nobody reads runs to its end, prints how much was dropped, and does not exit
/// with 0; Ctrl-C stops it.
#[test]
fn a_run_that_nobody_reads_is_no_success() {
    let arm_name = arm("unread-run");
    let (_reader, writer) = full_pipe();
    let child = command(["run", "examples/pick_and_place.canon", "-r", "ur5e"])
        .args(["--arm", &arm_name])
        .stdout(writer)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let ran = child.wait_with_output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(8), "{words}");
    assert!(words.contains("lines dropped"), "{words}");

    let arm_name = arm("unread-interrupted");
    let (_reader, writer) = full_pipe();
    let mut run = Peer(Killed(
        command(["run", "examples/pick_and_place.canon", "-r", "ur5e"])
            .args(["--arm", &arm_name])
            .stdout(writer)
            .stderr(Stdio::null())
            .spawn()
            .unwrap(),
    ));
    let deadline = Instant::now() + PATIENCE;
    while canter(["status", "--arm", &arm_name]).code != 0 {
        assert!(Instant::now() < deadline, "the run does not begin");
    }
    wait_for(&arm_name, "motion", moves);
    signal::send(&run.0, libc::SIGINT);
    assert_eq!(run.code(Duration::from_secs(15)), Some(5));
}

/// `canter run P | head -1`: the program runs to its end, and the exit code is not 0.
#[test]
fn a_closed_output_is_no_success() {
    let arm = arm("closed");
    let mut child = command([
        "run",
        "examples/pick_and_place.canon",
        "-r",
        "ur5e",
        "--json",
    ])
    .args(["--arm", &arm])
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    let mut reader = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    reader.read_line(&mut line).unwrap();
    drop(reader);
    // It moves on although nobody reads.
    let mut words = String::new();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        let now = canter(["status", "--json", "--arm", &arm]);
        if let Ok(now) = serde_json::from_str::<Value>(&now.stdout) {
            most = most.max(now["cycles"]["published"].as_u64().unwrap());
        }
    }
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut words)
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(8), "{words}");
    assert!(words.contains("dropped"), "{words}");
    assert!(most > 5000, "only {most} periods");
}

/// An engine that was stopped ends with the first signal.
#[test]
fn a_stopped_engine_ends_at_the_first_signal() {
    let arm = arm("stopped");
    let mut engine = engine(&arm, Stdio::null());
    let sent = canter([
        "send",
        "examples/pick_and_place.canon",
        "--no-wait",
        "--arm",
        &arm,
    ]);
    assert_eq!(sent.code, 0, "{}", sent.stderr);
    wait_for(&arm, "motion", moves);
    assert_eq!(canter(["stop", "--arm", &arm]).code, 0);
    wait_for(&arm, "rest", |now| {
        now["held"] == true && now["time_scaling"] == 0.0
    });
    std::thread::sleep(Duration::from_millis(200));
    signal::send(&engine.0, libc::SIGTERM);
    assert_eq!(engine.code(Duration::from_secs(15)), Some(5));
}

/// A recovery without a fault is refused in a sentence, and the next pause drops nothing.
#[test]
fn a_recovery_without_a_fault_is_refused() {
    let arm = arm("recover");
    let _engine = engine(&arm, Stdio::null());
    let sent = canter([
        "send",
        "examples/pick_and_place.canon",
        "--no-wait",
        "--arm",
        &arm,
    ]);
    assert_eq!(sent.code, 0, "{}", sent.stderr);
    wait_for(&arm, "motion", moves);
    let refused = canter(["recover", "--arm", &arm]);
    assert_eq!(refused.code, 1, "{}", refused.stderr);
    assert!(refused.stderr.contains("no fault"), "{}", refused.stderr);
    assert_eq!(canter(["pause", "--arm", &arm]).code, 0);
    let now = wait_for(&arm, "rest", |now| {
        now["held"] == true && now["time_scaling"] == 0.0
    });
    std::thread::sleep(Duration::from_millis(300));
    let then = status(&arm);
    assert_eq!(
        (&then["queued"], &then["state"]),
        (&now["queued"], &now["state"])
    );
    assert!(then["command"].is_string(), "{then}");
    assert_eq!(canter(["resume", "--arm", &arm]).code, 0);
    wait_for(&arm, "the end of the program", |now| {
        now["idle"] == true && now["state"] == "ended"
    });
}
