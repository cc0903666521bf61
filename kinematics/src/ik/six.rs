//! Closed forms of six turning joints.
//!
//! The arm is taken as a product of turns about its axes at q = 0, so that
//! `pose * zero_pose^-1 = e1 e2 e3 e4 e5 e6`. Two families are solved, and with the
//! chain read backwards two more:
//! - axes 4, 5, 6 meet in a point (spherical wrist), and either axes 2 and 3 are
//!   parallel or axes 1 and 2 meet;
//! - axes 2, 3, 4 are parallel and axes 5 and 6 meet.

use super::lanes::{Angle, B4, F4, FIRST, SECOND, Vec4, Wave, both, splat, sub, turn_to};
use crate::arith::{self, Arith};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// An axis at q = 0: its direction and a point on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) h: [f64; 3],
    pub(crate) p: [f64; 3],
}

/// How the first three joints place the wrist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Placing {
    /// Axes 2 and 3 are parallel.
    Parallel,
    /// Axes 1 and 2 meet in this point.
    Meeting([f64; 3]),
}

/// Structure of a six-joint chain, first joint first after any reversal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Axes 4, 5, 6 meet in this point.
    Wrist([f64; 3], Placing),
    /// Axes 2, 3, 4 are parallel, axes 5 and 6 meet in this point; the signs tell
    /// whether axes 3 and 4 point the way of axis 2.
    Parallels([f64; 3], [f64; 2]),
}

/// A six-joint chain with a closed form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Six {
    pub(crate) lines: [Line; 6],
    pub(crate) shape: Shape,
    /// Whether `lines` are those of the chain read from its tip.
    pub(crate) reversed: bool,
    /// Squared relative miss that counts as rounding; large for approximate shapes.
    pub(crate) slack: f64,
}

/// Sines and cosines of six joints in two groups of four branches.
pub(crate) struct Angles {
    pub(crate) joints: [[Angle; 6]; 2],
    pub(crate) real: [B4; 2],
}

/// The product of turns: a rotation and a translation.
#[derive(Clone, Copy)]
pub(crate) struct Product {
    pub(crate) r: Matrix3<f64>,
    pub(crate) t: Vector3<f64>,
}

impl Product {
    pub(crate) fn new(r: Matrix3<f64>, t: Vector3<f64>) -> Self {
        Self { r, t }
    }

    /// `pose * zero^-1`.
    #[inline(always)]
    pub(crate) fn of(pose: &Isometry3<f64>, zero: &Zero) -> Self {
        let r = rotation(pose) * zero.back;
        Self {
            r,
            t: pose.translation.vector - r * zero.position,
        }
    }

    #[inline(always)]
    fn inverse(&self) -> Self {
        let r = self.r.transpose();
        Self {
            r,
            t: -(r * self.t),
        }
    }

    #[inline(always)]
    pub(crate) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        (self.r * Vector3::from(p) + self.t).into()
    }

    #[inline(always)]
    pub(crate) fn turn(&self, v: [f64; 3]) -> [f64; 3] {
        (self.r * Vector3::from(v)).into()
    }
}

/// The pose at q = 0, ready for [`Product::of`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zero {
    back: Matrix3<f64>,
    position: Vector3<f64>,
}

impl Zero {
    pub(crate) fn new(pose: &Isometry3<f64>) -> Self {
        Self {
            back: rotation(pose).transpose(),
            position: pose.translation.vector,
        }
    }
}

/// Rotation matrix of a pose.
#[inline(always)]
fn rotation(pose: &Isometry3<f64>) -> Matrix3<f64> {
    let q = pose.rotation.quaternion();
    let (x, y, z, w) = (q.i, q.j, q.k, q.w);
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A unit vector at right angles to `h`.
#[inline(always)]
pub(crate) fn across(h: [f64; 3]) -> [f64; 3] {
    let v = if h[0].abs() < 0.7 {
        [0.0, h[2], -h[1]]
    } else {
        [-h[2], 0.0, h[0]]
    };
    let length = dot(v, v).sqrt();
    [v[0] / length, v[1] / length, v[2] / length]
}

impl Six {
    /// All branches; `hold` are joint positions (rad) for joints that a singular pose leaves free.
    #[inline(always)]
    pub(crate) fn solve<A: Arith>(&self, a: A, product: &Product, hold: [f64; 6]) -> Angles {
        let mut hold = hold;
        if self.reversed {
            hold.reverse();
            hold = hold.map(|angle| -angle);
        }
        let (sin, cos) = arith::sin_cos(a, hold);
        let hold: [Angle; 6] = std::array::from_fn(|i| Angle::splat(sin[i], cos[i]));
        let g = if self.reversed {
            product.inverse()
        } else {
            *product
        };
        let mut angles = match self.shape {
            Shape::Wrist(wrist, placing) => {
                let w = g.point(wrist);
                let (arm, real) = match placing {
                    Placing::Parallel => self.place_parallel(a, wrist, w, &hold),
                    Placing::Meeting(meet) => self.place_meeting(a, (wrist, w), meet, &hold),
                };
                self.wrist(a, &g, (arm, real), &hold)
            }
            Shape::Parallels(meet, signs) => self.parallels(a, &g, (meet, signs), &hold),
        };
        if self.reversed {
            for group in &mut angles.joints {
                group.reverse();
                *group = group.map(Angle::back);
            }
        }
        angles
    }

    /// Turns that bring `wrist` to `w` where axes 2 and 3 are parallel.
    #[inline(always)]
    fn place_parallel<A: Arith>(
        &self,
        a: A,
        wrist: [f64; 3],
        w: [f64; 3],
        hold: &[Angle; 6],
    ) -> ([Angle; 3], B4) {
        let [one, two, _, ..] = self.lines;
        // Turns about axes 2 and 3 leave the height along them.
        let away = Vec4::splat(minus(w, one.p));
        let height = splat(dot(two.h, minus(wrist, one.p)));
        let back = Wave::of(a, Vec4::splat(two.h), one.h, away, height).solve(
            a,
            FIRST,
            hold[0].back(),
            self.slack,
        );
        let y = away.turned(a, one.h, back.angle).plus(one.p);
        let (q2, q3, real) = self.elbow(a, (wrist, y), SECOND, [hold[1], hold[2]]);
        ([back.angle.back(), q2, q3], both(back.real, real))
    }

    /// Turns about axes 2 and 3, which are parallel, that bring the point `from` to `to`.
    #[inline(always)]
    fn elbow<A: Arith>(
        &self,
        a: A,
        (from, to): ([f64; 3], Vec4),
        sign: F4,
        hold: [Angle; 2],
    ) -> (Angle, Angle, B4) {
        let (two, three) = (self.lines[1], self.lines[2]);
        let (reach, upper) = (minus(from, three.p), minus(two.p, three.p));
        let away = to.minus(two.p);
        // |turned(reach) - upper| = |to - p2|, all seen along the axes.
        let flat = |v: [f64; 3]| dot(v, v) - dot(v, three.h) * dot(v, three.h);
        let height = away.along(a, three.h);
        let far = sub(away.dot(a, away), super::lanes::mul(height, height));
        let both_flat = splat(flat(reach) + flat(upper));
        let level = splat(dot(reach, three.h) * dot(upper, three.h));
        let d = super::lanes::fma(a, sub(both_flat, far), splat(0.5), level);
        let bend = Wave::of(a, Vec4::splat(upper), three.h, Vec4::splat(reach), d)
            .solve(a, sign, hold[1], self.slack);
        let bent = Vec4::splat(reach)
            .turned(a, three.h, bend.angle)
            .plus(three.p);
        let lift = turn_to(a, bent.minus(two.p), away, two.h, hold[0]);
        (lift, bend.angle, bend.real)
    }

    /// Turns that bring `wrist` to `w` where axes 1 and 2 meet.
    #[inline(always)]
    fn place_meeting<A: Arith>(
        &self,
        a: A,
        (wrist, w): ([f64; 3], [f64; 3]),
        meet: [f64; 3],
        hold: &[Angle; 6],
    ) -> ([Angle; 3], B4) {
        let [one, two, three, ..] = self.lines;
        let (reach, upper) = (minus(wrist, three.p), minus(meet, three.p));
        let away = minus(w, meet);
        let d = 0.5 * (dot(reach, reach) + dot(upper, upper) - dot(away, away));
        let bend = Wave::of(a, Vec4::splat(upper), three.h, Vec4::splat(reach), splat(d))
            .solve(a, FIRST, hold[2], self.slack);
        let bent = Vec4::splat(reach)
            .turned(a, three.h, bend.angle)
            .plus(three.p)
            .minus(meet);
        let lift = Wave::of(a, Vec4::splat(one.h), two.h, bent, splat(dot(one.h, away)))
            .solve(a, SECOND, hold[1], self.slack);
        let lifted = bent.turned(a, two.h, lift.angle);
        let swing = turn_to(a, lifted, Vec4::splat(away), one.h, hold[0]);
        ([swing, lift.angle, bend.angle], both(bend.real, lift.real))
    }

    /// Both wrists of each arm position.
    #[inline(always)]
    fn wrist<A: Arith>(
        &self,
        a: A,
        g: &Product,
        (arm, real): ([Angle; 3], B4),
        hold: &[Angle; 6],
    ) -> Angles {
        let [one, two, three, four, five, six] = self.lines;
        let seen = |v: [f64; 3]| {
            Vec4::splat(v)
                .turned(a, one.h, arm[0].back())
                .turned(a, two.h, arm[1].back())
                .turned(a, three.h, arm[2].back())
        };
        let spin = across(six.h);
        let (axis, spun) = (seen(g.turn(six.h)), seen(g.turn(spin)));
        let axes = [four.h, five.h, six.h];
        let half = |sign: f64| {
            let (turn, ok) = orient(
                a,
                axes,
                (axis, spun, spin),
                splat(sign),
                [hold[3], hold[4], hold[5]],
            );
            ([arm[0], arm[1], arm[2], turn[0], turn[1], turn[2]], ok)
        };
        let ((first, ok_first), (second, ok_second)) = (half(1.0), half(-1.0));
        Angles {
            joints: [first, second],
            real: [both(real, ok_first), both(real, ok_second)],
        }
    }

    /// Branches of three parallel axes.
    #[inline(always)]
    fn parallels<A: Arith>(
        &self,
        a: A,
        g: &Product,
        (meet, signs): ([f64; 3], [f64; 2]),
        hold: &[Angle; 6],
    ) -> Angles {
        let [one, two, _, four, five, six] = self.lines;
        let away = Vec4::splat(minus(g.point(meet), one.p));
        let height = splat(dot(two.h, minus(meet, one.p)));
        let back = Wave::of(a, Vec4::splat(two.h), one.h, away, height).solve(
            a,
            FIRST,
            hold[0].back(),
            self.slack,
        );
        let y = away.turned(a, one.h, back.angle).plus(one.p);
        let seen = |v: [f64; 3]| Vec4::splat(g.turn(v)).turned(a, one.h, back.angle);
        // The three parallel turns are one turn by their sum, then axes 5 and 6 follow.
        let spin = across(six.h);
        let total = hold[1]
            .plus(a, hold[2].times(signs[0]))
            .plus(a, hold[3].times(signs[1]));
        let turn = (seen(six.h), seen(spin), spin);
        let ([sum, q5, q6], ok) = orient(
            a,
            [two.h, five.h, six.h],
            turn,
            SECOND,
            [total, hold[4], hold[5]],
        );
        let real = both(back.real, ok);
        // Where axis 4 is, from the point in which axes 5 and 6 meet.
        let out = Vec4::splat(minus(meet, four.p)).turned(a, two.h, sum);
        let to = y.less(out);
        let half = |sign: f64| {
            let (q2, q3, ok) = self.elbow(a, (four.p, to), splat(sign), [hold[1], hold[2]]);
            let q4 = sum
                .plus(a, q2.back())
                .plus(a, q3.times(-signs[0]))
                .times(signs[1]);
            ([back.angle.back(), q2, q3, q4, q5, q6], both(real, ok))
        };
        let ((first, ok_first), (second, ok_second)) = (half(1.0), half(-1.0));
        Angles {
            joints: [first, second],
            real: [ok_first, ok_second],
        }
    }
}

/// Turns about three axes whose product brings the third axis to `axis`, and `spin`,
/// at right angles to it, to `spun`. Where the first and third axis fall together the
/// first is held.
#[inline(always)]
pub(crate) fn orient<A: Arith>(
    a: A,
    [first, middle, last]: [[f64; 3]; 3],
    (axis, spun, spin): (Vec4, Vec4, [f64; 3]),
    sign: F4,
    hold: [Angle; 3],
) -> ([Angle; 3], B4) {
    use super::lanes::mul;
    let level = axis.along(a, first);
    let wave = Wave::of(a, Vec4::splat(first), middle, Vec4::splat(last), level);
    // With the middle axis square to both, the discriminant is the squared sine between
    // first axis and target; taken from their product it stays exact when small.
    let square = dot(first, middle).abs() < 1e-12 && dot(middle, last).abs() < 1e-12;
    let tilt = if square {
        let [x, y, z] = axis.0;
        let [p, q, r] = first.map(splat);
        let cx = sub(mul(q, z), mul(r, y));
        let cy = sub(mul(r, x), mul(p, z));
        let cz = sub(mul(p, y), mul(q, x));
        let rest = super::lanes::fma(a, cx, cx, super::lanes::fma(a, cy, cy, mul(cz, cz)));
        wave.with_rest(a, rest, sign, hold[1], 1e-12, splat(1.0), splat(1.0))
    } else {
        wave.solve(a, sign, hold[1], 1e-12)
    };
    let tilted = Vec4::splat(last).turned(a, middle, tilt.angle);
    let swing = turn_to(a, tilted, axis, first, hold[0]);
    let left = spun
        .turned(a, first, swing.back())
        .turned(a, middle, tilt.angle.back());
    let roll = turn_to(a, Vec4::splat(spin), left, last, hold[2]);
    ([swing, tilt.angle, roll], tilt.real)
}
