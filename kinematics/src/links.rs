//! The links of a serial arm, as frames on its axes: z along each axis, x perpendicular to it and
//! to the axis before. So each link is one rotation about x and a shift in the plane.
//!
//! # Source
//! J. Denavit and R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
//! matrices", J. Appl. Mech. 22, 1955; here each origin is the point of its axis that is nearest to
//! the origin before it, so that no number becomes large if axes are nearly parallel.

use crate::urdf::{JointKind, Model};
use nalgebra::{Isometry3, SVector, Vector3};
use simd::{F4, Four, Frame, Moving, Turn, V4, sin_cos_of};

/// An axis with all joints at zero: its direction and a point on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScrewAxis {
    pub(crate) h: [f64; 3],
    pub(crate) p: [f64; 3],
}

/// The links of an arm of `N` joints. The step from the frame of a joint, turned about its z axis,
/// to the frame of the next joint is a rotation about x and then a shift along the new x and y
/// axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Links<const N: usize> {
    /// The first joint's frame.
    first: Frame,
    /// Angle from x axis to x axis with all joints at zero, rad.
    zero: [f64; N],
    /// Rotation and shift (m) after each joint; none after the last.
    turn: [Turn; N],
    shift: [[f64; 2]; N],
    /// The end in the frame of the last joint.
    last: Frame,
    /// One for a joint that turns and zero for one that slides.
    turns: [f64; N],
    all_turn: bool,
}

/// Position and axis of every joint, and the end of the arm.
pub(crate) struct Reached<A: Four, const N: usize> {
    pub(crate) points: [F4<A>; N],
    pub(crate) axes: [F4<A>; N],
    pub(crate) end: Moving<A>,
}

impl<const N: usize> Links<N> {
    /// A ball that contains every position of the end: its centre and its radius (m). `stroke`
    /// gives the largest distance of a sliding joint from zero.
    pub(crate) fn ball(&self, stroke: impl Fn(usize) -> f64) -> ([f64; 3], f64) {
        let shifts = self.shift.iter().map(|[x, y]| x.hypot(*y));
        let strokes = (0..N).map(|i| (1.0 - self.turns[i]) * stroke(i));
        let [x, y, z, _] = self.last.p.0;
        let end = (x * x + y * y + z * z).sqrt();
        let [x, y, z, _] = self.first.p.0;
        ([x, y, z], shifts.chain(strokes).sum::<f64>() + end)
    }

    /// The links of a model with `N` joints, from its base to its flange.
    pub(crate) fn of(model: &Model) -> Self {
        let mut place = Isometry3::identity();
        let lines: [ScrewAxis; N] = std::array::from_fn(|i| {
            place *= model.frames[i];
            ScrewAxis {
                h: (place.rotation * model.axes[i]).into_inner().into(),
                p: place.translation.vector.into(),
            }
        });
        let turns = |i: usize| model.joints[i].kind != JointKind::Prismatic;
        let mut links = Self::along(&lines);
        let flange = Frame::from_isometry(&(place * model.last_from_flange));
        links.last = links.last.inverse() * flange;
        links.turns = std::array::from_fn(|i| f64::from(u8::from(turns(i))));
        links.all_turn = (0..N).all(turns);
        links
    }

    /// The links between turning joints on given axes; the frame of the last joint is also that of
    /// the end.
    fn along(lines: &[ScrewAxis; N]) -> Self {
        let z = lines.map(|line| Vector3::from(line.h));
        let mut x = [Vector3::from(across(lines[0].h)); N];
        let mut origins = [Vector3::from(lines[0].p); N];
        let (mut zero, mut shift) = ([0.0; N], [[0.0; 2]; N]);
        let mut turn = [Turn { sin: 0.0, cos: 1.0 }; N];
        for i in 1..N {
            origins[i] = foot(&lines[i], &origins[i - 1]);
            let way = origins[i] - origins[i - 1];
            x[i] = normal(&z[i - 1], &z[i], &way);
            if i == 1 {
                x[0] = x[1];
            }
            let y = z[i - 1].cross(&x[i - 1]);
            zero[i - 1] = y.dot(&x[i]).atan2(x[i - 1].dot(&x[i]));
            turn[i - 1] = Turn {
                sin: z[i - 1].cross(&z[i]).dot(&x[i]),
                cos: z[i - 1].dot(&z[i]),
            };
            shift[i - 1] = [way.dot(&x[i]), way.dot(&z[i].cross(&x[i]))];
        }
        let column = |v: Vector3<f64>| V4::new(v.x, v.y, v.z);
        let frame = |i: usize| Frame {
            x: column(x[i]),
            y: column(z[i].cross(&x[i])),
            z: column(z[i]),
            p: column(origins[i]),
        };
        Self {
            first: frame(0),
            zero,
            turn,
            shift,
            last: frame(N - 1),
            turns: [1.0; N],
            all_turn: true,
        }
    }

    /// The same links with another base and another tool.
    pub(crate) fn between(&self, base: &Isometry3<f64>, tool: &Isometry3<f64>) -> Self {
        Self {
            first: Frame::from_isometry(base) * self.first,
            last: self.last * Frame::from_isometry(tool),
            ..*self
        }
    }

    /// Whether no joint slides.
    pub(crate) fn all_turn(&self) -> bool {
        self.all_turn
    }

    /// Whether a joint slides.
    #[inline(always)]
    pub(crate) fn slides(&self, joint: usize) -> bool {
        !self.all_turn && self.turns[joint] == 0.0
    }

    /// Distance (m) from the frame of a joint to that of the next, or from the last to the end.
    pub(crate) fn beyond(&self, joint: usize) -> f64 {
        if joint + 1 < N {
            let [x, y] = self.shift[joint];
            return x.hypot(y);
        }
        let [x, y, z, _] = self.last.p.0;
        (x * x + y * y + z * z).sqrt()
    }

    /// Computes the positions along the links with the joints at `q` (rad, m).
    #[inline(always)]
    pub(crate) fn reach<A: Four>(&self, a: A, q: &SVector<f64, N>) -> Reached<A, N> {
        let mut frame = Moving::of(a, &self.first);
        let (mut points, mut axes) = ([frame.p; N], [frame.z; N]);
        for group in (0..N).step_by(4) {
            // The last four overlap those before, so there are always four.
            let first = group.min(N - N.min(4));
            let (at, zero) = (four(a, &q.data.0[0], first), four(a, &self.zero, first));
            let angles = at.fma(four(a, &self.turns, first), zero);
            let (sin, cos) = sin_cos_of(angles);
            let (sin, cos) = (sin.array(), cos.array());
            for i in group..N.min(group + 4) {
                if self.slides(i) {
                    frame.p = frame.z.fma(F4::splat(a, q[i]), frame.p);
                }
                (points[i], axes[i]) = (frame.p, frame.z);
                let (sin, cos) = (sin[i - first], cos[i - first]);
                frame = frame
                    .turned(Turn { sin, cos }, self.turn[i])
                    .shifted(self.shift[i]);
            }
        }
        let end = frame.times(&self.last);
        Reached { points, axes, end }
    }
}

/// Four of `N` numbers, starting at one of them; filled with zeros if `N` is below four.
#[inline(always)]
fn four<A: Four, const N: usize>(a: A, numbers: &[f64; N], first: usize) -> F4<A> {
    if let Some(four) = numbers[first..].first_chunk() {
        return F4::new(a, *four);
    }
    let mut four = [0.0; 4];
    for (to, from) in four.iter_mut().zip(numbers) {
        *to = *from;
    }
    F4::new(a, four)
}

/// The direction perpendicular to two axes, about which the first turns into the second; if they
/// are parallel, the direction from one to the other.
pub(crate) fn normal(from: &Vector3<f64>, to: &Vector3<f64>, way: &Vector3<f64>) -> Vector3<f64> {
    let across_from = |v: &Vector3<f64>| v - from * from.dot(v);
    let cross = from.cross(to);
    if cross.norm() > PARALLEL {
        // The product of nearly parallel axes has few correct digits; made perpendicular to the
        // first again, it is perpendicular to both.
        return across_from(&cross.normalize()).normalize();
    }
    let side = across_from(way);
    if side.norm() > 1e-9 {
        return side.normalize();
    }
    Vector3::from(across((*from).into()))
}

/// Sine of the angle below which two axes count as parallel.
const PARALLEL: f64 = 1e-14;

/// The point of an axis that is nearest to `point`.
pub(crate) fn foot(line: &ScrewAxis, point: &Vector3<f64>) -> Vector3<f64> {
    let (h, p) = (Vector3::from(line.h), Vector3::from(line.p));
    p + h * h.dot(&(point - p))
}

/// A unit vector at right angles to `h`.
#[inline(always)]
pub(crate) fn across(h: [f64; 3]) -> [f64; 3] {
    let v = if h[0].abs() < 0.7 {
        [0.0, h[2], -h[1]]
    } else {
        [-h[2], 0.0, h[0]]
    };
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    [v[0] / length, v[1] / length, v[2] / length]
}
