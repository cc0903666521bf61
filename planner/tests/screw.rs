//! Screws, judged from where the joints put the controlled point.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::{AngleUnit, Command, LengthUnit, Screw};
use nalgebra::{Isometry3, Point3, Vector3};
use planner::controller::Controller;
use planner::motion::PlannedMove;

fn controller() -> Controller<6> {
    let robot = planner::robot::load("ur5e").unwrap();
    let mut controller = Controller::new(&robot, 1000.0, LengthUnit::Meter).unwrap();
    for command in [
        Command::InitCanon,
        Command::SetLengthUnits {
            unit: LengthUnit::Meter,
        },
        Command::SetAngleUnits {
            unit: AngleUnit::Radian,
        },
        Command::SetAbsoluteSpeed { value: 0.1 },
    ] {
        controller.step(&command).unwrap();
    }
    controller
}

/// Plans a screw; gives where the controlled point was before, and the motion.
fn plan(screw: Screw) -> (Controller<6>, Isometry3<f64>, PlannedMove<6>) {
    let mut controller = controller();
    let before = controller.pose();
    let step = controller.step(&Command::MoveScrew { screw }).unwrap();
    (controller, before, step.planned.unwrap())
}

/// Where the controlled point is at every millisecond.
fn poses(controller: &Controller<6>, planned: &PlannedMove<6>) -> Vec<Isometry3<f64>> {
    let rows = (planned.trajectory.duration() * 1e3).ceil() as usize;
    let joints = (0..=rows).map(|row| planned.trajectory.sample(row as f64 * 1e-3).position);
    joints.map(|q| controller.chain().forward(&q)).collect()
}

/// Turn and advance are in step, radius and pitch are held to 10 um, whatever the axis.
#[test]
fn radius_and_pitch_are_held() {
    let here = controller().pose();
    let beside = here * Point3::new(0.03, -0.02, 0.1);
    let cases = [
        (None, 0.02, 4.0),
        (Some(beside), -0.03, -3.0),
        (Some(beside), 0.0, 2.0),
        (None, 0.0, -1.5),
        (Some(beside), 0.02, 0.0),
    ];
    for (axis_point, advance, turn) in cases {
        let screw = Screw {
            advance,
            turn,
            axis_point: axis_point.map(|point: Point3<f64>| point.coords.into()),
            ..Screw::default()
        };
        let (controller, before, planned) = plan(screw);
        let axis = before.rotation * Vector3::z();
        let point = axis_point.map_or(before.translation.vector, |point| point.coords);
        let from_axis = |at: &Isometry3<f64>| (at.translation.vector - point).cross(&axis).norm();
        let radius = from_axis(&before);
        let mut turned = 0.0;
        let mut last = before;
        for at in poses(&controller, &planned) {
            turned += (at.rotation * last.rotation.inverse())
                .scaled_axis()
                .dot(&axis);
            last = at;
            let off = (from_axis(&at) - radius).abs();
            assert!(off < 1e-5, "{screw:?}: the radius is {off} m off");
            let advanced = (at.translation.vector - before.translation.vector).dot(&axis);
            let due = if turn == 0.0 {
                advanced
            } else {
                advance * turned / turn
            };
            assert!(
                (advanced - due).abs() < 1e-5,
                "{screw:?}: {advanced} m, not {due}"
            );
        }
        assert!((turned - turn).abs() < 1e-5, "{turned}");
        let advanced = (last.translation.vector - before.translation.vector).dot(&axis);
        assert!((advanced - advance).abs() < 1e-5, "{advanced}");
        assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
    }
}

/// First to the start, then straight on, then the turn; one command, checked as a whole.
#[test]
fn the_parts_come_in_order() {
    let here = controller().pose();
    let start = here * Isometry3::translation(0.05, 0.0, 0.0);
    let axes = [Vector3::z(), Vector3::x()].map(|axis| (start.rotation * axis).into());
    let screw = Screw {
        advance: 0.01,
        turn: 1.0,
        free: 0.03,
        axis_point: None,
        start: Some(crcl::Pose::Axes {
            point: start.translation.vector.into(),
            z_axis: axes[0],
            x_axis: axes[1],
        }),
    };
    let (controller, _, planned) = plan(screw);
    let way = poses(&controller, &planned);
    let mut at = 0;
    for place in [
        start,
        start * Isometry3::translation(0.0, 0.0, 0.03),
        start * Isometry3::translation(0.0, 0.0, 0.04) * Isometry3::rotation(Vector3::z()),
    ] {
        let near = |pose: &Isometry3<f64>| {
            let gap = place.inv_mul(pose);
            gap.translation.vector.norm() < 1e-4 && gap.rotation.angle() < 1e-3
        };
        at += way[at..].iter().position(near).unwrap();
    }
    // What cannot be turned so far is refused, and nothing is done of it.
    let mut controller = controller;
    let before = *controller.joints();
    let screw = Screw {
        turn: 100.0,
        ..screw
    };
    controller.step(&Command::MoveScrew { screw }).unwrap_err();
    assert_eq!(*controller.joints(), before);
}
