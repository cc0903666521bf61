//! Properties of path timing from a start in motion.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use measure::RandomPaths;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use trajectory::{
    Boundary, JointLimits, Path, PathPoint, SplinePath, TimingOptions, ToolLimits, time_path,
};

/// The rest of a path from a parameter on.
struct Rest<'a> {
    whole: &'a SplinePath<4>,
    from: f64,
    knots: Vec<f64>,
}

impl<'a> Rest<'a> {
    fn new(whole: &'a SplinePath<4>, from: f64) -> Self {
        let mut knots: Vec<f64> = whole.knots().iter().map(|u| u - from).collect();
        knots.retain(|u| *u > 0.0);
        knots.insert(0, 0.0);
        Self { whole, from, knots }
    }
}

impl Path<4> for Rest<'_> {
    fn end(&self) -> f64 {
        self.whole.end() - self.from
    }
    fn knots(&self) -> &[f64] {
        &self.knots
    }
    fn at(&self, u: f64) -> PathPoint<4> {
        self.whole.at(self.from + u)
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 40, rng_seed: RngSeed::Fixed(43), ..ProptestConfig::default()
    })]

    /// Planned on from a state of its own motion, with a little more room than that needs, a path
    /// takes no longer than what was left, keeps the limits, and joins in position, velocity and
    /// acceleration.
    #[test]
    fn goes_on_from_its_own_state(seed in 0_u64..1000, share in 0.05..0.9_f64) {
        let path = RandomPaths::<4>::new(seed, 5).next().unwrap();
        let (first, room) =
            (JointLimits::uniform(1.9, 9.5, 95.0), JointLimits::uniform(2.0, 10.0, 100.0));
        let options = TimingOptions::default();
        let whole = time_path(&path, &first, &ToolLimits::UNLIMITED, &options).unwrap();
        let t = share * whole.trajectory.duration();
        let (state, law) = (whole.trajectory.sample(t), whole.law.sample(t));
        let rest = Rest::new(&path, law.position[0]);
        let start =
            Boundary::Moving { rate: law.velocity[0], acceleration: law.acceleration[0] };
        let options = TimingOptions { start, ..options };
        let timed = time_path(&rest, &room, &ToolLimits::UNLIMITED, &options).unwrap();
        prop_assert!(timed.certificate.holds());
        let left = whole.trajectory.duration() - t;
        prop_assert!(timed.trajectory.duration() <= left * 1.001);
        let join = timed.trajectory.sample(0.0);
        prop_assert!((join.position - state.position).amax() < 1e-7);
        prop_assert!((join.velocity - state.velocity).amax() < 1e-5);
        prop_assert!((join.acceleration - state.acceleration).amax() < 1e-3);
    }
}

/// A state that no braking can save is refused, with a number.
#[test]
fn refuses_what_cannot_be_braked() {
    let path = RandomPaths::<4>::new(5, 3).next().unwrap();
    let limits = JointLimits::uniform(2.0, 10.0, 100.0);
    let start = Boundary::Moving {
        rate: 50.0,
        acceleration: 0.0,
    };
    let options = TimingOptions {
        start,
        ..TimingOptions::default()
    };
    let refused = time_path(&path, &limits, &ToolLimits::UNLIMITED, &options).unwrap_err();
    assert!(
        refused.to_string().contains("start state exceeds"),
        "{refused}"
    );
}
