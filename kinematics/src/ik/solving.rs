//! The computation of one closed form of six joints: four branches at once, in the frames of the
//! arm.

use super::product::{Columns, Product, inverse};
use super::six::{Joints, Placing, Shape, Six, dot};
use super::subproblems::{Angle, FIRST, Held, SECOND, angle_of, angles_of};
use simd::{F4, Four, Mask};
use std::f64::consts::PI;

/// A vector in each lane.
type V3<A> = [F4<A>; 3];

/// Squared length, relative, below which a direction is undefined.
const FREE: f64 = 1e-50;

/// Squared lengths this near to one are made one by a single step of Newton's method.
const NEAR_ONE: f64 = 1e-8;

/// The state of one computation.
struct Solving<'a, A: Four> {
    a: A,
    six: &'a Six,
    hold: Option<&'a [Held; 7]>,
    /// Where every joint is determined.
    sure: Mask<A>,
}

impl Six {
    /// All branches, as angles of the six joints in the order of the frames, of a product
    /// of turns already multiplied with [`Six::right`]. `hold` are joint positions (rad)
    /// for joints that a singular pose leaves free.
    #[inline(always)]
    pub(crate) fn solve<A: Four>(&self, product: &Product<A>, hold: [f64; 6]) -> Joints<A, 6> {
        let mut seen = product.seen_from(&self.left);
        if self.reversed {
            seen = inverse(&seen);
        }
        let a = product.build();
        let mut quick = Solving::new(a, self, None);
        let mut found = quick.solve(&seen);
        let real = found.real[0].bits() | found.real[1].bits();
        if real & !quick.sure.bits() != 0 {
            found = self.held(a, &seen, hold);
        }
        for group in &mut found.angles {
            for i in 0..6 {
                let sign = F4::splat(a, self.signs[i]);
                group[i] = group[i].fma(sign, F4::splat(a, self.offsets[i]));
            }
        }
        found
    }

    /// The same where the pose leaves a joint free.
    #[inline(always)]
    fn held<A: Four>(&self, a: A, seen: &Columns, hold: [f64; 6]) -> Joints<A, 6> {
        let (slots, mut angles) = (self.slots(), [0.0; 7]);
        for i in 0..6 {
            angles[i] = self.signs[i] * (hold[slots[i]] - self.offsets[i]);
        }
        // The seventh is the sum of the turns about parallel axes.
        angles[6] = angles[1] + angles[2] + angles[3];
        let held = Held::all(a, angles);
        Solving::new(a, self, Some(&held)).solve(seen)
    }
}

impl<'a, A: Four> Solving<'a, A> {
    #[inline(always)]
    fn new(a: A, six: &'a Six, hold: Option<&'a [Held; 7]>) -> Self {
        let zero = F4::splat(a, 0.0);
        let sure = zero.le(zero);
        Self { a, six, hold, sure }
    }

    #[inline(always)]
    fn number(&self, x: f64) -> F4<A> {
        F4::splat(self.a, x)
    }

    #[inline(always)]
    fn vector(&self, v: [f64; 3]) -> V3<A> {
        [self.number(v[0]), self.number(v[1]), self.number(v[2])]
    }

    /// All branches of a product of rotations, expressed in the frames.
    #[inline(always)]
    fn solve(&mut self, seen: &Columns) -> Joints<A, 6> {
        match self.six.shape {
            Shape::Wrist(_, Placing::Parallel) => self.wrist_on_parallels(seen),
            Shape::Wrist(_, Placing::Meeting(_)) => self.wrist_on_meeting(seen),
            Shape::Parallels(_) => self.parallels(seen),
        }
    }

    /// The angle if `known`, else the held one of a joint.
    #[inline(always)]
    fn or_held(&mut self, angle: Angle<A>, known: Mask<A>, joint: usize) -> Angle<A> {
        self.sure = self.sure & known;
        let Some(hold) = self.hold else { return angle };
        let held = hold[joint];
        Angle {
            sin: known.select(angle.sin, self.number(held.sin)),
            cos: known.select(angle.cos, self.number(held.cos)),
        }
    }

    /// The angle with these cosine and sine of any length, both zero beside `scale` where
    /// the joint is free.
    #[inline(always)]
    fn turn(&mut self, [cos, sin]: [F4<A>; 2], scale: f64, joint: usize) -> Angle<A> {
        let square = cos.fma(cos, sin * sin);
        let length = self.number(1.0) / square.sqrt();
        let angle = Angle {
            sin: sin * length,
            cos: cos * length,
        };
        self.or_held(angle, self.number(scale * FREE).le(square), joint)
    }

    /// The same if the length is known up to rounding, so that no square root is needed.
    #[inline(always)]
    fn turn_by(&mut self, [cos, sin]: [F4<A>; 2], known: KnownLength<A>, joint: usize) -> Angle<A> {
        let KnownLength {
            length,
            scale,
            real,
        } = known;
        let one = self.number(1.0);
        let inverse = one / length;
        let (c, s) = (cos * inverse, sin * inverse);
        let over = c.fma(c, s.fma(s, -one));
        let near = over.abs().le(self.number(NEAR_ONE));
        if !near.bits() & real.bits() != 0 {
            return self.turn([cos, sin], scale, joint);
        }
        let scale = over.taken_from(self.number(0.5), one);
        Angle {
            sin: s * scale,
            cos: c * scale,
        }
    }

    /// Turns about axis 1 that bring a point, from where it is at the right height along
    /// axis 2, to where it is `seen`. Beside them the point seen from axis 2, and which exist.
    #[inline(always)]
    fn base(&mut self, [x, y, z]: [f64; 3], height: f64) -> (Angle<A>, [F4<A>; 2], Mask<A>) {
        let step = &self.six.frames.steps[0];
        let a = self.a;
        let up = z - step.shift[2];
        let side = (step.cos * up - height) * self.six.inverse[0];
        let mut d = step.shift[1] + side;
        let square = a.fma(x, x, y * y);
        let rest = a.fma(-d, d, square);
        let known = square > 1e-20 * a.fma(z, z, square);
        let whole = if known { square } else { square + z * z };
        let real = self.number(-self.six.slack * whole).le(self.number(rest));
        if rest < 0.0 {
            d = square.sqrt().copysign(d);
        }
        let root = self.number(rest.max(0.0).sqrt()) * F4::new(a, FIRST);
        let inverse = 1.0 / square;
        let (x, y) = (x * inverse, y * inverse);
        let angle = Angle {
            sin: root.fma(self.number(y), self.number(-d * x)),
            cos: root.fma(self.number(x), self.number(d * y)),
        };
        let known = self.number(1.0).le(self.number(f64::from(u8::from(known))));
        let angle = self.or_held(angle, known, 0);
        let out = root - self.number(step.shift[0]);
        let high = self.number(step.cos * side + step.sin * up);
        (angle, [out, high], real)
    }

    /// Sine (not negative) and cosine of the bends of the elbow at which its links reach to
    /// a point in their plane, and which exist.
    #[inline(always)]
    fn elbow(&self, [u, v]: [F4<A>; 2]) -> (Angle<A>, Mask<A>) {
        let [upper, fore] = self.six.links;
        let both = self.number(upper * upper + fore * fore);
        let cos = (u.fma(u, v * v) - both) * (0.5 / (upper * fore));
        self.arc(cos)
    }

    /// An angle by its cosine; beyond one by no more than rounding it is none or half a turn.
    #[inline(always)]
    fn arc(&self, cos: F4<A>) -> (Angle<A>, Mask<A>) {
        let (zero, one) = (self.number(0.0), self.number(1.0));
        let rest = cos.taken_from(cos, one);
        self.arc_with(cos, rest, zero, one)
    }

    #[inline(always)]
    fn arc_with(&self, cos: F4<A>, rest: F4<A>, zero: F4<A>, one: F4<A>) -> (Angle<A>, Mask<A>) {
        let real = self.number(-self.six.slack).le(rest);
        let angle = Angle {
            sin: rest.max(zero).sqrt(),
            cos: zero.le(rest).select(cos, one.signed(cos)),
        };
        (angle, real)
    }

    /// Turns about axis 2 that bring the links, bent by `bend`, to a point in their plane;
    /// `real` tells where they reach it.
    #[inline(always)]
    fn lift(&mut self, [u, v]: [F4<A>; 2], bend: Angle<A>, real: Mask<A>) -> Angle<A> {
        let [upper, fore] = self.six.links;
        let along = bend.cos.fma(self.number(fore), self.number(upper));
        let off = bend.sin * fore;
        let cos = u.fma(along, v * off);
        let sin = u.taken_from(off, v * along);
        let square = upper * upper + fore * fore;
        let known = KnownLength {
            length: u.fma(u, v * v),
            scale: square * square,
            real,
        };
        self.turn_by([cos, sin], known, 1)
    }

    /// A spherical wrist placed by two parallel axes.
    #[inline(always)]
    fn wrist_on_parallels(&mut self, [x, _, z, p]: &Columns) -> Joints<A, 6> {
        let [first, _, third, ..] = self.six.frames.steps;
        let (swing, point, real) = self.base(*p, third.shift[2]);
        let (bend, bends) = self.elbow(point);
        let bend = Angle {
            sin: bend.sin * F4::new(self.a, SECOND),
            cos: bend.cos,
        };
        let lift = self.lift(point, bend, bends);
        let [sin, cos] = self.six.bend;
        let fore = Angle {
            sin: self.number(-sin),
            cos: self.number(cos),
        };
        let sum = lift.plus(bend).plus(fore);
        let mut goal = [self.vector(*z), self.vector(*x)];
        for v in &mut goal {
            let seen = about_x(about_z(*v, swing), first.sin, first.cos);
            *v = about_x(about_z(seen, sum), third.sin, third.cos);
        }
        self.wrist([swing, lift, bend], goal, real & bends)
    }

    /// A spherical wrist placed by axes of which the first two meet.
    #[inline(always)]
    fn wrist_on_meeting(&mut self, [x, _, z, p]: &Columns) -> Joints<A, 6> {
        let [first, second, third, ..] = self.six.frames.steps;
        let far = dot(*p, *p);
        let (bend, bends) = self.bends(far);
        // The wrist in the frame that axis 2 moves.
        let (fore, [a, b, d], height) = (self.six.links[1], second.shift, third.shift[2]);
        let (c3, s3) = (bend.cos * fore, bend.sin * fore);
        let wrist = [
            c3 + self.number(a),
            s3.fma(
                self.number(second.cos),
                self.number(b - second.sin * height),
            ),
            s3.fma(
                self.number(second.sin),
                self.number(d + second.cos * height),
            ),
        ];
        let (lift, out, lifts) = self.raised(wrist, p[2]);
        let level = wrist[2].taken_from(self.number(first.sin), out[1] * first.cos);
        let (px, py) = (self.number(p[0]), self.number(p[1]));
        let cos = px.fma(out[0], py * level);
        let sin = px.taken_from(level, py * out[0]);
        let across = self.number(p[0] * p[0] + p[1] * p[1]);
        let known = KnownLength {
            length: across,
            scale: far * far,
            real: bends & lifts,
        };
        let swing = self.turn_by([cos, sin], known, 0);
        let [sin, cos] = self.six.bend;
        let twist = bend.plus(Angle {
            sin: self.number(-sin),
            cos: self.number(cos),
        });
        let mut goal = [self.vector(*z), self.vector(*x)];
        for v in &mut goal {
            let seen = about_x(about_z(*v, swing), first.sin, first.cos);
            let seen = about_x(about_z(seen, lift), second.sin, second.cos);
            *v = about_x(about_z(seen, twist), third.sin, third.cos);
        }
        self.wrist([swing, lift, bend], goal, bends & lifts)
    }

    /// Bends of axis 3 that bring the wrist to a squared distance `far` from where axes 1
    /// and 2 meet.
    #[inline(always)]
    fn bends(&self, far: f64) -> (Angle<A>, Mask<A>) {
        let [_, second, third, ..] = self.six.frames.steps;
        let (fore, height) = (self.six.links[1], third.shift[2]);
        let ([a, b, d], (sin, cos)) = (second.shift, (second.sin, second.cos));
        let (x, y) = (2.0 * a * fore, 2.0 * fore * (b * cos + d * sin));
        let still = dot(second.shift, second.shift) + fore * fore + height * height;
        let mut want = far - still - 2.0 * height * (d * cos - b * sin);
        let square = x * x + y * y;
        let rest = self.a.fma(-want, want, square);
        let real = self.number(-self.six.slack * square).le(self.number(rest));
        if rest < 0.0 {
            want = square.sqrt().copysign(want);
        }
        let root = self.number(rest.max(0.0).sqrt()) * F4::new(self.a, FIRST);
        let (x, y) = (x / square, y / square);
        let angle = Angle {
            sin: root.fma(self.number(x), self.number(want * y)),
            cos: root.taken_from(self.number(y), self.number(want * x)),
        };
        (angle, real)
    }

    /// Turns about axis 2 after which a point is at a height along axis 1; beside them
    /// where it then is across axis 2, and which exist.
    #[inline(always)]
    fn raised(&mut self, [x, y, z]: V3<A>, height: f64) -> (Angle<A>, [F4<A>; 2], Mask<A>) {
        let step = self.six.frames.steps[0];
        let zero = self.number(0.0);
        let up = z.taken_from(self.number(step.cos), self.number(height)) * self.six.inverse[0];
        let square = x.fma(x, y * y);
        let rest = up.taken_from(up, square);
        let real = (square * -self.six.slack).le(rest);
        let up = zero.le(rest).select(up, square.sqrt().signed(up));
        let root = rest.max(zero).sqrt() * F4::new(self.a, SECOND);
        let inverse = self.number(1.0) / square;
        let (x, y) = (x * inverse, y * inverse);
        let angle = Angle {
            sin: root.taken_from(y, up * x),
            cos: root.fma(x, up * y),
        };
        let known = (z.fma(z, square) * 1e-20).le(square);
        (self.or_held(angle, known, 1), [root, up], real)
    }

    /// Both wrists of each arm position, from the directions that the last axis and the x
    /// axis of the last frame are to have, seen by axis 4.
    #[inline(always)]
    fn wrist(&mut self, arm: [Angle<A>; 3], goal: [V3<A>; 2], real: Mask<A>) -> Joints<A, 6> {
        let (turns, tilts) = self.orient(goal, [1.0; 4], [3, 4, 5]);
        let ([q1, q2, q3], [q4, q5, q6]) = (angles_of(arm), angles_of(turns));
        let real = real & tilts;
        let [r4, r5, r6] = if self.six.square {
            // Half a turn of the outer two and the middle one mirrored is the same.
            let half = self.number(PI);
            [q4 - half.signed(q4), -q5, q6 - half.signed(q6)]
        } else {
            angles_of(self.orient(goal, [-1.0; 4], [3, 4, 5]).0)
        };
        Joints {
            angles: [[q1, q2, q3, q4, q5, q6], [q1, q2, q3, r4, r5, r6]],
            real: [real, real],
        }
    }

    /// Turns before, about and after axis 5 that bring the last axis to `axis` and the x
    /// axis of the last frame to `spin`, and which exist. Where the outer two fall together
    /// the first is held.
    #[inline(always)]
    fn orient(
        &mut self,
        [axis, spin]: [V3<A>; 2],
        sign: [f64; 4],
        joints: [usize; 3],
    ) -> ([Angle<A>; 3], Mask<A>) {
        let [.., fourth, fifth] = self.six.frames.steps;
        let both = self.six.inverse[1];
        let still = self.number(fourth.cos * fifth.cos * both);
        let cos = axis[2].taken_from(self.number(both), still);
        let (zero, one) = (self.number(0.0), self.number(1.0));
        // With axis 5 perpendicular to both, the squared sine is exact even when it is small.
        let rest = if self.six.square {
            axis[0].fma(axis[0], axis[1] * axis[1])
        } else {
            cos.taken_from(cos, one)
        };
        let (mut tilt, real) = self.arc_with(cos, rest, zero, one);
        tilt.sin = tilt.sin * F4::new(self.a, sign);
        let swing = if self.six.square {
            // The last axis leans over by the tilt, right to where it is to point.
            let unit = tilt.sin * (one / rest);
            let angle = Angle {
                sin: axis[1] * unit,
                cos: axis[0] * unit,
            };
            self.or_held(angle, self.number(FREE.sqrt()).le(rest), joints[0])
        } else {
            // The last axis as the joint before axis 5 carries it.
            let out = tilt.sin * fifth.sin;
            let side = tilt.cos.taken_from(
                self.number(fifth.sin * fourth.cos),
                self.number(-fifth.cos * fourth.sin),
            );
            let cos = axis[0].fma(out, axis[1] * side);
            let sin = axis[0].taken_from(side, axis[1] * out);
            self.turn([cos, sin], 1.0, joints[0])
        };
        let left = about_x(about_z(spin, swing), fourth.sin, fourth.cos);
        let [x, y, _] = about_x(about_z(left, tilt), fifth.sin, fifth.cos);
        ([swing, tilt, Angle { sin: y, cos: x }], real)
    }

    /// Branches of three parallel axes.
    #[inline(always)]
    fn parallels(&mut self, [x, _, z, p]: &Columns) -> Joints<A, 6> {
        let [first, .., fourth, _] = self.six.frames.steps;
        let (swing, [u, v], real) = self.base(*p, fourth.shift[2]);
        let mut goal = [self.vector(*z), self.vector(*x)];
        for v in &mut goal {
            *v = about_x(about_z(*v, swing), first.sin, first.cos);
        }
        // The three parallel turns are one turn by their sum, then axes 5 and 6 follow.
        let ([sum, q5, q6], tilts) = self.orient(goal, SECOND, [6, 4, 5]);
        // Where axis 4 is, from the point in which axes 5 and 6 meet.
        let (a, b) = (self.number(fourth.shift[0]), self.number(fourth.shift[1]));
        let u = sum.sin.fma(b, sum.cos.taken_from(a, u));
        let v = v - sum.sin.fma(a, sum.cos * b);
        let (bend, bends) = self.elbow([u, v]);
        let q2 = self.lift([u, v], bend, bends);
        let r2 = self.lift([u, v], bend.back(), bends);
        let (q1, [sum, q5, q6]) = (angle_of(swing), angles_of([sum, q5, q6]));
        let [q2, r2, q3] = angles_of([q2, r2, bend]);
        let real = real & tilts & bends;
        Joints {
            angles: [
                [q1, q2, q3, sum - q2 - q3, q5, q6],
                [q1, r2, -q3, sum - r2 + q3, q5, q6],
            ],
            real: [real, real],
        }
    }
}

/// The length of a cosine and sine, up to rounding; `scale` is that beside which both zero means
/// that the joint is free, and `real` tells in which lanes the length must be right.
struct KnownLength<A: Four> {
    length: F4<A>,
    scale: f64,
    real: Mask<A>,
}

/// A vector seen from a frame turned about z.
#[inline(always)]
fn about_z<A: Four>([x, y, z]: V3<A>, angle: Angle<A>) -> V3<A> {
    [
        x.fma(angle.cos, y * angle.sin),
        x.taken_from(angle.sin, y * angle.cos),
        z,
    ]
}

/// A vector seen from a frame turned about x.
#[inline(always)]
fn about_x<A: Four>([x, y, z]: V3<A>, sin: f64, cos: f64) -> V3<A> {
    let a = x.build();
    let (sin, cos) = (F4::splat(a, sin), F4::splat(a, cos));
    [x, y.fma(cos, z * sin), y.taken_from(sin, z * cos)]
}
