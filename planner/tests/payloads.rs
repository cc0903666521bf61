//! What the flange carries, from `robot.toml`.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::vector;
use planner::robot::{self, Robot, RobotError};

/// The UR5e; the end effectors with these places in the file have a payload.
fn ur5e(with: &[usize], mass: f64) -> Result<Robot, RobotError> {
    let shipped = robot::load("ur5e").unwrap();
    let mut toml = String::new();
    let mut place = 0;
    for line in shipped.toml.lines() {
        toml.push_str(line);
        toml.push('\n');
        if line.starts_with("flange_from_tcp") {
            if with.contains(&place) {
                let text =
                    format!("payload = {{ mass_kg = {mass:?}, center_m = [0.0, 0.0, 0.1] }}\n");
                toml.push_str(&text);
            }
            place += 1;
        }
    }
    toml.push_str("[payload]\nmass_kg = 1.0\ncenter_m = [0.0, 0.0, 0.0]\n");
    robot::parse("ur5e", &shipped.urdf, &toml)
}

#[test]
fn the_mounted_end_effector_is_carried_with_what_is_always_there() {
    let robot = ur5e(&[0, 1, 2], 3.0).unwrap();
    let mut tooling = robot.tooling();
    let carried = tooling.carried().unwrap();
    assert_eq!(carried.mass, 4.0);
    assert!((carried.centre - vector![0.0, 0.0, 0.075]).norm() < 1e-15);
    tooling.mounted = None;
    assert_eq!(tooling.carried().unwrap().mass, 1.0);
    assert_eq!(
        ur5e(&[], 0.0).unwrap().tooling().carried().unwrap().mass,
        1.0
    );
    let shipped = robot::load("ur5e").unwrap();
    assert_eq!(shipped.tooling().carried(), None);
}

/// A mass that is missing at one end effector, or that is none, is refused with its place.
#[test]
fn masses_that_are_missing_or_wrong_are_named() {
    let refusal = ur5e(&[0, 2], 3.0).unwrap_err().to_string();
    assert!(refusal.contains("every end effector has one"), "{refusal}");
    let refusal = ur5e(&[0, 1, 2], -3.0).unwrap_err().to_string();
    assert!(
        refusal.contains("end_effector.payload.mass_kg") && refusal.contains("-3.0"),
        "{refusal}"
    );
}
