//! The arm's controller is told what the arm carries.

use std::process::Stdio;
use std::time::Duration;

use crate::canter::command;
use crate::robot_folder::{MASSES, with_masses};

/// A program that changes the tool twice, with the simulated driver: each change is told once, with the
/// mass and the tool centre point of the end effector.
pub(crate) fn a_tool_change_tells_the_payload() {
    let folder = with_masses("ur5e");
    let robot = folder.path().to_str().unwrap();
    let arm = format!("payload{}/sim", std::process::id());
    let observer = ipc::Observer::open(&system_tests::domain::arm(&arm)).unwrap();
    let words = [
        "run",
        "examples/tool_change.canon",
        "--robot",
        robot,
        "--arm",
        &arm,
    ];
    let mut child = command(words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut told = Vec::new();
    loop {
        let ended = child.try_wait().unwrap().is_some();
        while let Some(setpoint) = observer.next_setpoint() {
            let payload = setpoint.payload;
            let row = (payload.number, payload.mass, payload.tool_position[2]);
            if told.last() != Some(&row) {
                told.push(row);
            }
        }
        if ended {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    let expected = [
        (1, MASSES[0], 0.12),
        (2, 0.0, 0.0),
        (3, MASSES[2], 0.15),
        (4, 0.0, 0.0),
    ];
    assert_eq!(told, expected);
}
