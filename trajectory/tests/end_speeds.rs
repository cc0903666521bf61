//! Time laws under speed limits that fall towards the ends of the range.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use nalgebra::{Isometry3, SVector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use trajectory::{
    EndSpeeds, JointLimits, JointLine, JointPoint, SplinePath, TimingOptions, ToolLimits,
    ToolPoint, Trajectory, time_path,
};

/// Joints with ranges of 2 rad to each side.
fn limits() -> JointLimits<2> {
    JointLimits {
        ends: Some(EndSpeeds {
            lower: SVector::repeat(-2.0),
            upper: SVector::repeat(2.0),
            deceleration: SVector::from([2.5, 17.0]),
            offset: SVector::from([0.2, 0.35]),
        }),
        ..JointLimits::uniform(2.4, 8.0, 2500.0)
    }
}

/// The largest ratio of a speed to its limit at that position, at many samples.
fn worst(trajectory: &Trajectory<2>, limits: &JointLimits<2>) -> f64 {
    let count = 5000;
    let mut most = 0.0_f64;
    for i in 0..=count {
        let s = trajectory.sample(trajectory.duration() * f64::from(i) / f64::from(count));
        for j in 0..2 {
            if s.velocity[j].abs() > 1e-9 {
                let allowed = limits.speed(j, s.position[j], s.velocity[j]);
                most = most.max(s.velocity[j].abs() / allowed);
            }
        }
    }
    most
}

fn points() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec(prop::array::uniform2(-1.9..1.9_f64), 2..6)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, rng_seed: RngSeed::Fixed(139), ..ProptestConfig::default() })]

    /// Along any path inside the range the limits hold, and the law is faster than the one without
    /// them would be if all of it were slowed down.
    #[test]
    fn a_law_keeps_less_speed_near_the_ends(points in points()) {
        let points: Vec<SVector<f64, 2>> = points.iter().map(|p| SVector::from(*p)).collect();
        let path = SplinePath::new(&points).unwrap();
        let inside = |i: u32| {
            let u = trajectory::Path::<2>::end(&path) * f64::from(i) / 400.0;
            trajectory::Path::<2>::joint_at(&path, u).q[0].amax() < 1.95
        };
        prop_assume!((0..=400).all(inside));
        let (limits, options) = (limits(), TimingOptions::default());
        let timed = time_path(&path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        let most = worst(&timed.trajectory, &limits);
        prop_assert!(most <= 1.0 + 1e-9, "{most}");
        let free = JointLimits { ends: None, ..limits };
        let free = time_path(&path, &free, &ToolLimits::UNLIMITED, &options).unwrap();
        let slowed = free.trajectory.duration() * worst(&free.trajectory, &limits).max(1.0);
        let duration = timed.trajectory.duration();
        prop_assert!(duration <= slowed * 1.01, "{duration} {slowed}");
        prop_assert!(duration >= timed.certificate.lower_bound * (1.0 - 1e-9));
    }
}

/// Towards an end the limit decides; away from it, it does not.
#[test]
fn only_the_way_towards_an_end_is_slower() {
    let still = |_: &JointPoint<2>| ToolPoint::still(Isometry3::identity());
    let (far, near) = (SVector::from([0.0, 0.0]), SVector::from([1.97, 0.0]));
    let limits = limits();
    let time = |from: SVector<f64, 2>, to: SVector<f64, 2>, limits: &JointLimits<2>| {
        let line = JointLine::new(from, to, still);
        let (tool, options) = (ToolLimits::UNLIMITED, TimingOptions::default());
        let timed = time_path(&line, limits, &tool, &options).unwrap();
        (
            timed.trajectory.duration(),
            worst(&timed.trajectory, limits),
        )
    };
    let free = JointLimits {
        ends: None,
        ..limits
    };
    let (towards, most) = time(far, near, &limits);
    let (away, most_away) = time(near, far, &limits);
    let (without, _) = time(far, near, &free);
    println!("{towards:.3} s towards, {away:.3} s away, {without:.3} s without the limits");
    assert!(most <= 1.0 + 1e-9 && most_away <= 1.0 + 1e-9);
    assert!(towards > 1.1 * without, "{towards} {without}");
    assert!((away / without - 1.0).abs() < 2e-3, "{away} {without}");
}
