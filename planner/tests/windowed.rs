//! Long smooth moves that are planned in windows.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::borrow::Cow;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};
use planner::controller::Controller;
use planner::motion::{MotionError, MoveCertificate, Planner};
use planner::robot::load;
use planner::task::{Move, Shape};
use realtime::Sample;
use trajectory::ToolLimits;
use trajectory::smooth::SmoothOptions;

#[path = "../../trajectory/tests/dense/lists.rs"]
#[allow(dead_code, reason = "the tests of trajectory use more of it")]
mod lists;

/// Lists from this length on are planned in windows.
const LONG: usize = 4100;

fn arm(name: &str) -> (Planner<6>, SVector<f64, 6>, ToolLimits) {
    let robot = load(name).unwrap();
    let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
    let home = SVector::from_column_slice(&robot.home);
    (controller.planner().clone(), home, robot.motion_limits())
}

/// A move along waves from the arm's pose, `step` (m) from pose to pose, with a turning tool.
fn waves(start: &Isometry3<f64>, step: f64, tolerance: f64, limits: ToolLimits) -> Move {
    let at = |i: usize| {
        let a = TAU * i as f64 * step / 0.3;
        let way = Vector3::new(
            0.04 * (a.cos() - 1.0) + 0.03 * (0.37 * a).sin(),
            0.06 * a.sin(),
            0.02 * (0.21 * a).sin(),
        );
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.15 * (0.3 * a).sin());
        let place = start.translation.vector + way;
        Isometry3::from_parts(place.into(), start.rotation * turn)
    };
    Move {
        shape: Shape::Smooth,
        poses: (1..=LONG).map(at).collect(),
        tolerance,
        limits,
    }
}

/// A list with so many more poses on its legs that it is a long one.
fn filled(poses: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let parts = LONG.div_ceil(poses.len() - 1);
    let mut filled = vec![poses[0]];
    for pair in poses.windows(2) {
        let turn = pair[0].rotation.inverse() * pair[1].rotation;
        for part in 1..=parts {
            let share = part as f64 / parts as f64;
            let way = (pair[1].translation.vector - pair[0].translation.vector) * share;
            let rotation = pair[0].rotation * turn.powf(share);
            let place = pair[0].translation.vector + way;
            filled.push(Isometry3::from_parts(place.into(), rotation));
        }
    }
    filled
}

/// The windows are the plan, one goes on exactly where the one before it ends, and the certificate
/// is that of the whole.
#[test]
fn the_windows_together_are_the_plan() {
    let (planner, home, limits) = arm("ur5e");
    let motion = waves(&planner.chain().forward(&home), 1e-3, 1e-4, limits);
    let whole = planner.plan(&motion, &home).unwrap();
    let mut windowed = planner.windows(Cow::Borrowed(&motion), &home).unwrap();
    let (mut windows, mut pieces) = (0, Vec::new());
    let mut before = Sample::rest(home);
    loop {
        let window = planner.window_of(&mut windowed).unwrap();
        for piece in &window.pieces {
            let begin = piece.sample(0.0);
            assert!((begin.position - before.position).amax() < 1e-9);
            assert!((begin.velocity - before.velocity).amax() < 1e-6);
            assert!((begin.acceleration - before.acceleration).amax() < 1e-3);
            before = piece.sample(piece.duration);
        }
        windows += 1;
        pieces.extend(window.pieces);
        if window.last {
            break;
        }
        assert!(
            before.velocity.amax() > 1e-3,
            "a rest after window {windows}"
        );
    }
    assert!(windows > 3, "{windows}");
    assert!((before.position - windowed.end()).amax() < 1e-9 && before.velocity.amax() < 1e-6);
    assert_eq!(pieces, whole.trajectory.pieces());
    assert_eq!(windowed.certificate(), Some(&whole.certificate));
    let certificate = &whole.certificate;
    assert!((certificate.duration_s - whole.trajectory.duration()).abs() < 1e-9);
    assert_eq!(certificate.poses.len(), LONG - 1);
    assert!(certificate.in_order && certificate.peaks.largest() <= 1.0 + 1e-9);
    assert!(certificate.lower_bound_s > 0.0 && certificate.corridor_m.unwrap() <= 1e-4);
    for pair in certificate.poses.windows(2) {
        assert!(pair[1].index == pair[0].index + 1 && pair[1].time_s >= pair[0].time_s);
    }
    // Each pass is where the motion is at that time.
    for pass in certificate.poses.iter().step_by(97) {
        let joints = whole.trajectory.sample(pass.time_s).position;
        let gap = motion.poses[pass.index - 1].inv_mul(&planner.chain().forward(&joints));
        assert!((gap.translation.vector.norm() - pass.deviation_m).abs() < 1e-7);
        assert!(pass.deviation_m <= 1e-4);
    }
}

/// What was driven may be forgotten after each window: the motion is the same, and the certificate but for the
/// passes and the active limits.
#[test]
fn what_is_driven_may_be_forgotten() {
    let (planner, home, limits) = arm("ur5e");
    let motion = waves(&planner.chain().forward(&home), 1e-3, 1e-4, limits);
    let whole = planner.plan(&motion, &home).unwrap();
    let mut windowed = planner.windows(Cow::Borrowed(&motion), &home).unwrap();
    let mut pieces = Vec::new();
    loop {
        let window = planner.window_of(&mut windowed).unwrap();
        pieces.extend(window.pieces);
        windowed.forget();
        assert!(windowed.certificate().unwrap().poses.is_empty());
        if window.last {
            break;
        }
    }
    assert_eq!(pieces, whole.trajectory.pieces());
    let certificate = windowed.certificate().unwrap().clone();
    let kept = MoveCertificate {
        poses: Vec::new(),
        active: Vec::new(),
        ..whole.certificate
    };
    assert_eq!(certificate, kept);
}

/// Random dense lists, wherever they lie before the arm: where the check of the way says yes, every
/// window is certified and few rest on their way; where the way leaves the reach or the range of a
/// joint, it does not say yes. `CANTER_LISTS` asks for more lists.
#[test]
fn a_yes_is_never_followed_by_a_refusal() {
    let (planner, home, _) = arm("ur5e");
    let count = std::env::var("CANTER_LISTS").map_or(24, |count| count.parse::<usize>().unwrap());
    let limits = ToolLimits {
        angular_speed: 3.0,
        angular_acceleration: 30.0,
        angular_jerk: 600.0,
        ..lists::limits()
    };
    let (mut yes, mut refused, mut rests) = (0_usize, 0, 0);
    for seed in 0..count as u64 {
        let (poses, tolerance) = lists::random(seed, 400.0);
        let mut random = lists::Random::new(seed + 1000);
        let shift = random.vector(0.25);
        let turn = UnitQuaternion::from_scaled_axis(random.vector(1.0));
        let mut start = planner.chain().forward(&home);
        start.translation.vector += shift;
        let first = poses[0].inverse();
        let poses: Vec<_> = filled(&poses)
            .iter()
            .map(|pose| start * turn * (first * pose) * turn.inverse())
            .collect();
        let begin = planner.postures(&poses[0], &home);
        let Some(begin) = begin.first() else {
            continue;
        };
        let motion = Move {
            shape: Shape::Smooth,
            poses: poses[1..].to_vec(),
            tolerance,
            limits,
        };
        let Some(mut windowed) = planner.windows(Cow::Borrowed(&motion), begin) else {
            refused += 1;
            continue;
        };
        yes += 1;
        loop {
            match planner.window_of(&mut windowed) {
                Ok(window) if window.last => break,
                Ok(_) => {}
                Err(error) => panic!("list {seed}: {error}"),
            }
        }
        rests += windowed.rests();
        let certificate = windowed.certificate().unwrap();
        assert!(certificate.in_order, "{seed}");
        assert!(certificate.peaks.largest() <= 1.0 + 1e-9, "{seed}");
        assert_eq!(certificate.poses.len(), motion.poses.len() - 1, "{seed}");
        assert!(certificate.joint_margin > 0.0, "{seed}");
    }
    println!("{yes} lists in windows with {rests} rests, {refused} not");
    assert!(yes >= count / 4 && refused > 0, "{yes} {refused}");
    assert!(20 * rests <= yes, "{rests}");
}

/// A way that leaves the reach is not begun, and the plan says where it fails.
#[test]
fn a_way_out_of_reach_is_not_begun() {
    let (planner, home, limits) = arm("ur5e");
    let start = planner.chain().forward(&home);
    let mut motion = waves(&start, 1e-3, 1e-4, limits);
    for (i, pose) in motion.poses.iter_mut().enumerate() {
        pose.translation.vector.x += 1e-3 * i as f64;
    }
    assert!(planner.windows(Cow::Borrowed(&motion), &home).is_none());
    let error = planner.plan(&motion, &home).unwrap_err();
    let named = match error {
        MotionError::OutOfReach { pose, .. } | MotionError::Blocked { pose, .. } => pose,
        other => panic!("{other}"),
    };
    assert!((100..LONG).contains(&named), "{named}");
}

/// Windows lose little beside the least time along the exact curve where the tool rules.
#[test]
fn windows_are_fast() {
    let (planner, home, _) = arm("gantry");
    let start = planner.chain().forward(&home);
    for case in lists::suite() {
        let first = case.poses[0].translation.vector;
        let poses: Vec<_> = filled(&case.poses)
            .iter()
            .map(|pose| {
                let place = start.translation.vector + pose.translation.vector - first;
                Isometry3::from_parts(place.into(), start.rotation)
            })
            .collect();
        let motion = Move {
            shape: Shape::Smooth,
            poses: poses[1..].to_vec(),
            tolerance: case.tolerance,
            limits: lists::limits(),
        };
        let planned = planner.plan(&motion, &home).unwrap();
        let ratio = planned.trajectory.duration() / case.reference;
        let options = SmoothOptions::new(case.tolerance, lists::limits());
        let tool = trajectory::smooth::plan(&poses, &options).unwrap();
        let whole = tool.duration() / case.reference;
        println!("{} {ratio:.4}, as a whole {whole:.4}", case.name);
        assert!(ratio < 1.025, "{}: {ratio}", case.name);
    }
}
