//! Drivers that send wrong states, as real processes: the engine latches a fault and stops the arm;
//! its setpoints keep every limit. An engine and a driver that do not match report it.

use std::thread;
use std::time::Duration;

use crate::scene::{Scene, assert_within_limits, read};

/// A driver that fails in the middle of a move; returns the engine's fault.
fn goes_wrong(kind: &str, wanted: &[&str]) {
    let scene = Scene::new(kind);
    let _driver = scene.hostile(kind);
    let engine = scene.engine();
    let fault = engine.wait_for("Faulted");
    assert!(wanted.iter().any(|name| fault.contains(name)), "{fault}");
    thread::sleep(Duration::from_millis(1000));
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 500);
    let [position, velocity, _] = lines.last().unwrap().setpoint;
    assert!(
        velocity.iter().all(|speed| speed.abs() < 1e-9),
        "{velocity:?}"
    );
    // It latches: nothing moves afterwards.
    thread::sleep(Duration::from_millis(500));
    let later = read(&scene.log(0));
    assert!(later.len() > lines.len());
    assert_eq!(later.last().unwrap().setpoint[0], position);
}

#[test]
fn a_state_that_is_not_a_number() {
    goes_wrong("nan", &["BadState"]);
}

#[test]
fn a_state_out_of_range() {
    goes_wrong("range", &["BadState"]);
}

#[test]
fn random_bytes_as_states() {
    goes_wrong(
        "random",
        &["BadState", "DriverLost", "DriverFault", "Following"],
    );
}

#[test]
fn a_measured_position_that_jumps() {
    goes_wrong("jump", &["Following"]);
}

/// A driver that reads one setpoint in twenty: the oldest are overwritten, the engine does not
/// wait.
#[test]
fn a_slow_reader_holds_nobody_up() {
    let scene = Scene::new("slow");
    let _driver = scene.hostile("slow");
    let engine = scene.engine();
    engine.wait_for("Finished { command: 2");
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 50);
    let last = lines.last().unwrap();
    assert!(last.tick > 1500, "{}", last.tick);
}

/// A driver of another version: refused with both numbers, nothing moves.
#[test]
fn another_protocol_is_refused() {
    for (kind, words) in [
        ("old-answer", "protocol 7, expected 2"),
        ("old-refusal", "protocol 2, expected 7"),
    ] {
        let scene = Scene::new(kind);
        let _driver = scene.hostile(kind);
        let mut engine = scene.engine();
        let line = engine.wait_for("protocol");
        assert!(line.contains(words), "{line}");
        assert_eq!(engine.child.wait().unwrap().code(), Some(4));
        assert!(read(&scene.log(0)).is_empty());
    }
}
