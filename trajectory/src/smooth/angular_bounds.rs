//! Bounds of the angular rates of a span for all of its times.

use nalgebra::Vector3;

use super::options::SmoothOptions;
use super::poly::{hull, quartic};
use super::span::Span;

/// Upper bounds of angular speed, acceleration and jerk over their limits.
///
/// On each of a few intervals the world axes of the rotations, and what their moving adds, are fixed at the
/// middle, which leaves a polynomial, bounded by its hull. How both change is bounded by norms and added: less
/// on shorter intervals, into which an interval is divided where the bound is little above the limit.
///
/// A bound that is not above the greatest `known` of the motion does not change that, and is not made closer; of a motion
/// that exceeds a limit, nor are those within the others.
pub(super) fn angular_bounds(span: &Span, options: &SmoothOptions, known: [f64; 3]) -> [f64; 3] {
    let limits = &options.limits;
    let caps = [
        limits.angular_speed,
        limits.angular_acceleration,
        limits.angular_jerk,
    ];
    let whole = [0.0, span.duration];
    let (bounds, _) = ratios(span, whole, &caps);
    if span.turns.len() == 1 || is_known(bounds, known) {
        bounds
    } else {
        divided(span, whole, (&caps, known), DIVISIONS)
    }
}

/// Whether bounds say nothing of a motion that is not known. One that keeps its limits: none is above the greatest, and
/// none is nearly at its limit. One that does not: none is above its limit and the greatest.
fn is_known(bounds: [f64; 3], known: [f64; 3]) -> bool {
    let broken = known.iter().any(|known| *known > BROKEN);
    let most = known.map(|known| {
        if broken {
            known.max(1.0)
        } else {
            known.min(ACTIVE)
        }
    });
    (0..3).all(|k| bounds[k] <= most[k])
}

/// A limit used to this share is active.
pub(super) const ACTIVE: f64 = 0.98;
/// A ratio from which on a motion does not keep its limits.
const BROKEN: f64 = 1.0 + 1e-6;
/// Parts into which an interval is divided, and how often.
const PARTS: u32 = 4;
const DIVISIONS: u32 = 3;
/// A bound over the limit from which an interval is not divided whose middle exceeds the limit, too.
const HOPELESS: f64 = 3.0;

/// The bounds on an interval from the bounds on its parts.
fn divided(
    span: &Span,
    [from, to]: [f64; 2],
    (caps, mut known): (&[f64; 3], [f64; 3]),
    left: u32,
) -> [f64; 3] {
    let width = (to - from) / f64::from(PARTS);
    let mut worst = [0.0; 3];
    for part in 0..PARTS {
        let from = from + width * f64::from(part);
        let bounds = bounds_within(span, [from, from + width], (caps, known), left);
        for k in 0..3 {
            if bounds[k] > worst[k] || bounds[k].is_nan() {
                worst[k] = bounds[k];
            }
            known[k] = known[k].max(bounds[k]);
        }
    }
    worst
}

/// The bounds on an interval, which may be divided as often as is `left`.
fn bounds_within(
    span: &Span,
    interval: [f64; 2],
    (caps, known): (&[f64; 3], [f64; 3]),
    left: u32,
) -> [f64; 3] {
    let (bounds, exceeded) = ratios(span, interval, caps);
    let most = bounds.iter().fold(0.0_f64, |most, bound| most.max(*bound));
    let hopeless = exceeded && most > HOPELESS;
    if left == 0 || most <= 1.0 || hopeless || is_known(bounds, known) {
        bounds
    } else {
        divided(span, interval, (caps, known), left - 1)
    }
}

/// The bounds over the limits on an interval as a whole, and whether its middle exceeds one.
fn ratios(span: &Span, [from, to]: [f64; 2], caps: &[f64; 3]) -> ([f64; 3], bool) {
    let (bounds, middle) = angular_stretch(span, from, to);
    let exceeded = (0..3).any(|k| middle[k] > caps[k]);
    ([0, 1, 2].map(|k| bounds[k] / caps[k]), exceeded)
}

/// Bounds of the norms of angular velocity and its two derivatives on the
/// local interval `[from, to]`, rad/s, rad/s2, rad/s3, and these norms at its middle.
fn angular_stretch(span: &Span, from: f64, to: f64) -> ([f64; 3], [f64; 3]) {
    let half = (to - from) / 2.0;
    let mut rotation = span.base;
    let (mut rate, mut rate2, mut rate3) = (
        [Vector3::zeros(); 4],
        [Vector3::zeros(); 3],
        [Vector3::zeros(); 2],
    );
    let mut moving = Moving::default();
    let mut axes: Vec<Vector3<f64>> = Vec::with_capacity(span.turns.len());
    for turn in &span.turns {
        let [middle, now1, now2, now3] = quartic(&turn.angle, from + half);
        let axis = rotation * turn.axis;
        let (first, second, third) = rates([now1, now2, now3, 24.0 * turn.angle[4]], half);
        let most = [largest(&first), largest(&second), largest(&third)];
        // The axis turns with the factors before it; if they have the same direction, it does not
        // turn.
        let skew = axes
            .iter()
            .fold(0.0_f64, |worst, other| worst.max(sine(other, &axis)));
        let skew = if skew < 1e-12 {
            0.0
        } else {
            (skew + 2.0 * moving.before * half).min(1.0)
        };
        moving.add(&axis, most, [now1, now2], [skew, half]);
        for (sum, c) in rate.iter_mut().zip(first) {
            *sum += axis * c;
        }
        for (sum, c) in rate2.iter_mut().zip(second) {
            *sum += axis * c;
        }
        for (sum, c) in rate3.iter_mut().zip(third) {
            *sum += axis * c;
        }
        axes.push(axis);
        rotation *= nalgebra::UnitQuaternion::from_scaled_axis(turn.axis * middle);
    }
    let rate2 = rate2.map(|sum| sum + moving.added[0]);
    let rate3 = rate3.map(|sum| sum + moving.added[1]);
    let bounds = [
        hull(&rate, 1.0, 4) + moving.rest[0],
        hull(&rate2, 1.0, 4) + moving.rest[1],
        hull(&rate3, 1.0, 0) + moving.rest[2],
    ];
    // The third derivative of an angle is linear.
    let [w, a] = moving.now;
    let middle = [w.norm(), a.norm(), ((rate3[0] + rate3[1]) * 0.5).norm()];
    (bounds, middle)
}

/// Bernstein forms of the first three derivatives of an angle on an interval, from its derivatives at the middle and
/// half of its width.
fn rates([d1, d2, d3, d4]: [f64; 4], half: f64) -> ([f64; 4], [f64; 3], [f64; 2]) {
    let square = half * half;
    let even = [d1 + 0.5 * d3 * square, d1 - d3 * square / 6.0];
    let odd = [
        (d2 + d4 * square / 6.0) * half,
        (d2 / 3.0 - d4 * square / 6.0) * half,
    ];
    let (bend, slope) = (0.5 * d4 * square, d3 * half);
    (
        [
            even[0] - odd[0],
            even[1] - odd[1],
            even[1] + odd[1],
            even[0] + odd[0],
        ],
        [d2 - slope + bend, d2 - bend, d2 + slope + bend],
        [d3 - d4 * half, d3 + d4 * half],
    )
}

/// What comes of axes that move with the factors before them.
#[derive(Default)]
struct Moving {
    /// Bounds of the angular velocity of the factors before, of both parts of its derivative (along their axes,
    /// and from the turning of these), and of the second derivative.
    before: f64,
    along: f64,
    across: f64,
    before2: f64,
    /// Angular velocity and its derivative at the middle.
    now: [Vector3<f64>; 2],
    /// What is added there to the first two derivatives of the angular velocity.
    added: [Vector3<f64>; 2],
    /// By how much the angular velocity and these derivatives may be off on the interval.
    rest: [f64; 3],
}

impl Moving {
    /// Adds a factor: the largest of three derivatives of its angle, the first two at the middle, a bound of the
    /// sine between its axis and those before, and half of the interval.
    fn add(
        &mut self,
        axis: &Vector3<f64>,
        [m1, m2, m3]: [f64; 3],
        [now1, now2]: [f64; 2],
        [skew, half]: [f64; 2],
    ) {
        let length = axis.norm();
        let axis1 = length * self.before * skew;
        let axis2 = length * (self.along * skew + self.across) + self.before * axis1;
        let axis3 = if skew > 0.0 {
            let turned = 2.0 * (self.along + self.across) * axis1 + self.before * axis2;
            length * self.before2 + turned
        } else {
            0.0
        };
        let drift = axis1 * half;
        self.rest[0] += m1 * drift;
        self.rest[1] += m2 * drift + half * (m2 * axis1 + m1 * axis2);
        self.rest[2] += m3 * drift + half * (2.0 * m3 * axis1 + 3.0 * m2 * axis2 + m1 * axis3);
        self.before2 += length * m3 + 2.0 * m2 * axis1 + m1 * axis2;
        self.along += length * m2;
        self.across += axis1 * m1;
        self.before += length * m1;
        let [w, a] = self.now;
        let moved = w.cross(axis);
        let moved2 = a.cross(axis) + w.cross(&moved);
        self.added[0] += moved * now1;
        self.added[1] += moved * (2.0 * now2) + moved2 * now1;
        self.now = [w + axis * now1, a + axis * now2 + moved * now1];
    }
}

fn largest<const M: usize>(control: &[f64; M]) -> f64 {
    control.iter().fold(0.0, |worst: f64, c| worst.max(c.abs()))
}

/// Sine of the angle between two vectors; 0 when either vanishes.
fn sine(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let product = a.norm() * b.norm();
    if product > 0.0 {
        a.cross(b).norm() / product
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;
    use crate::smooth::spline::turns;
    use nalgebra::UnitQuaternion;

    /// The bounds are not below what is sampled, and within limits that are hardly above it where the axis turns fast:
    /// as a corner that turns is passed at full angular speed. Bounds that added norms in place of vectors were up to
    /// 1.7 times as large, and a motion that held its limits was planned again under narrower ones.
    #[test]
    fn bounds_are_close_at_turning_axes() {
        for seed in 0..40_u32 {
            let angle = |k: u32| 0.9 * f64::from(seed * 7 + k * 13).sin();
            // Velocity, acceleration and jerk of about 3 rad/s, 15 rad/s2 and 300 rad/s3.
            let at = |k: f64| {
                let t = 0.008 * k;
                Vector3::new(
                    3.0 * t + 50.0 * t.powi(3) * angle(1),
                    7.5 * t * t * angle(2),
                    50.0 * t.powi(3) * angle(3),
                )
            };
            let mut control = vec![UnitQuaternion::identity()];
            for k in 0..4 {
                let step = at(f64::from(k + 1)) - at(f64::from(k));
                control.push(control[control.len() - 1] * UnitQuaternion::from_scaled_axis(step));
            }
            let span = Span {
                start: 0.0,
                duration: 0.008,
                point: [Vector3::zeros(); 5],
                base: control[0],
                turns: turns(&control, 0.008),
            };
            let samples = (0..=200).map(|i| span.at(0.008 * f64::from(i) / 200.0).angular);
            let most = samples.fold([0.0_f64; 3], |most, rates| {
                [0, 1, 2].map(|k| most[k].max(rates[k].norm()))
            });
            let limits = ToolLimits {
                angular_speed: 1.15 * most[0],
                angular_acceleration: 1.15 * most[1],
                angular_jerk: 1.15 * most[2],
                ..ToolLimits::UNLIMITED
            };
            let bounds = angular_bounds(&span, &SmoothOptions::new(0.01, limits), [0.0; 3]);
            for bound in bounds {
                assert!((1.0 / 1.151..=1.0).contains(&bound), "{seed}: {bounds:?}");
            }
        }
    }

    /// A turn at nearly the largest speed, by short knots: over a quarter of a knot the bound of the jerk is more than
    /// three times the limit, which is kept. Such motions were planned again under limits lower by that much.
    #[test]
    fn wide_bounds_are_divided() {
        let limits = ToolLimits {
            angular_speed: 3.0,
            angular_acceleration: 30.0,
            angular_jerk: 600.0,
            ..ToolLimits::UNLIMITED
        };
        // Of random list 123.
        let steps = [
            [2.083_328e-3, -1.352_038e-3, 2.220_967e-3],
            [2.097_878e-3, -1.361_481e-3, 2.236_479e-3],
            [2.111_783e-3, -1.370_505e-3, 2.251_303e-3],
            [2.125_058e-3, -1.379_120e-3, 2.265_454e-3],
        ];
        let h = 1.211_206e-3;
        let mut control = vec![UnitQuaternion::identity()];
        for step in steps {
            let step = UnitQuaternion::from_scaled_axis(Vector3::from(step));
            control.push(control[control.len() - 1] * step);
        }
        let span = Span {
            start: 0.0,
            duration: h,
            point: [Vector3::zeros(); 5],
            base: control[0],
            turns: turns(&control, h),
        };
        let samples = (0..=200).map(|i| span.at(h * f64::from(i) / 200.0).angular);
        let most = samples.fold([0.0_f64; 3], |most, rates| {
            [0, 1, 2].map(|k| most[k].max(rates[k].norm()))
        });
        let whole = angular_stretch(&span, 0.0, 0.25 * h).0;
        let bounds = angular_bounds(&span, &SmoothOptions::new(0.01, limits), [0.0; 3]);
        assert!(most[2] < limits.angular_jerk, "{most:?}");
        assert!(whole[2] > HOPELESS * limits.angular_jerk, "{whole:?}");
        assert!(bounds.iter().all(|bound| *bound <= 1.02), "{bounds:?}");
        assert!(bounds[2] >= most[2] / limits.angular_jerk, "{bounds:?}");
    }

    /// Bounds that are not made closer where they are below what is known of a motion do not change its greatest, whether
    /// it keeps its limits or not.
    #[test]
    fn what_is_known_does_not_change_the_greatest() {
        for most in [0.5, 0.9, 1.5, 4.0] {
            let limits = ToolLimits {
                angular_speed: 3.0 / most,
                angular_acceleration: 15.0 / most,
                angular_jerk: 300.0 / most,
                ..ToolLimits::UNLIMITED
            };
            let options = SmoothOptions::new(0.01, limits);
            let (mut plain, mut known, mut coarse) = ([0.0_f64; 3], [0.0_f64; 3], 0);
            for seed in 0..60_u32 {
                let angle = |k: u32| 0.9 * f64::from(seed * 7 + k * 13).sin();
                let mut control = vec![UnitQuaternion::identity()];
                for k in 0..4 {
                    let step = Vector3::new(0.024, 0.004 * angle(k), 0.002 * angle(k + 1));
                    let step = UnitQuaternion::from_scaled_axis(step * angle(5));
                    control.push(control[control.len() - 1] * step);
                }
                let span = Span {
                    start: 0.0,
                    duration: 0.008,
                    point: [Vector3::zeros(); 5],
                    base: control[0],
                    turns: turns(&control, 0.008),
                };
                let close = angular_bounds(&span, &options, [0.0; 3]);
                let bounds = angular_bounds(&span, &options, known);
                coarse += usize::from(bounds != close);
                for k in 0..3 {
                    plain[k] = plain[k].max(close[k]);
                    known[k] = known[k].max(bounds[k]);
                }
            }
            let exceeded = |greatest: [f64; 3]| greatest.map(|ratio| ratio.max(1.0));
            let keeps = plain.iter().all(|ratio| *ratio <= 1.0);
            if keeps {
                assert_eq!(plain, known);
            }
            assert_eq!(exceeded(plain), exceeded(known));
            assert!(coarse >= 10, "{coarse}");
        }
    }
}
