//! Properties of path timing.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use nalgebra::{Isometry3, SVector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use trajectory::timing::{Limit, PathTiming, about_time};
use trajectory::{
    JointLimits, JointLine, JointPoint, SplinePath, Timed, TimingOptions, ToolLimits, ToolPoint,
    time_path,
};

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 48,
        rng_seed: RngSeed::Fixed(40),
        ..ProptestConfig::default()
    }
}

fn spline(points: &[[f64; 3]]) -> SplinePath<3> {
    let points: Vec<SVector<f64, 3>> = points.iter().map(|p| SVector::from(*p)).collect();
    SplinePath::new(&points).unwrap()
}

fn time(path: &SplinePath<3>, limits: &JointLimits<3>) -> Timed<3> {
    time_path(
        path,
        limits,
        &ToolLimits::UNLIMITED,
        &TimingOptions::default(),
    )
    .unwrap()
}

/// Largest ratios of velocity, acceleration and jerk at many samples.
fn sampled(timed: &Timed<3>, limits: &JointLimits<3>) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    let count = 20_000;
    for i in 0..=count {
        let t = timed.trajectory.duration() * f64::from(i) / f64::from(count);
        let s = timed.trajectory.sample(t);
        most[0] = most[0].max(s.velocity.component_div(&limits.velocity).amax());
        most[1] = most[1].max(s.acceleration.component_div(&limits.acceleration).amax());
        most[2] = most[2].max(s.jerk.component_div(&limits.jerk).amax());
    }
    most
}

prop_compose! {
    fn limits()(v in 0.2..4.0_f64, a in 0.5..30.0_f64, j in 5.0..1000.0_f64) -> JointLimits<3> {
        JointLimits::uniform(v, a, j)
    }
}

/// A look at a few places tells about how long a path takes: enough to compare paths.
#[test]
fn a_look_at_a_few_places_is_near() {
    let limits = JointLimits::uniform(2.0, 10.0, 200.0);
    let options = TimingOptions::default();
    let mut worst = 0.0_f64;
    for k in 0..40 {
        let at = |i: i32, j: i32| f64::from(17 * k + 5 * i + 3 * j).sin();
        let points: Vec<[f64; 3]> = (0..12).map(|i| [0, 1, 2].map(|j| at(i, j))).collect();
        let path = spline(&points);
        let about = about_time(&path, &limits, &ToolLimits::UNLIMITED).unwrap();
        let timing = PathTiming::new(&path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        worst = worst.max((about / timing.expected() - 1.0).abs());
    }
    assert!(worst < 0.05, "{worst}");
    let bad = JointLimits::uniform(0.0, 10.0, 200.0);
    let path = spline(&[[0.0; 3], [1.0; 3]]);
    assert!(about_time(&path, &bad, &ToolLimits::UNLIMITED).is_err());
}

fn waypoints() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64), 2..9)
}

proptest! {
    #![proptest_config(config())]

    /// A search that is told of a faster motion ends early; one that is told of a slower motion finds
    /// what it finds without.
    #[test]
    fn a_limit_of_time_only_ends_what_is_slower(points in waypoints(), limits in limits()) {
        let path = spline(&points);
        let (tool, options) = (ToolLimits::UNLIMITED, TimingOptions::default());
        let timing = PathTiming::new(&path, &limits, &tool, &options).unwrap();
        let best = timing.solve().unwrap();
        let time = best.trajectory.duration();
        for factor in [0.3, 0.9, 0.99] {
            prop_assert!(timing.solve_below(factor * time).unwrap().is_none());
        }
        for factor in [1.01, 1.1, 3.0] {
            let found = timing.solve_below(factor * time).unwrap();
            prop_assert_eq!(found.as_ref(), Some(&best));
        }
    }

    /// The certificate holds, samples agree with it, and the motion starts and ends at rest.
    #[test]
    fn certificate_holds(points in waypoints(), limits in limits()) {
        let path = spline(&points);
        let timed = time(&path, &limits);
        prop_assert!(timed.certificate.holds());
        prop_assert!(timed.certificate.fit_error < 1e-7);
        for ratio in sampled(&timed, &limits) {
            prop_assert!(ratio <= 1.0 + 1e-9);
        }
        let duration = timed.trajectory.duration();
        for (t, wanted) in [(0.0, points[0]), (duration, points[points.len() - 1])] {
            let s = timed.trajectory.sample(t);
            prop_assert!((s.position - SVector::from(wanted)).amax() < 1e-9);
            prop_assert!(s.velocity.amax() < 1e-9 && s.acceleration.amax() < 1e-6);
        }
        prop_assert!(duration >= timed.certificate.lower_bound * (1.0 - 1e-9));
    }

    /// Limits of velocity, acceleration and jerk that grow by k, k² and k³ make it k times as fast.
    #[test]
    fn scales_with_limits(points in waypoints(), limits in limits(), k in 0.1..10.0_f64) {
        let path = spline(&points);
        let faster = JointLimits {
            velocity: limits.velocity * k,
            acceleration: limits.acceleration * (k * k),
            jerk: limits.jerk * (k * k * k),
            ..limits
        };
        let (slow, fast) = (time(&path, &limits), time(&path, &faster));
        let ratio = slow.trajectory.duration() / (fast.trajectory.duration() * k);
        prop_assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
}

/// From a nanometre to a kilometre a straight line is timed, near its textbook duration.
#[test]
fn straight_lines_of_any_length() {
    let still = |_: &JointPoint<2>| ToolPoint::still(Isometry3::identity());
    let limits = JointLimits::uniform(2.0, 10.0, 100.0);
    let start = SVector::<f64, 2>::new(1.0, 1.0);
    for (length, textbook) in [
        (1e-6, 0.006_840),
        (1e-3, 0.068_4),
        (1.0, 0.8),
        (100.0, 50.3),
    ] {
        let end = start + SVector::<f64, 2>::new(length, -0.3 * length);
        let line = JointLine::new(start, end, still);
        let options = TimingOptions::default();
        let timed = time_path(&line, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        assert!(timed.certificate.holds());
        let ratio = timed.trajectory.duration() / textbook;
        assert!(ratio > 0.999 && ratio < 1.04, "{length}: {ratio}");
    }
}

/// Something always decides the speed: nearly all of the motion has an active limit.
#[test]
fn some_limit_is_active() {
    let path = spline(&[
        [0.0, 0.0, 0.0],
        [1.0, -1.0, 0.5],
        [0.2, 0.3, -1.0],
        [1.0, 1.0, 1.0],
    ]);
    let timed = time(&path, &JointLimits::uniform(1.0, 5.0, 50.0));
    let certificate = &timed.certificate;
    assert!(certificate.ratio(|limit| matches!(limit, Limit::JointJerk(_))) > 0.98);
    let mut covered = 0.0;
    let mut until = 0.0_f64;
    for span in &certificate.active {
        covered += (span.end - span.start.max(until)).max(0.0);
        until = until.max(span.end);
    }
    assert!(
        covered > 0.7 * certificate.duration,
        "{covered} of {}",
        certificate.duration
    );
}

/// Near-duplicate waypoints, reversals, nothing but repeats, very many waypoints: all are timed
/// and certified, and what does not move at all is refused by name.
#[test]
fn awkward_paths() {
    let limits = JointLimits::uniform(2.0, 10.0, 100.0);
    let a = [0.0, 0.0, 0.0];
    let b = [1.0, 0.5, -0.3];
    let near = [1.0 + 1e-6, 0.5, -0.3];
    let many: Vec<[f64; 3]> = (0..200)
        .map(|i| {
            [
                f64::from(i) * 0.01,
                f64::from(i % 7) * 0.05,
                f64::from(i % 2) * 0.02,
            ]
        })
        .collect();
    let cases = [vec![a, b, near, a], vec![a, b, a], vec![a, a, b, b], many];
    for points in &cases {
        let timed = time(&spline(points), &limits);
        assert!(timed.certificate.holds() && timed.certificate.fit_error < 1e-7);
        assert!(
            timed.certificate.stretch < 1.05,
            "{}",
            timed.certificate.stretch
        );
    }
    let still = time_path(
        &spline(&[a, a]),
        &limits,
        &ToolLimits::UNLIMITED,
        &TimingOptions::default(),
    );
    assert!(still.is_err());
}

/// Ten cells or ten thousand: the certificate holds; more cells are not slower.
#[test]
fn any_number_of_cells() {
    let path = spline(&[
        [0.0, 0.0, 0.0],
        [1.0, -1.0, 0.5],
        [0.2, 0.3, -1.0],
        [1.0, 1.0, 1.0],
    ]);
    let limits = JointLimits::uniform(2.0, 10.0, 100.0);
    let mut last = f64::INFINITY;
    for cells in [10, 100, 1000, 10_000] {
        let options = TimingOptions {
            cells: Some(cells),
            ..TimingOptions::default()
        };
        let timed = time_path(&path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        let certificate = &timed.certificate;
        assert!(certificate.holds());
        assert!(
            certificate.duration < last * 1.002,
            "{cells}: {}",
            certificate.duration
        );
        last = certificate.duration;
    }
}

/// A fine law takes less time than one with few cells along long paths with narrow bends, within every limit, and is hardly
/// stretched for that.
#[test]
fn a_fine_law_follows_narrow_bends() {
    let limits = JointLimits::uniform(1.5, 20.0, 800.0);
    let law = |path: &SplinePath<3>, fine: bool| {
        let options = TimingOptions {
            fine,
            ..TimingOptions::default()
        };
        let timed = time_path(path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        let most = sampled(&timed, &limits);
        assert!(most.iter().all(|ratio| *ratio < 1.0 + 1e-9), "{most:?}");
        timed
    };
    let mut times = [0.0; 2];
    for seed in 1..=12 {
        let place = |i: u32, joint: u32| {
            let along = if joint == 0 { f64::from(i / 3) } else { 0.0 };
            0.4 * along + 0.3 * f64::from(seed * (3 + joint) * i / 3).sin()
        };
        let points: Vec<_> = (0..90)
            .map(|i| [0, 1, 2].map(|joint| place(i, joint)))
            .collect();
        let path = spline(&points);
        let [coarse, fine] = [false, true].map(|fine| law(&path, fine));
        assert!(fine.certificate.stretch < 1.001, "seed {seed}");
        let both = [coarse, fine].map(|timed| timed.trajectory.duration());
        assert!(both[1] < both[0], "seed {seed}: {both:?}");
        times = [times[0] + both[0], times[1] + both[1]];
    }
    assert!(times[1] < 0.96 * times[0], "{times:?}");
}
