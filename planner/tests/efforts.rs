//! Limits of the efforts of the joints.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use kinematics::Inertia;
use nalgebra::{SVector, vector};
use planner::controller::Controller;
use planner::motion::{PlannedMove, Planner};
use planner::robot::{self, Robot};
use planner::task::{Move, Shape};

/// The UR5e with 5 kg at its flange, as `[limits] effort` says.
fn ur5e(effort: bool) -> Robot {
    let shipped = robot::load("ur5e").unwrap();
    let toml = format!(
        "{}\n[limits]\neffort = {effort}\n[payload]\nmass_kg = 5.0\ncenter_m = [0.0, 0.0, 0.1]\n",
        shipped.toml
    );
    robot::parse("ur5e", &shipped.urdf, &toml).unwrap()
}

fn planner(robot: &Robot) -> Planner<6> {
    robot.planner::<6>().unwrap().with_efforts(robot.efforts())
}

/// The largest effort over its limit, at 2000 times.
fn largest(robot: &Robot, planned: &PlannedMove<6>) -> f64 {
    let efforts = robot.efforts::<6>().unwrap();
    let share = |i: u32| {
        let s = planned
            .trajectory
            .sample(planned.trajectory.duration() * f64::from(i) / 2000.0);
        let effort = efforts
            .dynamics
            .effort(&s.position, &s.velocity, &s.acceleration);
        effort.component_div(&efforts.limits).amax()
    };
    (0..=2000).map(share).fold(0.0, f64::max)
}

/// With the arm stretched out and 5 kg, the drives are too weak for the motion that the other limits
/// allow; with limited efforts the motion is slower, within them, and says so.
#[test]
fn a_heavy_payload_slows_the_arm_down_where_it_must() {
    let (limited, free) = (ur5e(true), ur5e(false));
    assert!(free.efforts::<6>().is_none());
    let start = SVector::from([0.0, -0.1, 0.2, -0.7, 1.5, 0.0]);
    let goal = SVector::from([1.0, -1.2, 0.2, -0.7, 1.5, 0.0]);
    for shape in [Shape::Joint, Shape::Straight] {
        let chain = free.chain::<6>().unwrap();
        let goal = if shape == Shape::Joint {
            goal
        } else {
            start.lerp(&goal, 0.4)
        };
        let motion = Move {
            shape,
            poses: vec![chain.forward(&goal)],
            tolerance: 0.0,
            limits: trajectory::ToolLimits::UNLIMITED,
        };
        let fast = planner(&free).plan(&motion, &start).unwrap();
        let slow = planner(&limited).plan(&motion, &start).unwrap();
        let (before, after) = (largest(&limited, &fast), largest(&limited, &slow));
        println!(
            "{shape:?}: {:.3} s with {before:.3} of the effort, {:.3} s with {after:.3}",
            fast.trajectory.duration(),
            slow.trajectory.duration(),
        );
        assert!(after <= 1.0, "{shape:?}: {after}");
        assert_eq!(
            before > 1.0,
            slow.trajectory.duration() > fast.trajectory.duration()
        );
        if shape == Shape::Joint {
            assert!(before > 1.03 && after > 0.9, "{before} {after}");
        }
        let certified = slow.certificate.peaks.joint_effort.iter();
        let certified = certified.fold(0.0_f64, |most, x| most.max(*x));
        assert!(
            certified >= after && certified <= 1.0,
            "{certified} {after}"
        );
        assert!(fast.certificate.peaks.joint_effort.is_empty());
    }
}

/// What no slowness helps is refused, with joint, number and time.
#[test]
fn a_payload_that_the_arm_cannot_hold_is_refused() {
    let shipped = robot::load("ur5e").unwrap();
    let toml = format!(
        "{}\n[limits]\neffort = true\n[payload]\nmass_kg = 40.0\ncenter_m = [0.0, 0.0, 0.1]\n",
        shipped.toml
    );
    let robot = robot::parse("ur5e", &shipped.urdf, &toml).unwrap();
    let start = SVector::from([0.0, -0.1, 0.2, -1.6, -1.57, 0.0]);
    let chain = robot.chain::<6>().unwrap();
    let motion = Move {
        shape: Shape::Joint,
        poses: vec![chain.forward(&(start.add_scalar(0.1)))],
        tolerance: 0.0,
        limits: trajectory::ToolLimits::UNLIMITED,
    };
    let refusal = planner(&robot)
        .plan(&motion, &start)
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("effort of joint_2"), "{refusal}");
}

/// A robot that wants limits of efforts needs masses and limits; the error names file, line and joint.
#[test]
fn what_is_missing_is_named() {
    let shipped = robot::load("irb120").unwrap();
    let toml = format!("{}\n[limits]\neffort = true\n", shipped.toml);
    let refusal = robot::parse("irb120", &shipped.urdf, &toml)
        .unwrap_err()
        .to_string();
    assert!(
        refusal.contains("limits.effort") && refusal.contains("joint"),
        "{refusal}"
    );
    let bad = "[limits]\neffort = false\n[payload]\nmass_kg = -1.0\ncenter_m = [0, 0, 0]\n";
    let toml = format!("{}\n{bad}", shipped.toml);
    let refusal = robot::parse("irb120", &shipped.urdf, &toml)
        .unwrap_err()
        .to_string();
    assert!(
        refusal.contains("payload.mass_kg") && refusal.contains("-1.0"),
        "{refusal}"
    );
}

/// The efforts count the end effector that is mounted, and another one after a tool change: they are those of
/// the bare arm with the weights as bodies at its flange.
#[test]
fn the_mounted_end_effector_counts() {
    let shipped = robot::load("ur5e").unwrap();
    let (mut toml, mut mass) = (String::new(), 0.0);
    for line in shipped.toml.lines() {
        toml.push_str(&format!("{line}\n"));
        if line.starts_with("flange_from_tcp") {
            mass += 1.0;
            toml.push_str(&format!(
                "payload = {{ mass_kg = {mass:?}, center_m = [0.0, 0.01, 0.1] }}\n"
            ));
        }
    }
    toml.push_str(
        "[limits]\neffort = true\n[payload]\nmass_kg = 0.5\ncenter_m = [0.0, 0.0, 0.1]\n",
    );
    let robot = robot::parse("ur5e", &shipped.urdf, &toml).unwrap();
    let body = |mass: f64, side: f64| Inertia {
        mass,
        centre: vector![0.0, side, 0.1],
        ..Inertia::none()
    };
    let q = SVector::from([0.3, -0.9, 1.1, -0.7, 1.5, 0.4]);
    let expected = |tool: f64| {
        let carried = body(0.5, 0.0).with(&body(tool, 0.01));
        let arm = robot.bare_efforts::<6>().unwrap();
        arm.dynamics
            .with_payload(&carried)
            .effort(&q, &(q * 0.5), &(q * 2.0))
    };
    let text = std::fs::read_to_string("../examples/tool_change.canon").unwrap();
    let program = crcl::text::read(&text, &crcl::ReadOptions::default()).program;
    let mut controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
    let mut found = Vec::new();
    for command in program.iter() {
        let efforts = controller.planner().efforts().unwrap();
        let effort = efforts.dynamics.effort(&q, &(q * 0.5), &(q * 2.0));
        let tool = [0.0, 1.0, 2.0, 3.0]
            .into_iter()
            .find(|tool| (expected(*tool) - effort).amax() < 1e-9)
            .unwrap();
        if found.last() != Some(&tool) {
            found.push(tool);
        }
        controller.step(command).unwrap();
    }
    // The gripper, nothing, the vacuum tool, nothing.
    assert_eq!(found, [1.0, 0.0, 3.0, 0.0]);
}
