//! The interpolated tool along lines in joint space of shipped robots, compared with their kinematics.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::SVector;
use planner::robot::load;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use trajectory::{JointLine, JointPoint, Path, SampledLine, ToolPoint};

/// Largest errors: of the position (m), of the angle (rad), and of derivatives over those of an arm of
/// 1 m that is stretched out while all joints turn.
const PLACE: f64 = 1e-8;
const ANGLE: f64 = 1e-5;
const RATES: [f64; 3] = [1e-8, 1e-7, 1e-6];

/// Compares a line between two places of the range, 0 to 1 each, at `u`.
fn compare<const N: usize>(robot: &str, ends: [[f64; N]; 2], u: f64) {
    let robot = load(robot).unwrap();
    let (chain, limits) = (robot.chain::<N>().unwrap(), robot.joint_limits::<N>());
    let place = |share: [f64; N]| {
        let share = SVector::from(share);
        limits.lower + (limits.upper - limits.lower).component_mul(&share)
    };
    let tool = |joint: &JointPoint<N>| {
        let seen = chain.motion(&joint.q);
        ToolPoint {
            pose: seen.pose,
            linear: seen.linear,
            angular: seen.angular,
        }
    };
    let [start, end] = ends.map(place);
    let line = JointLine::new(start, end, tool);
    let (exact, sampled) = (line.at(u), SampledLine::new(&line).at(u));
    assert_eq!(exact.joint, sampled.joint);
    let (exact, sampled) = (exact.tool, sampled.tool);
    let off = exact.pose.translation.vector - sampled.pose.translation.vector;
    assert!(off.norm() < PLACE, "{off}");
    assert!(exact.pose.rotation.angle_to(&sampled.pose.rotation) < ANGLE);
    let way = (end - start).lp_norm(1);
    for (k, rate) in RATES.into_iter().enumerate() {
        let allowed = rate * way.powi(k as i32 + 1);
        let off = [
            exact.linear[k] - sampled.linear[k],
            exact.angular[k] - sampled.angular[k],
        ];
        let off = off.map(|off| off.norm());
        assert!(
            off[0] < allowed && off[1] < allowed,
            "{k}: {off:?} {allowed}"
        );
    }
}

/// At any place the interpolated tool is that of the kinematics; at the ends it is the same.
#[test]
fn the_interpolated_tool_is_that_of_the_arm() {
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(2026),
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let six = [
        prop::array::uniform6(0.0..1.0_f64),
        prop::array::uniform6(0.0..1.0_f64),
    ];
    let seven = [
        prop::array::uniform7(0.0..1.0_f64),
        prop::array::uniform7(0.0..1.0_f64),
    ];
    let u = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64];
    runner
        .run(&(six, seven, u), |(six, seven, u)| {
            compare("ur5e", six, u);
            compare("panda", seven, u);
            Ok(())
        })
        .unwrap();
}
