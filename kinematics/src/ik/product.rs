//! The product of the rotations of an arm's joints, as closed forms use it.

use crate::arith::{self, Arith};
use crate::links::ScrewAxis;
use crate::wide::F4;
use nalgebra::Isometry3;

/// Columns of a rotation, and a position.
pub(crate) type Columns = [[f64; 3]; 4];

/// The same with a zero behind each column, to be read as wide numbers.
pub(crate) type Padded = [[f64; 4]; 4];

/// Columns with a zero behind each.
pub(crate) fn padded(columns: &Columns) -> Padded {
    columns.map(|[x, y, z]| [x, y, z, 0.0])
}

/// A product of turns: the columns of a rotation and a translation, one wide number each.
#[derive(Clone, Copy)]
pub(crate) struct Product<A: Arith>([F4<A>; 4]);

impl<A: Arith> Product<A> {
    #[inline(always)]
    fn new(a: A, columns: Columns) -> Self {
        let [x, y, z, p] = columns;
        Self([
            F4::new(a, [x[0], x[1], x[2], 0.0]),
            F4::new(a, [y[0], y[1], y[2], 0.0]),
            F4::new(a, [z[0], z[1], z[2], 0.0]),
            F4::new(a, [p[0], p[1], p[2], 0.0]),
        ])
    }

    /// `pose * zero^-1`.
    #[inline(always)]
    pub(crate) fn of(a: A, pose: &Isometry3<f64>, zero: &Zero) -> Self {
        let ([x, y, z], p) = (rotation(pose), pose.translation.vector);
        Self::new(a, [x, y, z, [p.x, p.y, p.z]]).times(&zero.back)
    }

    #[inline(always)]
    pub(crate) fn build(&self) -> A {
        self.0[0].build()
    }

    #[inline(always)]
    fn turned(&self, [x, y, z]: [f64; 3]) -> F4<A> {
        let a = self.build();
        let rest = self.0[1].fma(F4::splat(a, y), self.0[0] * x);
        self.0[2].fma(F4::splat(a, z), rest)
    }

    /// `self * right`.
    #[inline(always)]
    pub(crate) fn times(&self, [x, y, z, p]: &Columns) -> Self {
        Self([
            self.turned(*x),
            self.turned(*y),
            self.turned(*z),
            self.turned(*p) + self.0[3],
        ])
    }

    #[inline(always)]
    pub(crate) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        three(self.turned(p) + self.0[3])
    }

    #[inline(always)]
    pub(crate) fn turn(&self, v: [f64; 3]) -> [f64; 3] {
        three(self.turned(v))
    }

    #[inline(always)]
    fn columns(&self) -> Columns {
        [
            three(self.0[0]),
            three(self.0[1]),
            three(self.0[2]),
            three(self.0[3]),
        ]
    }

    /// `left * self`.
    #[inline(always)]
    pub(crate) fn seen_from(&self, left: &Padded) -> Columns {
        let left = Self(left.map(|column| F4::new(self.build(), column)));
        left.times(&self.columns()).columns()
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
        Self::new(a, turn(a, line, -angle)).times(&self.columns())
    }
}

#[inline(always)]
fn three<A: Arith>(v: F4<A>) -> [f64; 3] {
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
        let left = Product::new(arith::Plain, self.back);
        Self {
            back: left.times(right).columns(),
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
fn turn<A: Arith>(a: A, line: &ScrewAxis, angle: f64) -> Columns {
    let ([s], [c]) = arith::sin_cos(a, [angle]);
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
