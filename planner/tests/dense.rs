//! Lists whose poses are near to each other, on arms.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::f64::consts::TAU;

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use planner::motion::{BlockedCause, MotionError, Planner};
use planner::robot::load;
use planner::task::{Move, Shape};
use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, plan};

/// An arm at home.
struct Arm<const N: usize> {
    planner: Planner<N>,
    home: SVector<f64, N>,
    limits: ToolLimits,
}

impl<const N: usize> Arm<N> {
    fn new(name: &str) -> Self {
        let robot = load(name).unwrap();
        Self {
            planner: robot.planner::<N>().unwrap(),
            home: SVector::from_column_slice(&robot.home),
            limits: robot.motion_limits(),
        }
    }

    /// Where the tool is at home.
    fn pose(&self) -> Isometry3<f64> {
        self.planner.chain().forward(&self.home)
    }

    /// Time (s) of the motion through places (m) in axes of the tool at home, whose certificate is looked at.
    fn time(&self, places: &[Vector3<f64>], tolerance: f64) -> f64 {
        let pose = |place: &Vector3<f64>| self.pose() * Translation3::from(*place);
        let motion = self.motion(places.iter().map(pose).collect(), tolerance);
        let planned = self.planner.plan(&motion, &self.home).unwrap();
        let certificate = &planned.certificate;
        assert_eq!(certificate.poses.len(), places.len() - 1);
        assert!(certificate.in_order && certificate.peaks.largest() <= 1.0 + 1e-9);
        let mut since = 0.0;
        for pass in &certificate.poses {
            let joints = planned.trajectory.sample(pass.time_s).position;
            let seen = self.planner.chain().forward(&joints);
            let gap = motion.poses[pass.index - 1].inv_mul(&seen);
            assert!(gap.translation.vector.norm() <= tolerance + 1e-9 && pass.time_s >= since);
            since = pass.time_s;
        }
        planned.trajectory.duration()
    }

    /// Time (s) of the tool alone through the same places.
    fn tool_time(&self, places: &[Vector3<f64>], tolerance: f64) -> f64 {
        let at = |place: &Vector3<f64>| self.pose() * Translation3::from(*place);
        let mut poses = vec![self.pose()];
        poses.extend(places.iter().map(at));
        let options = SmoothOptions::new(tolerance, self.limits);
        plan(&poses, &options).unwrap().duration()
    }

    fn motion(&self, poses: Vec<Isometry3<f64>>, tolerance: f64) -> Move {
        Move {
            shape: Shape::Smooth,
            poses,
            tolerance,
            limits: self.limits,
        }
    }
}

/// Further places on the legs from the origin through some places, so far apart (m).
fn filled(places: &[Vector3<f64>], step: f64) -> Vec<Vector3<f64>> {
    let (mut from, mut all) = (Vector3::zeros(), Vec::new());
    for to in places {
        let count = ((to - from).norm() / step).round().max(1.0) as usize;
        all.extend((1..=count).map(|k| from + (to - from) * (k as f64 / count as f64)));
        from = *to;
    }
    all
}

/// The corners of lines side by side, so far apart (m), each driven back after the one before.
fn raster(lines: usize, apart: f64) -> Vec<Vector3<f64>> {
    let line = |k: usize| {
        let (near, far, across) = (0.0, 0.1, apart * k as f64);
        let ends = if k.is_multiple_of(2) {
            [near, far]
        } else {
            [far, near]
        };
        ends.map(|along| Vector3::new(along, across, 0.0))
    };
    (0..lines).flat_map(line).skip(1).collect()
}

/// The corners of a star with narrow tips.
fn star() -> Vec<Vector3<f64>> {
    let corner = |k: usize| {
        let (sine, cosine) = (TAU * k as f64 / 24.0).sin_cos();
        let far = if k.is_multiple_of(2) { 0.05 } else { 0.03 };
        Vector3::new(far * cosine - 0.05, far * sine, 0.0)
    };
    (1..=24).map(corner).collect()
}

/// Further poses on straight legs change nothing of the motion of an arm: without them the joints shape the curve, so they do with
/// them, too. Lists like these took 5 to 26 % longer on a Panda.
#[test]
fn poses_on_the_legs_change_nothing() {
    let (ur5e, panda) = (Arm::<6>::new("ur5e"), Arm::<7>::new("panda"));
    for (list, corners, tolerances) in [
        ("raster", raster(6, 0.01), &[2e-4, 1e-3][..]),
        ("star", star(), &[2e-4]),
    ] {
        for &tolerance in tolerances {
            let more = filled(&corners, 5e-4);
            let both = [&corners, &more];
            let six = both.map(|places| ur5e.time(places, tolerance));
            let seven = both.map(|places| panda.time(places, tolerance));
            for (arm, [few, many]) in [("UR5e", six), ("Panda", seven)] {
                println!("{arm}, {list} within {tolerance} m: {few} s, {many} s with more poses");
                assert!((many / few - 1.0).abs() < 0.01, "{arm}: {few} s, {many} s");
            }
        }
    }
}

/// Poses as they are taught by hand, with noise, along a closed curve.
fn taught(noise: f64) -> Vec<Vector3<f64>> {
    let place = |k: u32| {
        let turn = TAU * f64::from(k) / 400.0;
        let at = |times: f64| (times * turn).sin();
        let off = |times: f64| noise * (times * f64::from(k)).sin();
        Vector3::new(
            0.05 * at(2.0) + off(12.9),
            0.05 * at(3.0) + off(78.2),
            0.02 * (1.0 - turn.cos()) + off(37.7),
        )
    };
    (1..=400).map(place).collect()
}

/// Where the joints rule, a dense list takes them no longer within more tolerance than its noise, though the fastest curve of the tool,
/// which cuts through the noise, is not searched for. The spare joint of a Panda is moved by a search that ends elsewhere along another
/// curve.
#[test]
fn a_taught_curve_is_smoothed_for_the_joints() {
    let (ur5e, panda) = (Arm::<6>::new("ur5e"), Arm::<7>::new("panda"));
    let places = taught(2e-5);
    let mut least = [f64::INFINITY; 2];
    for tolerance in [5e-5, 2e-4, 1e-3, 5e-3] {
        let times = [
            ur5e.time(&places, tolerance),
            panda.time(&places, tolerance),
        ];
        println!("within {tolerance} m: {times:?} s");
        for ((least, time), more) in least.iter_mut().zip(times).zip([1.02, 1.1]) {
            assert!(time < more * *least, "{time} s, {least} s within less");
            *least = least.min(time);
        }
    }
}

/// A long raster takes an arm hardly longer than the tool alone: the cells of the time law follow all corners. With cells for a
/// fiftieth of the motion, and for all corners where limits were exceeded between the cells, it stopped at each: 3 % longer.
#[test]
fn a_long_raster_does_not_stop() {
    let mut arm = Arm::<6>::new("ur5e");
    arm.limits.speed = 0.025;
    for lines in [4, 24] {
        let (places, tolerance) = (raster(lines, 0.002), 5e-4);
        let time = arm.time(&places, tolerance);
        let tool = arm.tool_time(&places, tolerance);
        println!("{lines} lines: {time} s, the tool alone {tool} s");
        assert!(time < 1.02 * tool);
    }
}

/// A long curve within more tolerance takes no longer, and the spare joint is moved where that saves time. Knots that were nearer
/// to each other than poses let the curve wave: 12 % longer within 1 mm than within 0.05 mm, and 1.9 to 2.4 times the tool's own time.
#[test]
fn a_long_curve_within_more_takes_no_longer() {
    let arm = Arm::<7>::new("panda");
    let place = |k: usize| {
        let turn = TAU * k as f64 / 5000.0;
        let at = |times: f64| (times * turn).sin();
        Vector3::new(
            0.08 * at(3.0),
            0.08 * at(4.0),
            0.02 * (1.0 - (5.0 * turn).cos()),
        )
    };
    let places: Vec<_> = (1..=5000).map(place).collect();
    let mut least = f64::INFINITY;
    for tolerance in [5e-5, 2e-4, 1e-3] {
        let time = arm.time(&places, tolerance);
        let tool = arm.tool_time(&places, tolerance);
        println!("within {tolerance} m: {time} s, the tool alone {tool} s");
        assert!(time < 1.05 * least, "{time} s, {least} s within less");
        assert!(time < 1.85 * tool, "{time} s");
        least = least.min(time);
    }
}

/// A dense list that turns farther than a joint can is refused at a pose that the joint does not reach.
#[test]
fn a_dense_list_that_turns_too_far_is_refused_there() {
    let arm = Arm::<6>::new("ur5e");
    let room = arm.planner.limits().upper[5] - arm.home[5];
    let step = 0.04;
    let pose = |k: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), step * k as f64);
        arm.pose() * Translation3::new(2e-4 * k as f64, 0.0, 0.0) * turn
    };
    let poses = (1..=400).map(pose).collect();
    let refusal = arm.planner.plan(&arm.motion(poses, 1e-4), &arm.home);
    let MotionError::Blocked { pose, cause, .. } = refusal.unwrap_err() else {
        panic!("another refusal");
    };
    let joint_limit = matches!(cause, BlockedCause::JointLimit { .. });
    assert!(joint_limit && step * pose as f64 > room - 0.1, "{pose}");
}
