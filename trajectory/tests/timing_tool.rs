//! Properties of path timing with tool limits, free ends and difficult paths.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use trajectory::timing::Limit;
use trajectory::{
    Boundary, JointLimits, JointPoint, Path, PathPoint, SplinePath, TimingOptions, ToolLimits,
    ToolPoint, time_path,
};

/// Three prismatic joints that carry the tool: its motion is that of the joints. The path
/// parameter is that of `inner`, run through smoothly in `span` seconds when one is given, so that
/// the joints rest at both ends.
struct Gantry {
    inner: SplinePath<3>,
    span: Option<f64>,
    knots: Vec<f64>,
}

impl Gantry {
    fn new(points: &[[f64; 3]], span: Option<f64>) -> Self {
        let points: Vec<SVector<f64, 3>> = points.iter().map(|p| SVector::from(*p)).collect();
        let inner = SplinePath::new(&points).unwrap();
        let knots = if span.is_some() {
            vec![]
        } else {
            inner.knots().to_vec()
        };
        Self { inner, span, knots }
    }

    fn joints(&self, u: f64) -> [SVector<f64, 3>; 4] {
        let Some(span) = self.span else {
            return self.inner.at(u).joint.q;
        };
        let (x, s) = (u / span, self.inner.end());
        let e = |k: i32| s / span.powi(k);
        let blend = 35.0 * x.powi(4) - 84.0 * x.powi(5) + 70.0 * x.powi(6) - 20.0 * x.powi(7);
        let v = e(1) * 140.0 * x.powi(3) * (1.0 - x).powi(3);
        let a = e(2) * 420.0 * x.powi(2) * (1.0 - x).powi(2) * (1.0 - 2.0 * x);
        let j = e(3) * 840.0 * x * (1.0 - x) * (1.0 - 5.0 * x * (1.0 - x));
        let [q0, q1, q2, q3] = self.inner.at(s * blend).joint.q;
        let first = q1 * v;
        let second = q2 * (v * v) + q1 * a;
        [
            q0,
            first,
            second,
            q3 * v.powi(3) + q2 * (3.0 * v * a) + q1 * j,
        ]
    }
}

impl Path<3> for Gantry {
    fn end(&self) -> f64 {
        self.span.unwrap_or(self.inner.end())
    }
    fn knots(&self) -> &[f64] {
        &self.knots
    }
    fn at(&self, u: f64) -> PathPoint<3> {
        let q = self.joints(u.clamp(0.0, self.end()));
        let translation = Translation3::from(q[0]);
        let pose = Isometry3::from_parts(translation, UnitQuaternion::identity());
        let turn = [Vector3::zeros(); 3];
        let tool = ToolPoint {
            pose,
            linear: [q[1], q[2], q[3]],
            angular: turn,
        };
        PathPoint {
            joint: JointPoint { q },
            tool,
        }
    }
}

fn tool() -> ToolLimits {
    ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    }
}

fn points() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-0.3..0.3_f64), 2..6)
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 32,
        rng_seed: RngSeed::Fixed(41),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    /// Tool limits hold along the motion as it is, found by differences of its own samples.
    #[test]
    fn tool_limits_hold(points in points()) {
        let path = Gantry::new(&points, None);
        let loose = JointLimits::uniform(10.0, 100.0, 5000.0);
        let timed = time_path(&path, &loose, &tool(), &TimingOptions::default()).unwrap();
        prop_assert!(timed.certificate.holds());
        let duration = timed.trajectory.duration();
        for i in 0..=5000 {
            let s = timed.trajectory.sample(duration * f64::from(i) / 5000.0);
            prop_assert!(s.velocity.norm() <= 0.5 * (1.0 + 1e-6));
            prop_assert!(s.acceleration.norm() <= 5.0 * (1.0 + 1e-4), "{}", s.acceleration.norm());
            prop_assert!(s.jerk.norm() <= 100.0 * 1.01, "{}", s.jerk.norm());
        }
        let bound = timed.certificate.lower_bound;
        prop_assert!(duration >= bound * (1.0 - 1e-9));
    }

    /// A path that is a motion already, slow enough, is not changed under a rate cap of one; a
    /// path too fast is slowed.
    #[test]
    fn free_ends(points in points(), span in 0.1..8.0_f64) {
        let path = Gantry::new(&points, Some(span));
        let limits = JointLimits::uniform(1.0, 10.0, 300.0);
        let options = TimingOptions {
            start: Boundary::Free,
            end: Boundary::Free,
            rate_cap: Some(1.0),
            ..TimingOptions::default()
        };
        let timed = time_path(&path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
        prop_assert!(timed.certificate.holds());
        let duration = timed.trajectory.duration();
        prop_assert!(duration >= span * (1.0 - 1e-9));
        let joints = timed.certificate.ratio(|limit| limit != Limit::Rate);
        prop_assert!(joints > 0.5 || duration < span * 1.003, "{joints} {duration} {span}");
    }
}
