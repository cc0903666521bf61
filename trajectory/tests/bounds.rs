//! Bounds of a motion for all times, compared with dense samples.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3, vector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use realtime::Piece;
use trajectory::bounds::{Held, JointsToTool, Leg};
use trajectory::timing::Limit;
use trajectory::{JointLimits, JointPoint, MotionBounds, ToolLimits, ToolPoint, Trajectory};

/// Two links of 0.5 m and 0.4 m that turn about z.
struct Planar;

const LINKS: [f64; 2] = [0.5, 0.4];

impl JointsToTool<2> for Planar {
    fn motion(&self, joints: &JointPoint<2>) -> ToolPoint {
        let z = Vector3::z();
        let mut place = Vector3::zeros();
        let mut linear = [Vector3::zeros(); 3];
        let mut angle = [0.0; 4];
        for (i, length) in LINKS.iter().enumerate() {
            for (sum, q) in angle.iter_mut().zip(&joints.q) {
                *sum += q[i];
            }
            let [a, w, dw, ddw] = angle;
            let r = Vector3::new(a.cos(), a.sin(), 0.0) * *length;
            let side = z.cross(&r);
            place += r;
            linear[0] += side * w;
            linear[1] += side * dw - r * (w * w);
            linear[2] += side * (ddw - w * w * w) - r * (3.0 * w * dw);
        }
        let turn = UnitQuaternion::from_scaled_axis(z * angle[0]);
        ToolPoint {
            pose: Isometry3::from_parts(Translation3::from(place), turn),
            linear,
            angular: [z * angle[1], z * angle[2], z * angle[3]],
        }
    }

    fn growth(&self, joints: &[SVector<f64, 2>; 6]) -> ([f64; 9], [f64; 8]) {
        let (mut linear, mut angular) = ([0.0; 9], [0.0; 8]);
        let mut angle = [0.0; 9];
        for (i, length) in LINKS.iter().enumerate() {
            for k in 1..6 {
                angle[k] += joints[k][i];
            }
            // exp of a power series.
            let mut turned = [1.0; 9];
            for k in 1..9 {
                let sum: f64 = (1..=k).map(|j| j as f64 * angle[j] * turned[k - j]).sum();
                turned[k] = sum / k as f64;
            }
            for k in 0..9 {
                linear[k] += length * turned[k];
            }
        }
        for k in 0..5 {
            angular[k] = (k + 1) as f64 * angle[k + 1];
        }
        (linear, angular)
    }
}

const TOOL: ToolLimits = ToolLimits {
    speed: 0.7,
    acceleration: 3.0,
    jerk: 40.0,
    angular_speed: 2.0,
    angular_acceleration: 9.0,
    angular_jerk: 120.0,
};

fn bounds(trajectory: &Trajectory<2>) -> MotionBounds<2> {
    let joints = JointLimits::uniform(1.5, 6.0, 80.0);
    let held = Held {
        joints: &joints,
        tool: &TOOL,
        place: 1e-7,
    };
    MotionBounds::new(trajectory, &Planar, &held)
}

/// The largest ratio to a limit over `count` samples of each piece.
fn sampled(trajectory: &Trajectory<2>, limit: Limit, count: usize) -> f64 {
    let ratio = |piece: &Piece<2>, i: usize| {
        let s = piece.sample(piece.duration * i as f64 / count as f64);
        let q = [s.position, s.velocity, s.acceleration, s.jerk];
        let tool = Planar.motion(&JointPoint { q });
        match limit {
            Limit::JointVelocity(j) => s.velocity[j].abs() / 1.5,
            Limit::JointAcceleration(j) => s.acceleration[j].abs() / 6.0,
            Limit::JointJerk(j) => s.jerk[j].abs() / 80.0,
            Limit::ToolSpeed => tool.linear[0].norm() / TOOL.speed,
            Limit::ToolAcceleration => tool.linear[1].norm() / TOOL.acceleration,
            Limit::ToolJerk => tool.linear[2].norm() / TOOL.jerk,
            Limit::AngularSpeed => tool.angular[0].norm() / TOOL.angular_speed,
            Limit::AngularAcceleration => tool.angular[1].norm() / TOOL.angular_acceleration,
            Limit::AngularJerk => tool.angular[2].norm() / TOOL.angular_jerk,
            Limit::Rate => 0.0,
        }
    };
    let pieces = trajectory.pieces().iter();
    let all = pieces.flat_map(|piece| (0..=count).map(move |i| ratio(piece, i)));
    all.fold(0.0, f64::max)
}

/// The arm is stretched out between two of the four samples of a long piece: those do not see the
/// peak of the speed, the bound does, and says when.
#[test]
fn a_peak_between_samples_is_seen() {
    let zero = SVector::zeros();
    let piece = Piece {
        duration: 2.0,
        coefficients: [
            vector![0.0, -1.5],
            vector![0.9, 2.0],
            zero,
            zero,
            zero,
            zero,
        ],
    };
    let motion = Trajectory::new(vec![piece]);
    let (few, many) = (
        sampled(&motion, Limit::ToolSpeed, 4),
        sampled(&motion, Limit::ToolSpeed, 100_000),
    );
    assert!(few < 0.99 * many, "{few} {many}");
    let found = bounds(&motion);
    let ratio = found.ratio(Limit::ToolSpeed);
    assert!(ratio >= many && ratio < 1.002 * many, "{ratio} {many}");
    let peak = found
        .peaks
        .iter()
        .find(|peak| peak.limit == Limit::ToolSpeed);
    let time = peak.unwrap().time;
    let there = motion.sample(time);
    let q = [
        there.position,
        there.velocity,
        there.acceleration,
        there.jerk,
    ];
    let speed = Planar.motion(&JointPoint { q }).linear[0].norm() / TOOL.speed;
    assert!(
        speed > 0.995 * many,
        "{speed} at {time} s, {many} at the peak"
    );
}

/// A rate that vanishes at all four samples of a piece and is large between them.
#[test]
fn a_rate_that_vanishes_at_samples_is_seen() {
    // 0.25, 0.5, 0.75 and 1 of the piece: the derivative is their product.
    let one = |x: f64| vector![x, 0.0];
    let rate = [0.09375, -0.78125, 2.1875, -2.5, 1.0];
    let mut coefficients = [SVector::zeros(); 6];
    for k in 0..5 {
        coefficients[k + 1] = one(rate[k] * 40.0 / (k + 1) as f64);
    }
    let pieces = vec![Piece {
        duration: 1.0,
        coefficients,
    }];
    let motion = Trajectory::new(pieces);
    for limit in [Limit::JointVelocity(0), Limit::ToolSpeed, Limit::ToolJerk] {
        let (many, ratio) = (
            sampled(&motion, limit, 100_000),
            bounds(&motion).ratio(limit),
        );
        assert!(
            ratio >= many && ratio < 1.003 * many,
            "{limit}: {ratio} {many}"
        );
    }
}

/// Slowing down by the factor that the bounds ask for makes every bound one at most, and the
/// bounds of the slower motion are those that were scaled.
#[test]
fn slower_is_within_limits() {
    let zero = SVector::zeros();
    let piece = Piece {
        duration: 0.4,
        coefficients: [
            zero,
            vector![1.0, -2.0],
            vector![3.0, 2.0],
            vector![-20.0, 9.0],
            zero,
            zero,
        ],
    };
    let motion = Trajectory::new(vec![piece; 1]);
    let found = bounds(&motion);
    let slower = found.slower() * (1.0 + 1e-12);
    assert!(slower > 1.0);
    let (scaled, again) = (found.stretched(slower), bounds(&motion.stretched(slower)));
    for (a, b) in scaled.peaks.iter().zip(&again.peaks) {
        assert!(
            a.ratio <= 1.0 && (a.ratio - b.ratio).abs() < 2e-3 * a.ratio.max(1e-3),
            "{a:?} {b:?}"
        );
    }
    assert!((scaled.duration() - 0.4 * slower).abs() < 1e-12);
}

/// A path round a corner: no sample is farther from its leg than the bound, which is tight.
#[test]
fn legs_and_lines_bound_the_way() {
    let zero = SVector::zeros();
    let piece = |from: SVector<f64, 2>, rate: SVector<f64, 2>| Piece {
        duration: 0.3,
        coefficients: [from, rate, rate * 0.2, zero, zero, zero],
    };
    let first = piece(vector![0.1, 0.4], vector![0.5, -0.8]);
    let corner = first.sample(0.3).position;
    let motion = Trajectory::new(vec![first, piece(corner, vector![-0.6, 0.3])]);
    let place = |t: f64| {
        let s = motion.sample(t);
        let q = [s.position, s.velocity, s.acceleration, s.jerk];
        Planar.motion(&JointPoint { q }).pose.translation.vector
    };
    let ends = [place(0.0), place(0.3), place(0.6)];
    let legs = [
        Leg {
            ends: [ends[0], ends[1]],
            when: [0.0, 0.3],
        },
        Leg {
            ends: [ends[1], ends[2]],
            when: [0.3, f64::INFINITY],
        },
    ];
    let off = |t: f64| {
        let leg = if t < 0.3 { &legs[0] } else { &legs[1] };
        let way = leg.ends[1] - leg.ends[0];
        let from = place(t) - leg.ends[0];
        let share = (from.dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        (from - way * share).norm()
    };
    let most = (0..=60_000)
        .map(|i| off(f64::from(i) * 1e-5))
        .fold(0.0, f64::max);
    let found = bounds(&motion);
    let (bound, time) = found.off_legs(&legs, 0.0);
    assert!(
        bound >= most && bound < 1.002 * most + 1e-8,
        "{bound} {most}"
    );
    assert!(off(time) > 0.99 * most, "{time}");
    let line = |t: f64| {
        let way = (ends[2] - ends[0]).normalize();
        let from = place(t) - ends[0];
        (from - way * from.dot(&way)).norm()
    };
    let most = (0..=60_000)
        .map(|i| line(f64::from(i) * 1e-5))
        .fold(0.0, f64::max);
    let (bound, _) = found.off_line(&ends[0], &ends[2]);
    assert!(
        bound >= most && bound < 1.002 * most + 1e-8,
        "{bound} {most}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(11), cases: 64, ..ProptestConfig::default()
    })]

    /// Whatever the joints do, no sample is above its bound, and every bound is near a sample.
    #[test]
    fn no_sample_is_above_its_bound(
        c in prop::array::uniform6(prop::array::uniform2(-1.0..1.0_f64)),
        duration in 0.02..1.5_f64, size in 0.01..2.0_f64,
    ) {
        let mut scale = size;
        let coefficients = c.map(|c| {
            let coefficient = SVector::from(c) * scale;
            scale *= 2.0 / duration;
            coefficient
        });
        let motion = Trajectory::new(vec![Piece { duration, coefficients }]);
        let found = bounds(&motion);
        prop_assert_eq!(found.peaks.len(), 12);
        for (peak, reached) in found.peaks.iter().zip(&found.reached) {
            let most = sampled(&motion, peak.limit, 4000);
            prop_assert!(peak.ratio >= most * (1.0 - 1e-12), "{:?} {}", peak, most);
            prop_assert!(*reached <= peak.ratio);
            prop_assert!(peak.ratio <= most * 1.004 + 1e-6, "{:?} {}", peak, most);
        }
        let [lowest, highest] = found.positions;
        for i in 0..=400 {
            let at = motion.sample(duration * f64::from(i) / 400.0).position;
            prop_assert!((at - lowest).min() >= -1e-9 && (highest - at).min() >= -1e-9);
        }
    }
}
