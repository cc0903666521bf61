//! The product of the rotations of an arm's joints, as closed forms use it.

use crate::links::ScrewAxis;
use nalgebra::Isometry3;
use simd::{F4, Four, Frame, Moving, Plain};

/// Columns of a rotation, and a position.
pub(crate) type Columns = [[f64; 3]; 4];

/// A product of turns: a rigid transform.
#[derive(Clone, Copy)]
pub(crate) struct Product<A: Four>(Moving<A>);

impl<A: Four> Product<A> {
    /// `pose * zero^-1`.
    #[inline(always)]
    pub(crate) fn of(a: A, pose: &Isometry3<f64>, zero: &Zero) -> Self {
        let ([x, y, z], p) = (rotation(pose), pose.translation.vector);
        let pose = Moving::of_columns(a, [x, y, z, [p.x, p.y, p.z]]);
        Self(pose.times_columns(&zero.back))
    }

    #[inline(always)]
    pub(crate) fn build(&self) -> A {
        self.0.p.build()
    }

    /// `self * right`.
    #[inline(always)]
    pub(crate) fn times(&self, right: &Columns) -> Self {
        Self(self.0.times_columns(right))
    }

    #[inline(always)]
    pub(crate) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        three(self.0.point(p))
    }

    #[inline(always)]
    pub(crate) fn turn(&self, v: [f64; 3]) -> [f64; 3] {
        three(self.0.direction(v))
    }

    /// `left * self`.
    #[inline(always)]
    pub(crate) fn seen_from(&self, left: &Frame) -> Columns {
        let left = Moving::of(self.build(), left);
        columns(left.times_columns(&columns(self.0)))
    }

    /// Without a last turn by `angle` (rad) about a line.
    #[inline(always)]
    pub(crate) fn without_last(&self, line: &ScrewAxis, angle: f64) -> Self {
        self.times(&turn(self.build(), line, -angle))
    }

    /// Without a first turn by `angle` (rad) about a line.
    #[inline(always)]
    pub(crate) fn without_first(&self, line: &ScrewAxis, angle: f64) -> Self {
        let a = self.build();
        let back = Moving::of_columns(a, turn(a, line, -angle));
        Self(back.times_columns(&columns(self.0)))
    }
}

/// The columns of a transform in memory.
#[inline(always)]
fn columns<A: Four>(transform: Moving<A>) -> Columns {
    let Moving { x, y, z, p } = transform;
    [three(x), three(y), three(z), three(p)]
}

#[inline(always)]
fn three<A: Four>(v: F4<A>) -> [f64; 3] {
    let [x, y, z, _] = v.array();
    [x, y, z]
}

/// The inverse of the pose at q = 0, ready for [`Product::of`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zero {
    back: Columns,
}

impl Zero {
    pub(crate) fn new(pose: &Isometry3<f64>) -> Self {
        let ([x, y, z], p) = (rotation(pose), pose.translation.vector);
        Self {
            back: inverse(&[x, y, z, [p.x, p.y, p.z]]),
        }
    }

    /// With a constant that every product is multiplied with.
    pub(crate) fn times(&self, right: &Columns) -> Self {
        let left = Moving::of_columns(Plain, self.back);
        Self {
            back: columns(left.times_columns(right)),
        }
    }
}

/// The inverse of a rotation and position.
#[inline(always)]
pub(crate) fn inverse(&[x, y, z, p]: &Columns) -> Columns {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    [
        [x[0], y[0], z[0]],
        [x[1], y[1], z[1]],
        [x[2], y[2], z[2]],
        [-dot(x, p), -dot(y, p), -dot(z, p)],
    ]
}

/// One turn about a line (Rodrigues).
#[inline(always)]
fn turn<A: Four>(a: A, line: &ScrewAxis, angle: f64) -> Columns {
    let ([s], [c]) = simd::sin_cos(a, [angle]);
    let ([x, y, z], p, v) = (line.h, line.p, 1.0 - c);
    let columns = [
        [
            a.fma(x * x, v, c),
            a.fma(x * y, v, z * s),
            a.fma(x * z, v, -y * s),
        ],
        [
            a.fma(x * y, v, -z * s),
            a.fma(y * y, v, c),
            a.fma(y * z, v, x * s),
        ],
        [
            a.fma(x * z, v, y * s),
            a.fma(y * z, v, -x * s),
            a.fma(z * z, v, c),
        ],
    ];
    let [i, j, k] = columns;
    let moved = |n: usize| p[n] - (i[n] * p[0] + j[n] * p[1] + k[n] * p[2]);
    [i, j, k, [moved(0), moved(1), moved(2)]]
}

/// Columns of the rotation matrix of a pose.
#[inline(always)]
fn rotation(pose: &Isometry3<f64>) -> [[f64; 3]; 3] {
    let q = pose.rotation.quaternion();
    let (x, y, z, w) = (q.i, q.j, q.k, q.w);
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    [
        [1.0 - (yy + zz), xy + wz, xz - wy],
        [xy - wz, 1.0 - (xx + zz), yz + wx],
        [xz + wy, yz - wx, 1.0 - (xx + yy)],
    ]
}
