//! Four branches side by side: numbers and vectors of four lanes, and the
//! subproblems that closed forms are made of.
//!
//! # Source
//! A. J. Elias and J. T. Wen, "IK-Geo: unified robot inverse kinematics using
//! subproblem decomposition", Mech. Mach. Theory 209, 2025: subproblems 1, 3 and 4.

use crate::arith::Arith;

/// One number in each of four lanes.
pub(crate) type F4 = [f64; 4];

/// One yes or no in each of four lanes.
pub(crate) type B4 = [bool; 4];

/// Signs that tell the branches of the first choice apart.
pub(crate) const FIRST: F4 = [1.0, -1.0, 1.0, -1.0];
/// Signs that tell the branches of the second choice apart.
pub(crate) const SECOND: F4 = [1.0, 1.0, -1.0, -1.0];

/// Applies a function of up to three numbers in every lane.
macro_rules! each {
    ($f:expr) => {
        [$f(0), $f(1), $f(2), $f(3)]
    };
}

#[inline(always)]
pub(crate) fn splat(x: f64) -> F4 {
    [x; 4]
}

#[inline(always)]
pub(crate) fn select(mask: B4, yes: F4, no: F4) -> F4 {
    each!(|i: usize| if mask[i] { yes[i] } else { no[i] })
}

#[inline(always)]
pub(crate) fn both(a: B4, b: B4) -> B4 {
    each!(|i: usize| a[i] & b[i])
}

#[inline(always)]
pub(crate) fn mul(a: F4, b: F4) -> F4 {
    each!(|i: usize| a[i] * b[i])
}

#[inline(always)]
pub(crate) fn sub(a: F4, b: F4) -> F4 {
    each!(|i: usize| a[i] - b[i])
}

#[inline(always)]
pub(crate) fn neg(a: F4) -> F4 {
    each!(|i: usize| -a[i])
}

#[inline(always)]
pub(crate) fn fma<A: Arith>(a: A, x: F4, y: F4, z: F4) -> F4 {
    each!(|i: usize| a.fma(x[i], y[i], z[i]))
}

#[inline(always)]
fn sqrt(x: F4) -> F4 {
    each!(|i: usize| x[i].sqrt())
}

#[inline(always)]
fn inverse(x: F4) -> F4 {
    each!(|i: usize| 1.0 / x[i])
}

/// Sine and cosine of an angle in each lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Angle {
    pub(crate) sin: F4,
    pub(crate) cos: F4,
}

impl Angle {
    #[inline(always)]
    pub(crate) fn splat(sin: f64, cos: f64) -> Self {
        Self {
            sin: splat(sin),
            cos: splat(cos),
        }
    }

    #[inline(always)]
    pub(crate) fn back(self) -> Self {
        Self {
            sin: neg(self.sin),
            cos: self.cos,
        }
    }

    /// The angle or, for a sign of -1, the angle turned back.
    #[inline(always)]
    pub(crate) fn times(self, sign: f64) -> Self {
        Self {
            sin: mul(self.sin, splat(sign)),
            cos: self.cos,
        }
    }

    /// The sum of two angles.
    #[inline(always)]
    pub(crate) fn plus<A: Arith>(self, a: A, o: Self) -> Self {
        Self {
            sin: fma(a, self.sin, o.cos, mul(self.cos, o.sin)),
            cos: fma(a, self.cos, o.cos, neg(mul(self.sin, o.sin))),
        }
    }
}

/// A vector in each lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec4(pub(crate) [F4; 3]);

impl Vec4 {
    #[inline(always)]
    pub(crate) fn splat(v: [f64; 3]) -> Self {
        Self([splat(v[0]), splat(v[1]), splat(v[2])])
    }

    #[inline(always)]
    pub(crate) fn plus(self, o: [f64; 3]) -> Self {
        let [x, y, z] = self.0;
        Self([
            each!(|i: usize| x[i] + o[0]),
            each!(|i: usize| y[i] + o[1]),
            each!(|i: usize| z[i] + o[2]),
        ])
    }

    #[inline(always)]
    pub(crate) fn minus(self, o: [f64; 3]) -> Self {
        self.plus([-o[0], -o[1], -o[2]])
    }

    #[inline(always)]
    pub(crate) fn less(self, o: Self) -> Self {
        Self([
            sub(self.0[0], o.0[0]),
            sub(self.0[1], o.0[1]),
            sub(self.0[2], o.0[2]),
        ])
    }

    /// Scalar product with the same vector in every lane.
    #[inline(always)]
    pub(crate) fn along<A: Arith>(self, a: A, o: [f64; 3]) -> F4 {
        let [x, y, z] = self.0;
        fma(
            a,
            x,
            splat(o[0]),
            fma(a, y, splat(o[1]), mul(z, splat(o[2]))),
        )
    }

    #[inline(always)]
    pub(crate) fn dot<A: Arith>(self, a: A, o: Self) -> F4 {
        let ([x, y, z], [u, v, w]) = (self.0, o.0);
        fma(a, x, u, fma(a, y, v, mul(z, w)))
    }

    /// `k x self` for the same `k` in every lane.
    #[inline(always)]
    fn crossed_by<A: Arith>(self, a: A, k: [f64; 3]) -> Self {
        let [x, y, z] = self.0;
        let [p, q, r] = k.map(splat);
        Self([
            fma(a, q, z, neg(mul(r, y))),
            fma(a, r, x, neg(mul(p, z))),
            fma(a, p, y, neg(mul(q, x))),
        ])
    }

    /// Turned about the unit axis `k` (Rodrigues).
    #[inline(always)]
    pub(crate) fn turned<A: Arith>(self, a: A, k: [f64; 3], angle: Angle) -> Self {
        let across = self.crossed_by(a, k);
        let rest = mul(self.along(a, k), each!(|i: usize| 1.0 - angle.cos[i]));
        let part = |i: usize| {
            let turned = fma(a, self.0[i], angle.cos, mul(rest, splat(k[i])));
            fma(a, across.0[i], angle.sin, turned)
        };
        Self([part(0), part(1), part(2)])
    }
}

/// Subproblem 1: the angle about `k` that turns `p` to `q`; where either lies
/// along `k`, which leaves it free, `hold`.
#[inline(always)]
pub(crate) fn turn_to<A: Arith>(a: A, p: Vec4, q: Vec4, k: [f64; 3], hold: Angle) -> Angle {
    let across = p.crossed_by(a, k);
    let y = across.dot(a, q);
    // Not p.q - (k.p)(k.q), which has no figures left where both lie near k.
    let x = across.dot(a, q.crossed_by(a, k));
    let square = fma(a, x, x, mul(y, y));
    let scale = mul(p.dot(a, p), q.dot(a, q));
    let free: B4 = each!(|i: usize| square[i] <= FREE * scale[i]);
    let length = inverse(sqrt(square));
    Angle {
        sin: select(free, hold.sin, mul(y, length)),
        cos: select(free, hold.cos, mul(x, length)),
    }
}

/// Fourth power of the sine below which a direction counts as along an axis.
const FREE: f64 = 1e-50;

/// One of the two answers of a subproblem with two, and whether it is real.
pub(crate) struct Choice {
    pub(crate) angle: Angle,
    pub(crate) real: B4,
}

/// Equation `x cos + y sin = d` with its two answers told apart by `sign`. Where both
/// coefficients vanish against `scale`, `hold`. Misses of up to `slack` (relative,
/// squared) count as rounding.
#[derive(Clone, Copy)]
pub(crate) struct Wave {
    pub(crate) x: F4,
    pub(crate) y: F4,
    pub(crate) d: F4,
    pub(crate) scale: F4,
}

impl Wave {
    /// Subproblem 4: the angle about `k` for which `h . turned(p) = d`.
    #[inline(always)]
    pub(crate) fn of<A: Arith>(a: A, h: Vec4, k: [f64; 3], p: Vec4, d: F4) -> Self {
        let (hk, pk) = (h.along(a, k), p.along(a, k));
        let across = p.crossed_by(a, k);
        Self {
            x: across.dot(a, h.crossed_by(a, k)),
            y: across.dot(a, h),
            d: sub(d, mul(hk, pk)),
            scale: mul(h.dot(a, h), p.dot(a, p)),
        }
    }

    #[inline(always)]
    pub(crate) fn solve<A: Arith>(self, a: A, sign: F4, hold: Angle, slack: f64) -> Choice {
        let Self { x, y, d, scale } = self;
        let r2 = fma(a, x, x, mul(y, y));
        let rest = fma(a, neg(d), d, r2);
        self.with_rest(a, rest, sign, hold, slack, r2, scale)
    }

    /// The same with the discriminant `x^2 + y^2 - d^2` known to better accuracy.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "one formula in one place")]
    pub(crate) fn with_rest<A: Arith>(
        self,
        a: A,
        rest: F4,
        sign: F4,
        hold: Angle,
        slack: f64,
        r2: F4,
        scale: F4,
    ) -> Choice {
        let Self { x, y, d, .. } = self;
        let free: B4 = each!(|i: usize| r2[i] <= 1e-20 * scale[i]);
        let real: B4 =
            each!(|i: usize| rest[i] >= -slack * (if free[i] { scale[i] } else { r2[i] }));
        let over: B4 = each!(|i: usize| rest[i] < 0.0);
        let r = sqrt(r2);
        let clamped: F4 = each!(|i: usize| r[i].copysign(d[i]));
        let d = select(over, clamped, d);
        let root: F4 = mul(sign, sqrt(each!(|i: usize| rest[i].max(0.0))));
        let scale = inverse(r2);
        let sin = mul(fma(a, d, y, mul(x, root)), scale);
        let cos = mul(fma(a, d, x, neg(mul(y, root))), scale);
        let angle = Angle {
            sin: select(free, hold.sin, sin),
            cos: select(free, hold.cos, cos),
        };
        Choice { angle, real }
    }
}

/// Angles from their sines and cosines, in (-pi, pi].
///
/// # Source
/// S. L. Moshier, Cephes Mathematical Library, 1989: arc tangent by a rational
/// function after reduction at tan(pi/8).
#[inline(always)]
pub(crate) fn angle_of<A: Arith>(a: A, angle: Angle) -> F4 {
    each!(|i: usize| arc(a, angle.sin[i], angle.cos[i]))
}

#[inline(always)]
fn arc<A: Arith>(a: A, y: f64, x: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let (low, high) = if steep { (ax, ay) } else { (ay, ax) };
    let upper = low > 0.414_213_562_373_095_03 * high;
    let (top, bottom) = if upper {
        (low - high, low + high)
    } else {
        (low, high)
    };
    let t = top / bottom;
    let z = t * t;
    let mut p = a.fma(-8.750_608_600_031_904e-1, z, -1.615_753_718_733_365e1);
    p = a.fma(p, z, -7.500_855_792_314_705e1);
    p = a.fma(p, z, -1.228_866_684_490_136_1e2);
    p = a.fma(p, z, -6.485_021_904_942_025e1);
    let mut q = z + 2.485_846_490_142_306_3e1;
    q = a.fma(q, z, 1.650_270_098_316_988_6e2);
    q = a.fma(q, z, 4.328_810_604_912_902_6e2);
    q = a.fma(q, z, 4.853_903_996_359_137e2);
    q = a.fma(q, z, 1.945_506_571_482_614e2);
    let mut angle = a.fma(t * z, p / q, t);
    angle += if upper { FRAC_PI_4 } else { 0.0 };
    angle = if steep { FRAC_PI_2 - angle } else { angle };
    angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arith::Plain;

    /// The arc tangent agrees with the standard library in all directions.
    #[test]
    fn arc_agrees_with_std() {
        for i in 0..200_000 {
            let angle = f64::from(i) * 3e-5 - 3.0;
            let (s, c) = angle.sin_cos();
            assert!((arc(Plain, s, c) - s.atan2(c)).abs() < 1e-15, "{angle}");
        }
        for (s, c) in [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0)] {
            assert_eq!(arc(Plain, s, c), f64::atan2(s, c));
        }
    }
}
