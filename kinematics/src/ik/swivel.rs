//! Closed form of seven-joint arms with a spherical shoulder and a spherical wrist.
//!
//! The free parameter is the swivel angle: the angle of the plane of the arm about the line from
//! shoulder to wrist, measured from the plane through that line and axis 1.

use super::orient::{AxisGoal, orient, orient_both};
use super::product::Product;
use super::six::{Joints, dot, minus};
use super::subproblems::{FIRST, Held, SECOND, TrigEquation, Vec4, angle_of, angles_of};
use crate::links::{ScrewAxis, across};
use nalgebra::{Rotation3, Unit, Vector3};
use simd::{F4, Four};

/// Axes at q = 0 of an arm with spherical shoulder, one elbow joint and spherical wrist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swivel {
    lines: [ScrewAxis; 7],
    shoulder: [f64; 3],
    wrist: [f64; 3],
    slack: f64,
}

impl Swivel {
    pub(crate) fn new(
        lines: &[ScrewAxis; 7],
        shoulder: [f64; 3],
        wrist: [f64; 3],
        slack: f64,
    ) -> Self {
        Self {
            lines: *lines,
            shoulder,
            wrist,
            slack,
        }
    }

    /// Direction from which the swivel angle is measured, perpendicular to `along`.
    fn reference(&self, along: &Vector3<f64>) -> Vector3<f64> {
        let up = Vector3::from(self.lines[0].h);
        let side = up.cross(along);
        if side.norm_squared() > 1e-8 {
            return side.normalize();
        }
        let other = Vector3::from(across(self.lines[0].h));
        (other - along * along.dot(&other)).normalize()
    }

    /// Turn of joints 1 to 3 (or any) from the product of turns about their axes.
    fn product_of(&self, joints: std::ops::Range<usize>, q: &[f64; 7]) -> Rotation3<f64> {
        joints.fold(Rotation3::identity(), |sum, i| {
            sum * Rotation3::from_axis_angle(
                &Unit::new_unchecked(Vector3::from(self.lines[i].h)),
                q[i],
            )
        })
    }

    /// The wrist as seen from the shoulder after joint 4 has turned, at q1 = q2 = q3 = 0.
    fn bent(&self, q4: f64) -> Vector3<f64> {
        let elbow = Vector3::from(self.lines[3].p);
        let axis = Unit::new_unchecked(Vector3::from(self.lines[3].h));
        let turn = Rotation3::from_axis_angle(&axis, q4);
        turn * (Vector3::from(self.wrist) - elbow) + elbow - Vector3::from(self.shoulder)
    }

    /// Swivel of a joint position, rad.
    pub(crate) fn of(&self, q: &[f64; 7]) -> f64 {
        let shoulder = self.product_of(0..3, q);
        let bent = self.bent(q[3]);
        let along = (shoulder * bent).normalize();
        let hinge = shoulder * Vector3::from(self.lines[3].h);
        let side = hinge - along * along.dot(&hinge);
        let reference = self.reference(&along);
        reference
            .cross(&side)
            .dot(&along)
            .atan2(reference.dot(&side))
    }

    /// All branches at one swivel (rad).
    #[inline(always)]
    pub(crate) fn solve<A: Four>(
        &self,
        g: &Product<A>,
        swivel: f64,
        hold: &[f64; 7],
    ) -> Joints<A, 7> {
        let a = g.build();
        let hold = Held::all(a, *hold);
        let h = |i: usize| self.lines[i].h;
        let (elbow, away) = (self.lines[3].p, minus(g.point(self.wrist), self.shoulder));
        let (reach, upper) = (minus(self.wrist, elbow), minus(self.shoulder, elbow));
        let d = 0.5 * (dot(reach, reach) + dot(upper, upper) - dot(away, away));
        let forearm = Vec4::splat(a, reach);
        let wave = TrigEquation::of(Vec4::splat(a, upper), h(3), forearm, F4::splat(a, d));
        let bends = wave.solve(self.slack);
        let bend = bends.pick(FIRST, hold[3]);

        // Axes 1 to 3 turn the plane of the arm onto the line to the wrist, at the swivel asked for.
        let [along, side, normal] = self.plane(a, away, swivel);
        let bent = forearm.turned(h(3), bend).minus(upper).unit();
        let hinge = Vec4::splat(a, h(3));
        let across_bent = bent.times_plus(-bent.dot(hinge), hinge).unit();
        let frame = [bent, across_bent, bent.cross(across_bent)];
        let plane = [
            Vec4::splat(a, along),
            Vec4::splat(a, side),
            Vec4::splat(a, normal),
        ];
        let spin = across(h(2));
        let goal = AxisGoal {
            axis: carried(Vec4::splat(a, h(2)), &frame, &plane),
            spun: carried(Vec4::splat(a, spin), &frame, &plane),
            spin,
        };
        let (arm, tilts) = orient(
            [h(0), h(1), h(2)],
            goal,
            SECOND,
            [hold[0], hold[1], hold[2]],
        );
        let real = bends.real & tilts.real;
        let spin = across(h(6));
        let axis = carried(Vec4::splat(a, g.turn(h(6))), &plane, &frame);
        let spun = carried(Vec4::splat(a, g.turn(spin)), &plane, &frame);
        let goal = AxisGoal {
            axis: axis.turned(h(3), bend.back()),
            spun: spun.turned(h(3), bend.back()),
            spin,
        };
        let hold = [hold[4], hold[5], hold[6]];
        let [(first, ok_first), (second, ok_second)] = orient_both([h(4), h(5), h(6)], goal, hold);
        let ([q1, q2, q3], q4) = (angles_of(arm), angle_of(bend));
        let ([q5, q6, q7], [r5, r6, r7]) = (first, second);
        Joints {
            angles: [[q1, q2, q3, q4, q5, q6, q7], [q1, q2, q3, q4, r5, r6, r7]],
            real: [real & ok_first, real & ok_second],
        }
    }

    /// The plane of the arm: the direction to the wrist, the axis of the elbow at a swivel angle
    /// (rad), and the direction perpendicular to both.
    #[inline(always)]
    fn plane<A: Four>(&self, a: A, away: [f64; 3], swivel: f64) -> [[f64; 3]; 3] {
        let scale = |v: [f64; 3], s: f64| v.map(|x| x * s);
        let along = scale(away, 1.0 / dot(away, away).sqrt());
        let up = self.lines[0].h;
        let mut reference = cross(up, along);
        let mut square = dot(reference, reference);
        if square <= 1e-8 {
            let other = across(up);
            reference = minus(other, scale(along, dot(along, other)));
            square = dot(reference, reference);
        }
        let reference = scale(reference, 1.0 / square.sqrt());
        let ([s], [c]) = simd::sin_cos(a, [swivel]);
        let (one, other) = (scale(reference, c), scale(cross(along, reference), s));
        let side = [one[0] + other[0], one[1] + other[1], one[2] + other[2]];
        [along, side, cross(along, side)]
    }
}

/// A vector taken along from one frame of unit vectors to another.
#[inline(always)]
fn carried<A: Four>(v: Vec4<A>, from: &[Vec4<A>; 3], to: &[Vec4<A>; 3]) -> Vec4<A> {
    let sum = to[0].times(from[0].dot(v));
    let sum = to[1].times_plus(from[1].dot(v), sum);
    to[2].times_plus(from[2].dot(v), sum)
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
