//! A joint trajectory with times of others, given to a running engine.

use serde_json::{Value, json};
use system_tests::peer::Peer;
use system_tests::repository::root;

use crate::canter::{Ran, canter};
use crate::status::status;

/// The trajectory of the documentation.
fn documented() -> Value {
    let text = std::fs::read_to_string(root().join("docs/ros2.md")).unwrap();
    let (_, rest) = text.split_once("```json\n").unwrap();
    let (block, _) = rest.split_once("```").unwrap();
    serde_json::from_str(block).unwrap()
}

fn engine(arm: &str) -> Peer {
    let words = ["engine", "--robot", "ur5e", "--arm", arm];
    let peer = Peer::start(env!("CARGO_BIN_EXE_canter-under-test"), &words);
    peer.wait_for("engine of ur5e");
    peer
}

/// Gives a trajectory to the engine of an arm.
fn follow(arm: &str, trajectory: &Value, options: &[&str]) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("trajectory.json");
    std::fs::write(&file, trajectory.to_string()).unwrap();
    let file = file.to_str().unwrap();
    canter([&["follow", file, "--arm", arm], options].concat())
}

/// The last event.
fn last(ran: &Ran) -> Value {
    serde_json::from_str(ran.stdout.lines().last().unwrap()).unwrap()
}

fn joints(arm: &str) -> Vec<f64> {
    let found = &status(arm)["setpoint"];
    let found = found.as_array().unwrap();
    found.iter().map(|joint| joint.as_f64().unwrap()).collect()
}

/// The trajectory of the documentation is executed in its time, without InitCanon; the same again is
/// refused, because the arm stands elsewhere, and moves nothing; a program runs afterwards.
#[test]
fn a_trajectory_is_followed_or_refused() {
    let arm = format!("follow{}/arm", std::process::id());
    let _engine = engine(&arm);
    let names = &status(&arm)["joint_names"];
    let trajectory = documented();
    assert_eq!(names, &trajectory["joints"]);
    let ran = follow(&arm, &trajectory, &[]);
    assert_eq!(ran.code, 0, "{} {}", ran.stdout, ran.stderr);
    let done = last(&ran);
    assert_eq!(done["name"], "FollowJointTrajectory", "{done}");
    let ticks = done["ticks"].as_u64().unwrap();
    assert!((1990..=2300).contains(&ticks), "{ticks} ticks");
    let end = joints(&arm);
    let planned = trajectory["points"][2]["positions"].as_array().unwrap();
    for (joint, planned) in end.iter().zip(planned) {
        assert!((joint - planned.as_f64().unwrap()).abs() < 1e-9, "{end:?}");
    }

    let again = follow(&arm, &trajectory, &[]);
    assert_eq!(again.code, 1, "{} {}", again.stdout, again.stderr);
    let why = last(&again)["error"]["message"].to_string();
    assert!(
        why.contains("joint_1") && why.contains("where the arm stands"),
        "{why}"
    );
    assert_eq!(joints(&arm), end, "it moved");

    let mut back = trajectory;
    for (point, angle) in back["points"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .zip([0.2, 0.1, 0.0])
    {
        point["positions"][0] = json!(angle);
        point["velocities"] = json!([]);
    }
    let corner = follow(&arm, &back, &[]);
    assert_eq!(corner.code, 1);
    let why = last(&corner)["error"]["message"].to_string();
    assert!(
        why.contains("positions only") && why.contains("point 1"),
        "{why}"
    );
    let retimed = follow(&arm, &back, &["--retime"]);
    assert_eq!(retimed.code, 0, "{} {}", retimed.stdout, retimed.stderr);
    assert!(last(&retimed)["ticks"].as_u64().unwrap() < 1000);
    assert!(joints(&arm)[0].abs() < 1e-9);

    let broken = follow(&arm, &json!({"joints": []}), &[]);
    assert_eq!(broken.code, 3, "{}", broken.stderr);
    assert!(broken.stderr.contains("points"), "{}", broken.stderr);
}

/// A trajectory that is stopped on its way is dropped; the next begins where the arm rests.
#[test]
fn a_stop_ends_a_trajectory() {
    let arm = format!("follow{}/stop", std::process::id());
    let _engine = engine(&arm);
    let mut trajectory = documented();
    for (point, time) in trajectory["points"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .zip([0, 20, 40])
    {
        point["time_s"] = json!(time);
        point["velocities"][0] = json!(point["velocities"][0].as_f64().unwrap() / 20.0);
    }
    let watched = arm.clone();
    let stopper = std::thread::spawn(move || {
        crate::status::wait_for(&watched, "a motion", |status| {
            status["command"] == "FollowJointTrajectory"
                && status["setpoint"][0].as_f64() > Some(1e-3)
        });
        canter(["abort", "--arm", &watched])
    });
    let ran = follow(&arm, &trajectory, &[]);
    assert_eq!(ran.code, 5, "{} {}", ran.stdout, ran.stderr);
    assert_eq!(stopper.join().unwrap().code, 0);
    let rest = crate::status::wait_for(&arm, "rest", |status| status["idle"] == true);
    let at = rest["setpoint"][0].as_f64().unwrap();
    assert!(at > 0.0 && at < 0.2, "{at}");
    for point in trajectory["points"].as_array_mut().unwrap() {
        let planned = point["positions"][0].as_f64().unwrap();
        point["positions"][0] = json!(at + planned);
        point["time_s"] = json!(point["time_s"].as_f64().unwrap() / 20.0);
        point["velocities"][0] = json!(point["velocities"][0].as_f64().unwrap() * 20.0);
    }
    let on = follow(&arm, &trajectory, &[]);
    assert_eq!(on.code, 0, "{} {}", on.stdout, on.stderr);
}
