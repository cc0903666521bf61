//! Closed form of seven-joint arms with a spherical shoulder and a spherical wrist.
//!
//! The spare joint is expressed by the swivel: the angle of the plane of the arm
//! about the line from shoulder to wrist, counted from the plane through that line
//! and axis 1.

use super::lanes::{Angle, B4, FIRST, SECOND, Vec4, Wave, both, splat};
use super::six::{Line, Product, across, orient};
use crate::arith::{self, Arith};
use nalgebra::{Rotation3, Unit, Vector3};

/// Axes at q = 0 of an arm with spherical shoulder, one elbow joint and spherical wrist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swivel {
    lines: [Line; 7],
    shoulder: [f64; 3],
    wrist: [f64; 3],
    slack: f64,
}

/// Sines and cosines of seven joints in two groups of four branches.
pub(crate) struct SevenAngles {
    pub(crate) joints: [[Angle; 7]; 2],
    pub(crate) real: [B4; 2],
}

impl Swivel {
    pub(crate) fn new(lines: &[Line; 7], shoulder: [f64; 3], wrist: [f64; 3], slack: f64) -> Self {
        Self {
            lines: *lines,
            shoulder,
            wrist,
            slack,
        }
    }

    /// Direction from which the swivel is counted, at right angles to `along`.
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
    pub(crate) fn solve<A: Arith>(
        &self,
        a: A,
        g: &Product,
        swivel: f64,
        hold: &[f64; 7],
    ) -> SevenAngles {
        let (sin, cos) = arith::sin_cos(a, *hold);
        let held: [Angle; 7] = std::array::from_fn(|i| Angle::splat(sin[i], cos[i]));
        let h = |i: usize| self.lines[i].h;
        let (elbow, away) = (self.lines[3].p, minus(g.point(self.wrist), self.shoulder));
        let (reach, upper) = (minus(self.wrist, elbow), minus(self.shoulder, elbow));
        let d = 0.5 * (square(reach) + square(upper) - square(away));
        let bend = Wave::of(a, Vec4::splat(upper), h(3), Vec4::splat(reach), splat(d))
            .solve(a, FIRST, held[3], self.slack);

        // Axes 1 to 3 turn the plane of the arm onto the line to the wrist, at the swivel asked for.
        let along = Vector3::from(away).normalize();
        let reference = self.reference(&along);
        let (s, c) = swivel.sin_cos();
        let side = reference * c + along.cross(&reference) * s;
        let target = frame_of(&along, &side);
        let place = |lane: usize| {
            let q4 = bend.angle.sin[lane].atan2(bend.angle.cos[lane]);
            let bent = self.bent(q4).normalize();
            let hinge = Vector3::from(h(3));
            let across = (hinge - bent * bent.dot(&hinge)).normalize();
            target * frame_of(&bent, &across).transpose()
        };
        let shoulders = [place(0), place(1)];
        let column = |v: [f64; 3]| {
            let turned = shoulders.map(|r| r * Vector3::from(v));
            Vec4(std::array::from_fn(|i| {
                [turned[0][i], turned[1][i], turned[0][i], turned[1][i]]
            }))
        };
        let spin = across(h(2));
        let (arm, ok) = orient(
            a,
            [h(0), h(1), h(2)],
            (column(h(2)), column(spin), spin),
            SECOND,
            [held[0], held[1], held[2]],
        );
        let real = both(bend.real, ok);
        let seen = |v: [f64; 3]| {
            Vec4::splat(g.turn(v))
                .turned(a, h(0), arm[0].back())
                .turned(a, h(1), arm[1].back())
                .turned(a, h(2), arm[2].back())
                .turned(a, h(3), bend.angle.back())
        };
        let spin = across(h(6));
        let (axis, spun) = (seen(h(6)), seen(spin));
        let half = |sign: f64| {
            let hold = [held[4], held[5], held[6]];
            let ([q5, q6, q7], ok) =
                orient(a, [h(4), h(5), h(6)], (axis, spun, spin), splat(sign), hold);
            (
                [arm[0], arm[1], arm[2], bend.angle, q5, q6, q7],
                both(real, ok),
            )
        };
        let ((first, ok_first), (second, ok_second)) = (half(1.0), half(-1.0));
        SevenAngles {
            joints: [first, second],
            real: [ok_first, ok_second],
        }
    }
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn square(v: [f64; 3]) -> f64 {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

/// A rotation whose first two columns are two directions at right angles.
#[inline(always)]
fn frame_of(x: &Vector3<f64>, y: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    nalgebra::Matrix3::from_columns(&[*x, *y, x.cross(y)])
}
