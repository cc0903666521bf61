//! Smooth moves with settings for single poses, judged from where the joints put the controlled point.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::{Command, LengthUnit, Pose, PoseAndSet};
use nalgebra::Vector3;
use planner::controller::Controller;

/// Times at which the motion is looked at, s.
const STEP: f64 = 1e-3;

fn controller() -> Controller<6> {
    let robot = planner::robot::load("ur5e").unwrap();
    let mut controller = Controller::new(&robot, 1000.0, LengthUnit::Meter).unwrap();
    for command in [
        Command::InitCanon,
        Command::SetLengthUnits {
            unit: LengthUnit::Meter,
        },
        Command::SetRelativeSpeed { percent: 50.0 },
        Command::SetRelativeAcceleration { percent: 100.0 },
        Command::SetIntermediatePointTolerance { tolerance: 5e-3 },
    ] {
        controller.step(&command).unwrap();
    }
    controller
}

/// A zigzag from where the arm is.
fn waypoints(controller: &Controller<6>, speeds: &[Option<f64>]) -> Vec<PoseAndSet> {
    let here = controller.pose();
    let [z_axis, x_axis] = [Vector3::z(), Vector3::x()].map(|axis| (here.rotation * axis).into());
    let pose = |(index, speed): (usize, &Option<f64>)| {
        let along = 0.06 * (index + 1) as f64;
        let aside = if index % 2 == 0 { 0.05 } else { 0.0 };
        let point = here.translation.vector + Vector3::new(-along, aside, 0.0);
        PoseAndSet {
            speed: *speed,
            ..PoseAndSet::from(Pose::Axes {
                point: point.into(),
                z_axis,
                x_axis,
            })
        }
    };
    speeds.iter().enumerate().map(pose).collect()
}

/// The fastest of each leg, m/s, and how near each pose but the last is passed, m, in order.
fn judge(speeds: &[Option<f64>]) -> (Vec<f64>, Vec<f64>, f64) {
    let mut controller = controller();
    let waypoints = waypoints(&controller, speeds);
    let step = controller.step(&Command::MoveThroughWaypoints {
        waypoints: waypoints.clone(),
    });
    let planned = step.unwrap().planned.unwrap();
    let rows = (planned.trajectory.duration() / STEP).ceil() as usize;
    let at = |row: usize| {
        let joints = planned.trajectory.sample(row as f64 * STEP).position;
        controller.chain().forward(&joints).translation.vector
    };
    let way: Vec<_> = (0..=rows).map(at).collect();
    let passes: Vec<f64> = planned
        .certificate
        .poses
        .iter()
        .map(|pass| pass.time_s)
        .collect();
    assert!(passes.is_sorted() && passes.len() + 1 == speeds.len());
    let mut fastest = vec![0.0_f64; speeds.len()];
    for (row, pair) in way.windows(2).enumerate() {
        let time = (row as f64 + 0.5) * STEP;
        let leg = passes.iter().take_while(|pass| **pass < time).count();
        fastest[leg] = fastest[leg].max((pair[1] - pair[0]).norm() / STEP);
    }
    let off = waypoints.iter().zip(&passes).map(|(waypoint, time)| {
        let place = Vector3::from(waypoint.pose.point());
        (at((time / STEP).round() as usize) - place).norm()
    });
    (fastest, off.collect(), planned.trajectory.duration())
}

/// Every leg keeps its own speed, some leg uses its own, and no other leg is slower for it.
#[test]
fn each_leg_keeps_its_own_speed() {
    let speeds = [Some(0.2), Some(0.03), None, Some(0.1), None];
    let (fastest, off, time) = judge(&speeds);
    for (leg, (fastest, own)) in fastest.iter().zip(&speeds).enumerate() {
        let most = own.unwrap_or(0.5);
        // A row may hold a moment of the leg before.
        assert!(
            *fastest <= most * 1.02 + 2e-3,
            "leg {leg}: {fastest} m/s, not {most}"
        );
    }
    assert!(fastest[1] > 0.028 && fastest[3] > 0.09, "{fastest:?}");
    assert!(fastest[2] > 0.12, "{fastest:?}");
    assert!(off.iter().all(|off| *off < 5.2e-3), "{off:?}");
    // All legs as slow as the slowest would take longer.
    let (_, _, slow) = judge(&[Some(0.03); 5]);
    assert!(time < 0.7 * slow, "{time} s, {slow} s");
    // Settings that are those in force change nothing.
    let (_, _, plain) = judge(&[None; 5]);
    assert!(plain < time, "{plain} s");
}

/// A tolerance of one pose is kept, and what is out of range names its pose.
#[test]
fn tolerances_and_errors_are_of_a_pose() {
    let mut controller = controller();
    let mut waypoints = waypoints(&controller, &[None; 4]);
    waypoints[1].tolerance = Some(1e-3);
    let command = |waypoints: &[PoseAndSet]| Command::MoveThroughWaypoints {
        waypoints: waypoints.to_vec(),
    };
    let before = controller.clone();
    let planned = controller
        .step(&command(&waypoints))
        .unwrap()
        .planned
        .unwrap();
    assert!(planned.certificate.poses[1].deviation_m <= 1e-3 + 1e-6);
    waypoints[2].speed = Some(1e3);
    let error = before.clone().step(&command(&waypoints)).unwrap_err();
    assert!(error.message.contains("pose 3 of 4"), "{error}");
}
