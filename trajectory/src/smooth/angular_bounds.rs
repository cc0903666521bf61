//! Bounds of the angular rates of a span for all of its times.

use nalgebra::Vector3;

use super::options::SmoothOptions;
use super::poly::{CHOOSE, bernstein, hull, quartic};
use super::span::Span;

/// Upper bounds of angular speed, acceleration and jerk over their limits.
///
/// Between two times the jerk is about linear: by how much it is not is told by a bound of its second derivative. The
/// acceleration and the speed follow by integration, and are bounded by their hulls. What is not known falls with the square of
/// the interval, which is halved where the bound is little above the limit.
///
/// A bound that is not above the greatest `known` of the motion does not change that, and is not made closer; of a motion
/// that exceeds a limit, nor are those within the others.
///
/// # Source
/// The error of a linear interpolation is at most an eighth of the square of the interval times the greatest second derivative:
/// P. J. Davis, "Interpolation and Approximation", 1963, theorem 3.1.1.
pub(super) fn angular_bounds(span: &Span, options: &SmoothOptions, known: [f64; 3]) -> [f64; 3] {
    let limits = &options.limits;
    let caps = [
        limits.angular_speed,
        limits.angular_acceleration,
        limits.angular_jerk,
    ];
    let whole = Stretch::whole(span, &caps);
    let bounds = whole.ratios();
    if whole.bend == 0.0 || is_known(bounds, known) {
        bounds
    } else {
        whole.halved(known, HALVINGS - 1)
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
/// How often a span is halved.
const HALVINGS: u32 = 6;
/// A bound over the limit from which a stretch is not halved whose ends exceed the limit, too.
const HOPELESS: f64 = 3.0;

/// A part of a span, from one local time to another.
struct Stretch<'a> {
    span: &'a Span,
    /// Limits of angular speed, acceleration and jerk.
    caps: &'a [f64; 3],
    /// Bound of the second derivative of the angular jerk on the whole span.
    bend: f64,
    from: f64,
    to: f64,
    /// Angular velocity, acceleration and jerk at both ends.
    ends: [[Vector3<f64>; 3]; 2],
}

impl<'a> Stretch<'a> {
    /// All of a span.
    fn whole(span: &'a Span, caps: &'a [f64; 3]) -> Self {
        Self {
            span,
            caps,
            bend: fourth(span),
            from: 0.0,
            to: span.duration,
            ends: [0.0, span.duration].map(|time| span.turning(time).1),
        }
    }

    /// The bounds over the limits, from both ends.
    fn ratios(&self) -> [f64; 3] {
        let width = self.to - self.from;
        let [[w, a, j], [.., last]] = &self.ends;
        // A polynomial whose jerk is linear, in Bernstein form.
        let acceleration = [*a, a + j * (width / 2.0), a + (j + last) * (width / 2.0)];
        let square = width * width;
        let speed = [
            *w,
            w + a * (width / 3.0),
            w + a * (width * 2.0 / 3.0) + j * (square / 6.0),
            w + a * width + (j * 2.0 + last) * (square / 6.0),
        ];
        let off = self.bend * square;
        let caps = self.caps;
        [
            hull(&speed, caps[0], 4) + off * square / (24.0 * caps[0]),
            hull(&acceleration, caps[1], 4) + off * width / (12.0 * caps[1]),
            hull(&[*j, *last], caps[2], 0) + off / (8.0 * caps[2]),
        ]
    }

    /// The bounds, from halves of the stretch that may be halved as often as is `left`.
    fn halved(&self, mut known: [f64; 3], left: u32) -> [f64; 3] {
        let middle = 0.5 * (self.from + self.to);
        let rates = self.span.turning(middle).1;
        let halves = [
            (self.from, middle, [self.ends[0], rates]),
            (middle, self.to, [rates, self.ends[1]]),
        ];
        let mut worst = [0.0; 3];
        for (from, to, ends) in halves {
            let half = Stretch {
                from,
                to,
                ends,
                ..*self
            };
            let bounds = half.bounds(known, left);
            for k in 0..3 {
                if bounds[k] > worst[k] || bounds[k].is_nan() {
                    worst[k] = bounds[k];
                }
                known[k] = known[k].max(bounds[k]);
            }
        }
        worst
    }

    /// The bounds of the stretch, which may be halved as often as is `left`.
    fn bounds(&self, known: [f64; 3], left: u32) -> [f64; 3] {
        let bounds = self.ratios();
        let most = bounds.iter().fold(0.0_f64, |most, bound| most.max(*bound));
        let exceeds = |end: &[Vector3<f64>; 3]| (0..3).any(|k| end[k].norm() > self.caps[k]);
        let hopeless = most > HOPELESS && self.ends.iter().any(exceeds);
        if left == 0 || most <= 1.0 || hopeless || is_known(bounds, known) {
            bounds
        } else {
            self.halved(known, left - 1)
        }
    }
}

/// A factor of the orientation of a span: its direction at the middle, and bounds on the span of the first four derivatives of
/// its angle (rad) and of those of its direction.
struct Factor {
    axis: Vector3<f64>,
    angle: [f64; 4],
    moved: [f64; 4],
}

/// A bound of the fourth derivative of the angular velocity on a span, which is that of the jerk's second: the derivatives of
/// the angles are polynomials of degree three, so that it comes from the moving of the axes alone.
fn fourth(span: &Span) -> f64 {
    let mut rotation = span.base;
    let mut before: Vec<Factor> = Vec::with_capacity(span.turns.len());
    let mut sum = 0.0;
    for turn in &span.turns {
        let length = turn.axis.norm();
        let axis = rotation * turn.axis / length.max(f64::MIN_POSITIVE);
        let factor = Factor {
            axis,
            angle: largest(&turn.angle, span.duration).map(|most| length * most),
            moved: moved(&before, &axis, span.duration / 2.0),
        };
        sum += moving(4, &factor.angle, &factor.moved);
        before.push(factor);
        let middle = quartic(&turn.angle, span.duration / 2.0)[0];
        rotation *= nalgebra::UnitQuaternion::from_scaled_axis(turn.axis * middle);
    }
    sum
}

/// Bounds of the first four derivatives of a direction that moves with the factors before it, on a span: with the angular
/// velocity `W` of these factors its derivative is `W x a`.
fn moved(before: &[Factor], axis: &Vector3<f64>, half: f64) -> [f64; 4] {
    // Norms of W and three derivatives, and of their parts across the direction.
    let (mut whole, mut across) = ([0.0; 4], [0.0; 4]);
    // How fast the direction moves as seen from the factor: only those between move them against each other.
    let mut drift = 0.0;
    for factor in before.iter().rev() {
        let skew = (sine(&factor.axis, axis) + half * drift).min(1.0);
        drift += factor.angle[0] * skew;
        for k in 0..4 {
            let moving = moving(k, &factor.angle, &factor.moved);
            whole[k] += factor.angle[k] + moving;
            across[k] += factor.angle[k] * skew + moving;
        }
    }
    let mut moved = [0.0; 4];
    for k in 0..4 {
        moved[k] = across[k] + moving(k, &whole, &moved);
    }
    moved
}

/// A bound of what the derivatives of a direction add to the derivative of order `order` of a rate along it, from bounds of the
/// rate and its derivatives and of those of the direction: the terms of Leibniz's rule but for the first.
fn moving(order: usize, rate: &[f64; 4], moved: &[f64; 4]) -> f64 {
    let term = |r: usize| CHOOSE[order][r] * rate[order - r] * moved[r - 1];
    (1..=order).map(term).sum()
}

/// Bounds of the first four derivatives of an angle from 0 to a time (s).
fn largest([_, c1, c2, c3, c4]: &[f64; 5], end: f64) -> [f64; 4] {
    [
        greatest(&bernstein(&[*c1, 2.0 * c2, 3.0 * c3, 4.0 * c4], 0.0, end)),
        greatest(&bernstein(&[2.0 * c2, 6.0 * c3, 12.0 * c4], 0.0, end)),
        greatest(&bernstein(&[6.0 * c3, 24.0 * c4], 0.0, end)),
        (24.0 * c4).abs(),
    ]
}

fn greatest(control: &[f64]) -> f64 {
    control.iter().fold(0.0, |most: f64, c| most.max(c.abs()))
}

/// Sine of the angle between two directions, of which one may be zero; 0 where it is rounding.
fn sine(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let sine = a.cross(b).norm();
    if sine < PARALLEL { 0.0 } else { sine }
}

/// Sine up to which two directions are the same.
const PARALLEL: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;
    use crate::smooth::spline::turns;
    use nalgebra::UnitQuaternion;

    /// A span that turns from each control orientation to the next by a rotation vector.
    fn turning(steps: [Vector3<f64>; 4], duration: f64) -> Span {
        let mut control = vec![UnitQuaternion::identity()];
        for step in steps {
            control.push(control[control.len() - 1] * UnitQuaternion::from_scaled_axis(step));
        }
        Span {
            start: 0.0,
            duration,
            point: [Vector3::zeros(); 5],
            base: control[0],
            turns: turns(&control, duration),
        }
    }

    /// The greatest angular speed, acceleration and jerk of so many samples.
    fn sampled(span: &Span, count: u32) -> [f64; 3] {
        let time = |i: u32| span.duration * f64::from(i) / f64::from(count);
        (0..=count).fold([0.0; 3], |most: [f64; 3], i| {
            let rates = span.turning(time(i)).1;
            [0, 1, 2].map(|k| most[k].max(rates[k].norm()))
        })
    }

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
            let span = turning([0.0, 1.0, 2.0, 3.0].map(|k| at(k + 1.0) - at(k)), 0.008);
            let most = sampled(&span, 200);
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

    /// A turn at nearly the largest speed, by short knots. Bounds that fell with the interval and not with its square were more
    /// than three times the limit, which is kept, over a quarter of a knot: such motions were planned again under lower limits.
    #[test]
    fn bounds_are_close_at_short_knots() {
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
        let span = turning(steps.map(Vector3::from), h);
        let most = sampled(&span, 200);
        let caps = [3.0, 30.0, 600.0];
        let whole = Stretch::whole(&span, &caps).ratios();
        let bounds = angular_bounds(&span, &SmoothOptions::new(0.01, limits), [0.0; 3]);
        assert!(most[2] < limits.angular_jerk, "{most:?}");
        assert!(whole.iter().all(|bound| *bound <= 1.02), "{whole:?}");
        assert!(bounds.iter().all(|bound| *bound <= 1.02), "{bounds:?}");
        assert!(bounds[2] >= most[2] / limits.angular_jerk, "{bounds:?}");
    }

    /// Turns by up to half a turn in one span, about axes that turn far: the whole is bounded by many times its rates, its
    /// parts closely, and no sample is above them.
    #[test]
    fn stretches_are_halved_where_axes_turn_far() {
        let mut wide = 0;
        for seed in 0..200_u32 {
            let part = |k: u32| f64::from(seed * 7 + k * 13).sin();
            let duration = 0.02 * f64::from(1 + seed % 5);
            let step = |k: u32| Vector3::from([3 * k, 3 * k + 1, 3 * k + 2].map(|k| 0.5 * part(k)));
            let span = turning([0, 1, 2, 3].map(step), duration);
            let most = sampled(&span, 1000);
            let limits = ToolLimits {
                angular_speed: most[0],
                angular_acceleration: most[1],
                angular_jerk: most[2],
                ..ToolLimits::UNLIMITED
            };
            let whole = Stretch::whole(&span, &most).ratios();
            wide += usize::from(whole[2] > HOPELESS);
            let bounds = angular_bounds(&span, &SmoothOptions::new(0.01, limits), [0.0; 3]);
            for k in 0..3 {
                assert!(whole[k] >= 1.0 - 1e-9 && bounds[k] >= 1.0 - 1e-9, "{seed}");
                assert!(bounds[k] <= 1.02, "{seed}: {bounds:?}");
            }
        }
        assert!(wide >= 10, "{wide}");
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
                let step =
                    |k| Vector3::new(0.024, 0.004 * angle(k), 0.002 * angle(k + 1)) * angle(5);
                let span = turning([0, 1, 2, 3].map(step), 0.008);
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
