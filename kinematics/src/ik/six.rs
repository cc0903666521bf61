//! Closed forms of six turning joints.
//!
//! The arm is taken as a product of turns about its axes at q = 0, so that
//! `pose * zero_pose^-1 = e1 e2 e3 e4 e5 e6`. Two families are solved, and with the
//! chain read backwards two more:
//! - axes 4, 5, 6 meet in a point (spherical wrist), and either axes 2 and 3 are
//!   parallel or axes 1 and 2 meet;
//! - axes 2, 3, 4 are parallel and axes 5 and 6 meet.

use super::lanes::{
    Angle, FIRST, Held, Pair, SECOND, Vec4, Wave, angle_of, angles_of, last_turn_to, turn_to,
};
use super::product::Product;
use crate::arith::Arith;
use crate::wide::{B4, F4};
use std::f64::consts::PI;

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

/// Angles (rad) of `M` joints in two groups of four branches, and which of them exist.
pub(crate) struct Joints<A: Arith, const M: usize> {
    pub(crate) angles: [[F4<A>; M]; 2],
    pub(crate) real: [B4<A>; 2],
}

#[inline(always)]
pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
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
    pub(crate) fn solve<A: Arith>(&self, product: &Product<A>, hold: [f64; 6]) -> Joints<A, 6> {
        let [h1, h2, h3, h4, h5, h6] = hold;
        let (product, hold) = if self.reversed {
            (product.inverse(), [-h6, -h5, -h4, -h3, -h2, -h1])
        } else {
            (*product, hold)
        };
        let [h1, h2, h3, h4, h5, h6] = hold;
        let total = match self.shape {
            Shape::Wrist(..) => 0.0,
            Shape::Parallels(_, signs) => h2 + signs[0] * h3 + signs[1] * h4,
        };
        let hold = Held::all(product.build(), [h1, h2, h3, h4, h5, h6, total]);
        let mut found = self.solve_forwards(&product, &hold);
        if self.reversed {
            for group in &mut found.angles {
                let [q1, q2, q3, q4, q5, q6] = *group;
                *group = [-q6, -q5, -q4, -q3, -q2, -q1];
            }
        }
        found
    }

    /// The seventh held angle is the sum of the turns about parallel axes.
    #[inline(always)]
    fn solve_forwards<A: Arith>(&self, g: &Product<A>, hold: &[Held; 7]) -> Joints<A, 6> {
        match self.shape {
            Shape::Wrist(wrist, placing) => {
                let w = g.point(wrist);
                let placed = match placing {
                    Placing::Parallel => self.place_parallel(g.build(), wrist, w, hold),
                    Placing::Meeting(meet) => self.place_meeting(g.build(), (wrist, w), meet, hold),
                };
                self.wrist(g, placed, placing, hold)
            }
            Shape::Parallels(meet, signs) => self.parallels(g, (meet, signs), hold),
        }
    }

    /// Turns that bring `wrist` to `w` where axes 2 and 3 are parallel.
    #[inline(always)]
    fn place_parallel<A: Arith>(
        &self,
        a: A,
        wrist: [f64; 3],
        w: [f64; 3],
        hold: &[Held; 7],
    ) -> ([Angle<A>; 3], B4<A>) {
        let (back, y) = self.base(a, wrist, w, hold[0]);
        let elbow = self.elbow(wrist, y);
        let (q2, q3) = self.reach(&elbow, wrist, SECOND, [hold[1], hold[2]]);
        ([back.0.back(), q2, q3], back.1 & elbow.bend.real)
    }

    /// The turn back about axis 1 after which a point at `to` is as high along axis 2 as
    /// `from` is, which turns about axes 2 and 3 leave so; and where it then is.
    #[inline(always)]
    fn base<A: Arith>(
        &self,
        a: A,
        from: [f64; 3],
        to: [f64; 3],
        hold: Held,
    ) -> ((Angle<A>, B4<A>), Vec4<A>) {
        let [one, two, ..] = self.lines;
        let away = Vec4::splat(a, minus(to, one.p));
        let height = F4::splat(a, dot(two.h, minus(from, one.p)));
        let pair = Wave::of(Vec4::splat(a, two.h), one.h, away, height).solve(self.slack);
        let back = pair.pick(FIRST, hold.back());
        let seen = away.turned(one.h, back).plus(one.p);
        ((back, pair.real), seen)
    }

    /// Bends of axis 3, parallel to axis 2, that bring the point `from` as far from axis 2
    /// as `to` is.
    #[inline(always)]
    fn elbow<A: Arith>(&self, from: [f64; 3], to: Vec4<A>) -> Elbow<A> {
        let (two, three) = (self.lines[1], self.lines[2]);
        let (reach, upper) = (minus(from, three.p), minus(two.p, three.p));
        let away = to.minus(two.p);
        let a = away.0[0].build();
        // |turned(reach) - upper| = |to - p2|, all seen along the axes.
        let flat = |v: [f64; 3]| dot(v, v) - dot(v, three.h) * dot(v, three.h);
        let height = away.along(three.h);
        let far = height.taken_from(height, away.dot(away));
        let level = dot(reach, three.h) * dot(upper, three.h);
        let sum = F4::splat(a, 0.5 * (flat(reach) + flat(upper)) + level);
        let d = far.taken_from(F4::splat(a, 0.5), sum);
        let (upper, reach) = (Vec4::splat(a, upper), Vec4::splat(a, reach));
        let bend = Wave::of(upper, three.h, reach, d).solve(self.slack);
        Elbow { bend, away }
    }

    /// Turns about axes 2 and 3 for one choice of the bend.
    #[inline(always)]
    fn reach<A: Arith>(
        &self,
        elbow: &Elbow<A>,
        from: [f64; 3],
        sign: [f64; 4],
        hold: [Held; 2],
    ) -> (Angle<A>, Angle<A>) {
        let (two, three) = (self.lines[1], self.lines[2]);
        let bend = elbow.bend.pick(sign, hold[1]);
        let reach = Vec4::splat(bend.sin.build(), minus(from, three.p));
        let bent = reach.turned(three.h, bend).plus(three.p);
        let lift = turn_to(bent.minus(two.p), elbow.away, two.h, hold[0]);
        (lift, bend)
    }

    /// Turns that bring `wrist` to `w` where axes 1 and 2 meet.
    #[inline(always)]
    fn place_meeting<A: Arith>(
        &self,
        a: A,
        (wrist, w): ([f64; 3], [f64; 3]),
        meet: [f64; 3],
        hold: &[Held; 7],
    ) -> ([Angle<A>; 3], B4<A>) {
        let [one, two, three, ..] = self.lines;
        let (reach, upper) = (minus(wrist, three.p), minus(meet, three.p));
        let away = minus(w, meet);
        let d = 0.5 * (dot(reach, reach) + dot(upper, upper) - dot(away, away));
        let (upper, reach) = (Vec4::splat(a, upper), Vec4::splat(a, reach));
        let bends = Wave::of(upper, three.h, reach, F4::splat(a, d)).solve(self.slack);
        let bend = bends.pick(FIRST, hold[2]);
        let bent = reach.turned(three.h, bend).plus(minus(three.p, meet));
        let height = F4::splat(a, dot(one.h, away));
        let lifts = Wave::of(Vec4::splat(a, one.h), two.h, bent, height).solve(self.slack);
        let lift = lifts.pick(SECOND, hold[1]);
        let lifted = bent.turned(two.h, lift);
        let swing = turn_to(lifted, Vec4::splat(a, away), one.h, hold[0]);
        ([swing, lift, bend], bends.real & lifts.real)
    }

    /// Both wrists of each arm position.
    #[inline(always)]
    fn wrist<A: Arith>(
        &self,
        g: &Product<A>,
        (arm, real): ([Angle<A>; 3], B4<A>),
        placing: Placing,
        hold: &[Held; 7],
    ) -> Joints<A, 6> {
        let [one, two, three, four, five, six] = self.lines;
        let spin = across(six.h);
        let a = g.build();
        let first = arm[0].back();
        let mut axis = Vec4::splat(a, g.turn(six.h)).turned(one.h, first);
        let mut spun = Vec4::splat(a, g.turn(spin)).turned(one.h, first);
        if placing == Placing::Parallel {
            // Two turns about parallel axes are one.
            let second = if dot(two.h, three.h) > 0.0 {
                arm[2]
            } else {
                arm[2].back()
            };
            let sum = arm[1].plus(second).back();
            (axis, spun) = (axis.turned(two.h, sum), spun.turned(two.h, sum));
        } else {
            let (second, third) = (arm[1].back(), arm[2].back());
            axis = axis.turned(two.h, second).turned(three.h, third);
            spun = spun.turned(two.h, second).turned(three.h, third);
        }
        let axes = [four.h, five.h, six.h];
        let hold = [hold[3], hold[4], hold[5]];
        let [(first, ok_first), (second, ok_second)] = orient_both(axes, (axis, spun, spin), hold);
        let ([q1, q2, q3], [q4, q5, q6], [r4, r5, r6]) = (angles_of(arm), first, second);
        Joints {
            angles: [[q1, q2, q3, q4, q5, q6], [q1, q2, q3, r4, r5, r6]],
            real: [real & ok_first, real & ok_second],
        }
    }

    /// Branches of three parallel axes.
    #[inline(always)]
    fn parallels<A: Arith>(
        &self,
        g: &Product<A>,
        (meet, signs): ([f64; 3], [f64; 2]),
        hold: &[Held; 7],
    ) -> Joints<A, 6> {
        let [one, two, _, four, five, six] = self.lines;
        let a = g.build();
        let ((back, real), y) = self.base(a, meet, g.point(meet), hold[0]);
        // The three parallel turns are one turn by their sum, then axes 5 and 6 follow.
        let spin = across(six.h);
        let turn = (
            Vec4::splat(a, g.turn(six.h)).turned(one.h, back),
            Vec4::splat(a, g.turn(spin)).turned(one.h, back),
            spin,
        );
        let axes = [two.h, five.h, six.h];
        let ([sum, q5, q6], tilt) = orient(axes, turn, SECOND, [hold[6], hold[4], hold[5]]);
        let real = real & tilt.real;
        // Where axis 4 is, from the point in which axes 5 and 6 meet.
        let out = Vec4::splat(a, minus(meet, four.p)).turned(two.h, sum);
        let elbow = self.elbow(four.p, y.less(out));
        let real = real & elbow.bend.real;
        let (q1, [sum, q5, q6]) = (angle_of(back.back()), angles_of([sum, q5, q6]));
        let hold = [hold[1], hold[2]];
        let (q2, q3) = self.reach(&elbow, four.p, [1.0; 4], hold);
        let (r2, r3) = self.reach(&elbow, four.p, [-1.0; 4], hold);
        let (q2, q3, r2, r3) = (angle_of(q2), angle_of(q3), angle_of(r2), angle_of(r3));
        let q4 = (sum - q2 - q3 * signs[0]) * signs[1];
        let r4 = (sum - r2 - r3 * signs[0]) * signs[1];
        Joints {
            angles: [[q1, q2, q3, q4, q5, q6], [q1, r2, r3, r4, q5, q6]],
            real: [real, real],
        }
    }
}

/// Bends of the elbow, and where the point to be reached is from axis 2.
struct Elbow<A: Arith> {
    bend: Pair<A>,
    away: Vec4<A>,
}

/// Turns about three axes whose product brings the third axis to `axis`, and `spin`,
/// at right angles to it, to `spun`. Where the first and third axis fall together the
/// first is held. Beside them both answers for the middle one. The sine and cosine
/// of the last turn may have any length.
#[inline(always)]
pub(crate) fn orient<A: Arith>(
    [first, middle, last]: [[f64; 3]; 3],
    (axis, spun, spin): (Vec4<A>, Vec4<A>, [f64; 3]),
    sign: [f64; 4],
    hold: [Held; 3],
) -> ([Angle<A>; 3], Pair<A>) {
    let a = axis.0[0].build();
    let level = axis.along(first);
    let wave = Wave::of(Vec4::splat(a, first), middle, Vec4::splat(a, last), level);
    // With the middle axis square to both, the discriminant is the squared sine between
    // first axis and target; taken from their product it stays exact when small.
    let tilts = if square([first, middle, last]) {
        let across = Vec4::splat(a, first).cross(axis);
        let one = F4::splat(a, 1.0);
        wave.with_rest(across.dot(across), (one, one), 1e-12)
    } else {
        wave.solve(1e-12)
    };
    let tilt = tilts.pick(sign, hold[1]);
    let tilted = Vec4::splat(a, last).turned(middle, tilt);
    let swing = turn_to(tilted, axis, first, hold[0]);
    let left = spun.turned(first, swing.back()).turned(middle, tilt.back());
    let roll = last_turn_to(Vec4::splat(a, spin), left, last, hold[2]);
    ([swing, tilt, roll], tilts)
}

/// Whether the middle axis is square to both others.
#[inline(always)]
fn square([first, middle, last]: [[f64; 3]; 3]) -> bool {
    dot(first, middle).abs() < 1e-12 && dot(middle, last).abs() < 1e-12
}

/// Both answers of [`orient`] as angles (rad), each with whether it is real.
#[inline(always)]
pub(crate) fn orient_both<A: Arith>(
    axes: [[f64; 3]; 3],
    goal: (Vec4<A>, Vec4<A>, [f64; 3]),
    hold: [Held; 3],
) -> [([F4<A>; 3], B4<A>); 2] {
    let (turns, tilts) = orient(axes, goal, [1.0; 4], hold);
    let first = angles_of(turns);
    if square(axes) {
        // Half a turn of the outer two and the middle one mirrored is the same.
        let half = F4::splat(first[0].build(), PI);
        let tilt = angle_of(tilts.pick([-1.0; 4], hold[1]));
        let swing = first[0] - half.signed(first[0]);
        let second = [swing, tilt, first[2] - half.signed(first[2])];
        return [(first, tilts.real), (second, tilts.real)];
    }
    let (turns, other) = orient(axes, goal, [-1.0; 4], hold);
    [(first, tilts.real), (angles_of(turns), other.real)]
}
