//! Four branches at once with SIMD: vectors of four lanes, and the subproblems of closed forms.
//!
//! # Source
//! A. J. Elias and J. T. Wen, "IK-Geo: unified robot inverse kinematics using
//! subproblem decomposition", Mech. Mach. Theory 209, 2025: subproblems 1, 3 and 4.

use simd::{F4, Four, Mask};

/// Signs that tell the branches of the first choice apart.
pub(crate) const FIRST: [f64; 4] = [1.0, -1.0, 1.0, -1.0];
/// Signs that tell the branches of the second choice apart.
pub(crate) const SECOND: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

/// Sine and cosine of an angle in each lane.
#[derive(Clone, Copy)]
pub(crate) struct Angle<A: Four> {
    pub(crate) sin: F4<A>,
    pub(crate) cos: F4<A>,
}

impl<A: Four> Angle<A> {
    #[inline(always)]
    pub(crate) fn back(self) -> Self {
        Self {
            sin: -self.sin,
            cos: self.cos,
        }
    }

    /// The sum of two angles.
    #[inline(always)]
    pub(crate) fn plus(self, o: Self) -> Self {
        Self {
            sin: self.sin.fma(o.cos, self.cos * o.sin),
            cos: self.sin.taken_from(o.sin, self.cos * o.cos),
        }
    }

    /// The angle, or `held` in the lanes of `free`.
    #[inline(always)]
    fn unless(self, free: Mask<A>, held: Held) -> Self {
        let a = self.sin.build();
        Self {
            sin: free.select(F4::splat(a, held.sin), self.sin),
            cos: free.select(F4::splat(a, held.cos), self.cos),
        }
    }
}

/// The angle of a joint that a singular pose leaves free.
#[derive(Clone, Copy)]
pub(crate) struct Held {
    pub(crate) sin: f64,
    pub(crate) cos: f64,
}

impl Held {
    /// Of several angles, rad.
    #[inline(always)]
    pub(crate) fn all<A: Four, const M: usize>(a: A, angles: [f64; M]) -> [Self; M] {
        let (sin, cos) = simd::sin_cos(a, angles);
        let mut held = [Self { sin: 0.0, cos: 1.0 }; M];
        for i in 0..M {
            held[i] = Self {
                sin: sin[i],
                cos: cos[i],
            };
        }
        held
    }
}

/// A vector in each lane.
#[derive(Clone, Copy)]
pub(crate) struct Vec4<A: Four>(pub(crate) [F4<A>; 3]);

impl<A: Four> Vec4<A> {
    #[inline(always)]
    pub(crate) fn splat(a: A, v: [f64; 3]) -> Self {
        Self([F4::splat(a, v[0]), F4::splat(a, v[1]), F4::splat(a, v[2])])
    }

    #[inline(always)]
    pub(crate) fn plus(self, o: [f64; 3]) -> Self {
        let ([x, y, z], Self([u, v, w])) = (self.0, Self::splat(self.0[0].build(), o));
        Self([x + u, y + v, z + w])
    }

    #[inline(always)]
    pub(crate) fn minus(self, o: [f64; 3]) -> Self {
        self.plus([-o[0], -o[1], -o[2]])
    }

    #[inline(always)]
    pub(crate) fn times(self, s: F4<A>) -> Self {
        let [x, y, z] = self.0;
        Self([x * s, y * s, z * s])
    }

    /// `self * s + o`.
    #[inline(always)]
    pub(crate) fn times_plus(self, s: F4<A>, o: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, o.0);
        Self([x.fma(s, u), y.fma(s, v), z.fma(s, w)])
    }

    /// Scalar product with the same vector in every lane.
    #[inline(always)]
    pub(crate) fn along(self, o: [f64; 3]) -> F4<A> {
        self.dot(Self::splat(self.0[0].build(), o))
    }

    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> F4<A> {
        let ([x, y, z], [u, v, w]) = (self.0, o.0);
        x.fma(u, y.fma(v, z * w))
    }

    /// `self x o`.
    #[inline(always)]
    pub(crate) fn cross(self, o: Self) -> Self {
        let ([p, q, r], [x, y, z]) = (self.0, o.0);
        Self([
            r.taken_from(y, q * z),
            p.taken_from(z, r * x),
            q.taken_from(x, p * y),
        ])
    }

    /// At length one.
    #[inline(always)]
    pub(crate) fn unit(self) -> Self {
        let a = self.0[0].build();
        self.times(F4::splat(a, 1.0) / self.dot(self).sqrt())
    }

    /// `k x self` for the same `k` in every lane.
    #[inline(always)]
    fn crossed_by(self, k: [f64; 3]) -> Self {
        Self::splat(self.0[0].build(), k).cross(self)
    }

    /// Turned about the unit axis `k` (Rodrigues).
    #[inline(always)]
    pub(crate) fn turned(self, k: [f64; 3], angle: Angle<A>) -> Self {
        let a = angle.cos.build();
        let axis = Self::splat(a, k);
        let across = axis.cross(self);
        let rest = self.dot(axis) * (F4::splat(a, 1.0) - angle.cos);
        axis.times_plus(rest, across.times_plus(angle.sin, self.times(angle.cos)))
    }
}

/// Subproblem 1: the angle about `k` that turns `p` to `q`; `hold` where either lies along `k` and
/// the angle is free.
#[inline(always)]
pub(crate) fn turn_to<A: Four>(p: Vec4<A>, q: Vec4<A>, k: [f64; 3], hold: Held) -> Angle<A> {
    let (x, y, free) = swept(p, q, k);
    let length = F4::splat(x.build(), 1.0) / x.fma(x, y * y).sqrt();
    let angle = Angle {
        sin: y * length,
        cos: x * length,
    };
    angle.unless(free, hold)
}

/// The same for [`angle_of`], which needs no lengths of one.
#[inline(always)]
pub(crate) fn last_turn_to<A: Four>(p: Vec4<A>, q: Vec4<A>, k: [f64; 3], hold: Held) -> Angle<A> {
    let (cos, sin, free) = swept(p, q, k);
    Angle { sin, cos }.unless(free, hold)
}

/// Cosine and sine, of any one length, of the angle about `k` between `p` and `q`, and
/// where there is none.
#[inline(always)]
fn swept<A: Four>(p: Vec4<A>, q: Vec4<A>, k: [f64; 3]) -> (F4<A>, F4<A>, Mask<A>) {
    let across = p.crossed_by(k);
    let y = across.dot(q);
    // Not p.q - (k.p)(k.q), which cancels where both lie near k.
    let x = across.dot(q.crossed_by(k));
    let free = x.fma(x, y * y).le(p.dot(p) * q.dot(q) * FREE);
    (x, y, free)
}

/// Fourth power of the sine below which a direction counts as along an axis.
const FREE: f64 = 1e-50;

/// The two solutions of a subproblem: sine and cosine are the middle, plus or minus the offset.
#[derive(Clone, Copy)]
pub(crate) struct Pair<A: Four> {
    middle: Angle<A>,
    offset: Angle<A>,
    free: Mask<A>,
    /// Whether there are solutions.
    pub(crate) real: Mask<A>,
}

impl<A: Four> Pair<A> {
    /// The solutions selected by `sign`; `hold` where any angle is a solution.
    #[inline(always)]
    pub(crate) fn pick(self, sign: [f64; 4], hold: Held) -> Angle<A> {
        let sign = F4::new(self.middle.sin.build(), sign);
        let angle = Angle {
            sin: self.offset.sin.fma(sign, self.middle.sin),
            cos: self.offset.cos.fma(sign, self.middle.cos),
        };
        angle.unless(self.free, hold)
    }
}

/// Equation `x cos + y sin = d`. If both coefficients vanish compared with `scale`, any angle is a
/// solution. Errors of up to `slack` (relative, squared) count as rounding.
#[derive(Clone, Copy)]
pub(crate) struct TrigEquation<A: Four> {
    x: F4<A>,
    y: F4<A>,
    d: F4<A>,
    scale: F4<A>,
}

impl<A: Four> TrigEquation<A> {
    /// Subproblem 4: the angle about `k` for which `h . turned(p) = d`.
    #[inline(always)]
    pub(crate) fn of(h: Vec4<A>, k: [f64; 3], p: Vec4<A>, d: F4<A>) -> Self {
        let across = p.crossed_by(k);
        Self {
            x: across.dot(h.crossed_by(k)),
            y: across.dot(h),
            d: h.along(k).taken_from(p.along(k), d),
            scale: h.dot(h) * p.dot(p),
        }
    }

    #[inline(always)]
    pub(crate) fn solve(self, slack: f64) -> Pair<A> {
        let r2 = self.x.fma(self.x, self.y * self.y);
        let rest = self.d.taken_from(self.d, r2);
        self.with_rest(rest, r2, self.scale, slack)
    }

    /// The same with the discriminant `x^2 + y^2 - d^2` known to better accuracy.
    #[inline(always)]
    pub(crate) fn with_rest(self, rest: F4<A>, r2: F4<A>, scale: F4<A>, slack: f64) -> Pair<A> {
        let Self { x, y, d, .. } = self;
        let zero = F4::splat(x.build(), 0.0);
        let free = r2.le(scale * 1e-20);
        let real = (free.select(scale, r2) * -slack).le(rest);
        let d = zero.le(rest).select(d, r2.sqrt().signed(d));
        let root = rest.max(zero).sqrt();
        let inverse = F4::splat(x.build(), 1.0) / r2;
        let (d, root) = (d * inverse, root * inverse);
        Pair {
            middle: Angle {
                sin: d * y,
                cos: d * x,
            },
            offset: Angle {
                sin: x * root,
                cos: -(y * root),
            },
            free,
            real,
        }
    }
}

/// Three angles as numbers, see [`angle_of`].
#[inline(always)]
pub(crate) fn angles_of<A: Four>([x, y, z]: [Angle<A>; 3]) -> [F4<A>; 3] {
    [angle_of(x), angle_of(y), angle_of(z)]
}

/// Coefficients of the arc tangent, see [`angle_of`].
const ARC: [f64; 10] = [
    -0.333_333_333_333_332_5,
    0.199_999_999_998_984_07,
    -0.142_857_142_660_966_2,
    0.111_111_096_365_343_53,
    -0.090_908_525_571_757_48,
    0.076_910_551_583_877_16,
    -0.066_496_136_952_342_56,
    0.057_363_321_655_555_98,
    -0.044_833_346_211_129_645,
    0.022_750_526_977_488_576,
];

/// Angles from their sines and cosines, in (-pi, pi].
///
/// After reduction at tan(pi/8) the arc tangent is `t + t z P(z)` with `z = t^2`: one
/// division in all. `P` interpolates at Chebyshev points of `z` up to tan(pi/8)^2; the
/// error is 5.4e-17 rad before rounding.
///
/// # Source
/// L. N. Trefethen, "Approximation Theory and Approximation Practice", 2013, chapter 8:
/// how many terms are enough.
#[inline(always)]
pub(crate) fn angle_of<A: Four>(angle: Angle<A>) -> F4<A> {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let Angle { sin: y, cos: x } = angle;
    let a = y.build();
    let number = |x: f64| F4::splat(a, x);
    let zero = number(0.0);
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay));
    let lower = low.le(high * 0.414_213_562_373_095_03);
    let top = lower.select(low, low - high);
    let bottom = lower.select(high, low + high);
    let t = top / bottom;
    let z = t * t;
    // By pairs, so that few terms wait for each other.
    let pair = |i: usize| z.fma(number(ARC[i + 1]), number(ARC[i]));
    let (z2, z4) = (z * z, (z * z) * (z * z));
    let low = z2.fma(pair(2), pair(0));
    let high = z2.fma(pair(6), pair(4));
    let p = z4.fma(z4.fma(pair(8), high), low);
    let angle = (t * z).fma(p, t) + lower.select(zero, number(FRAC_PI_4));
    let angle = ay.le(ax).select(angle, number(FRAC_PI_2) - angle);
    let angle = zero.le(x).select(angle, number(PI) - angle);
    angle.signed(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::{Build, Op};

    /// One arc tangent in a build of the arithmetic.
    struct Arc(f64, f64);

    impl Op for Arc {
        type Output = f64;

        fn run<A: Four>(self, a: A) -> f64 {
            let number = |x| F4::splat(a, x);
            angle_of(Angle {
                sin: number(self.0),
                cos: number(self.1),
            })
            .array()[2]
        }
    }

    /// The arc tangent agrees with the standard library in all directions.
    #[test]
    fn arc_agrees_with_std() {
        for build in [Build::Plain, Build::detect()] {
            for i in 0..200_000 {
                let angle = f64::from(i) * 3e-5 - 3.0;
                let (s, c) = angle.sin_cos();
                let found = build.run(Arc(s, c));
                assert!((found - s.atan2(c)).abs() < 1e-15, "{angle}");
            }
            for (s, c) in [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0)] {
                assert_eq!(build.run(Arc(s, c)), f64::atan2(s, c));
            }
        }
    }
}
