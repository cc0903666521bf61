//! The independent checker agrees with good motions and objects to bad ones.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use trajectory::verify::{Recorded, Target, Verdict, Wanted, verify};
use trajectory::{JointLimits, Path, SplinePath, TimingOptions, ToolLimits, Trajectory, time_path};

/// Three prismatic joints that carry the tool.
fn record(trajectory: &Trajectory<3>, period: f64) -> Vec<Recorded<3>> {
    let duration = trajectory.duration();
    let count = (duration / period).ceil() as usize;
    // The last step takes what is left, so that none is too short for third differences.
    let mut times: Vec<f64> = (0..count).map(|i| i as f64 * period).collect();
    times.retain(|t| duration - t > 0.3 * period);
    times.push(duration);
    let sample = |time: f64| {
        let position = trajectory.sample(time).position;
        let turn = UnitQuaternion::identity();
        let tool = Isometry3::from_parts(Translation3::from(position), turn);
        Recorded {
            time,
            position,
            tool,
        }
    };
    times.into_iter().map(sample).collect()
}

fn check(samples: &[Recorded<3>], targets: &[Target], limits: &JointLimits<3>) -> Verdict {
    let wanted = Wanted {
        joint: limits,
        tool: &ToolLimits::UNLIMITED,
        targets,
        straightness: None,
        resolution: 1e-14,
    };
    verify(samples, &wanted)
}

fn targets(points: &[[f64; 3]], tolerance: f64) -> Vec<Target> {
    let target = |p: &[f64; 3]| Target {
        pose: Isometry3::translation(p[0], p[1], p[2]),
        tolerance,
        angular_tolerance: 0.1,
    };
    points.iter().map(target).collect()
}

fn motion(points: &[[f64; 3]], limits: &JointLimits<3>) -> Trajectory<3> {
    let points: Vec<SVector<f64, 3>> = points.iter().map(|p| SVector::from(*p)).collect();
    let path = SplinePath::new(&points).unwrap();
    assert!(path.end() > 0.0);
    time_path(
        &path,
        limits,
        &ToolLimits::UNLIMITED,
        &TimingOptions::default(),
    )
    .unwrap()
    .trajectory
}

fn points() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 3..8)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24, rng_seed: RngSeed::Fixed(42), ..ProptestConfig::default()
    })]

    /// What path timing certifies, the checker confirms; a motion run three in a hundred too fast,
    /// it refuses.
    #[test]
    fn agrees_with_certificates(points in points()) {
        let limits = JointLimits::uniform(1.0, 6.0, 60.0);
        let trajectory = motion(&points, &limits);
        let wanted = targets(&points[1..], 1e-4);
        let verdict = check(&record(&trajectory, 0.001), &wanted, &limits);
        prop_assert!(verdict.holds(), "{:?}", verdict.findings);
        let fast = trajectory.stretched(0.97);
        let verdict = check(&record(&fast, 0.001), &wanted, &limits);
        prop_assert!(!verdict.holds());
    }

    /// Poses in another order than they are passed are not accepted.
    #[test]
    fn wants_the_order(points in points()) {
        let limits = JointLimits::uniform(1.0, 6.0, 60.0);
        let trajectory = motion(&points, &limits);
        let mut wanted = targets(&points, 1e-3);
        wanted.reverse();
        let verdict = check(&record(&trajectory, 0.002), &wanted, &limits);
        prop_assert!(verdict.passes.iter().any(|pass| !pass.within));
    }
}

/// A cut motion is not at rest at its end, a shifted one misses its poses, a bent one is not
/// straight, one out of range is outside.
#[test]
fn objects_to_bad_motions() {
    let limits = JointLimits::uniform(1.0, 6.0, 60.0);
    let points = [[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [1.0, 0.0, 0.0]];
    let samples = record(&motion(&points, &limits), 0.001);
    let half = check(&samples[..samples.len() / 2], &[], &limits);
    assert!(half.rest[0] <= 1.0 && half.rest[1] > 10.0);
    let shifted = targets(&[[0.5, 0.12, 0.0]], 1e-3);
    let verdict = check(&samples, &shifted, &limits);
    assert!(!verdict.holds() && (verdict.passes[0].deviation - 0.02).abs() < 1e-3);
    assert!(verdict.straightness > 0.05);
    let narrow = JointLimits {
        upper: SVector::repeat(0.9),
        ..limits
    };
    assert!((check(&samples, &[], &narrow).position_excess - 0.1).abs() < 1e-6);
    assert!(!check(&[], &[], &limits).holds());
}
