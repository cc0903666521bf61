//! Rigid transforms: a coordinate frame as the columns of its rotation and its origin.

use crate::f4::F4;
use crate::four::{Four, Plain};
use crate::v4::V4;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::ops::Mul;

/// A rigid transform: the columns of a rotation, and a position.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The x axis.
    pub x: V4,
    /// The y axis.
    pub y: V4,
    /// The z axis.
    pub z: V4,
    /// The origin (m).
    pub p: V4,
}

impl Frame {
    /// The frame with these axes and this origin (m).
    #[inline]
    pub fn from_columns([x, y, z, p]: [[f64; 3]; 4]) -> Self {
        let column = |[x, y, z]: [f64; 3]| V4::new(x, y, z);
        Self {
            x: column(x),
            y: column(y),
            z: column(z),
            p: column(p),
        }
    }

    /// The frame of a pose.
    pub fn from_isometry(pose: &Isometry3<f64>) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        let column = |j: usize| V4::new(r[(0, j)], r[(1, j)], r[(2, j)]);
        let t = &pose.translation.vector;
        Self {
            x: column(0),
            y: column(1),
            z: column(2),
            p: V4::new(t.x, t.y, t.z),
        }
    }

    /// The inverse: the outer frame, expressed in this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let [x, y, z, p] = [self.x.0, self.y.0, self.z.0, self.p.0];
        let along = |v: [f64; 4]| -(v[0] * p[0] + v[1] * p[1] + v[2] * p[2]);
        Self {
            x: V4::new(x[0], y[0], z[0]),
            y: V4::new(x[1], y[1], z[1]),
            z: V4::new(x[2], y[2], z[2]),
            p: V4::new(along(x), along(y), along(z)),
        }
    }

    /// The pose of the frame.
    #[inline(always)]
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x, y, z, _] = self.p.0;
        Isometry3::from_parts(Translation3::new(x, y, z), self.rotation())
    }

    /// The rotation as a quaternion.
    ///
    /// # Source
    /// S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1(3), 1978.
    #[inline(always)]
    fn rotation(&self) -> UnitQuaternion<f64> {
        let [[xx, xy, xz, _], [yx, yy, yz, _], [zx, zy, zz, _]] = [self.x.0, self.y.0, self.z.0];
        if xx + yy + zz <= 0.0 {
            return self.far_rotation();
        }
        let real = 1.0 + xx + yy + zz;
        let scale = 0.5 / real.sqrt();
        let [i, j, k] = [yz - zy, zx - xz, xy - yx].map(|x| x * scale);
        UnitQuaternion::new_unchecked(Quaternion::new(real * scale, i, j, k))
    }

    /// The same for a rotation by more than 120 degrees. Half a turn about one of the axes makes
    /// the real part the largest of the four numbers, so that nothing cancels. It is done by
    /// changing signs and places, without branches.
    #[inline(always)]
    fn far_rotation(&self) -> UnitQuaternion<f64> {
        let [[xx, xy, xz, _], [yx, yy, yz, _], [zx, zy, zz, _]] = [self.x.0, self.y.0, self.z.0];
        let about_z_or_y = if zz >= yy { 1 } else { 2 };
        let about_x = (xx > yy) & (xx > zz);
        let half_turn = if about_x { 3 } else { about_z_or_y };
        let ([sx, sy, sz], signs) = HALF_TURNS[half_turn];
        let real = 1.0 + sx * xx + sy * yy + sz * zz;
        let scale = 0.5 / real.sqrt();
        let numbers = [
            (sy * yz - sz * zy) * scale,
            (sz * zx - sx * xz) * scale,
            (sx * xy - sy * yx) * scale,
            real * scale,
        ];
        let place = |i: usize| signs[i] * numbers[i ^ half_turn];
        let [i, j, k, w] = [place(0), place(1), place(2), place(3)];
        UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k))
    }
}

/// No rotation, and half a turn about z, y and x: the signs that it gives to a frame's axes, and
/// the signs that its inverse gives to the numbers of a quaternion.
const HALF_TURNS: [([f64; 3], [f64; 4]); 4] = [
    ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]),
    ([-1.0, -1.0, 1.0], [1.0, -1.0, 1.0, -1.0]),
    ([-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0, -1.0]),
    ([1.0, -1.0, -1.0], [1.0, 1.0, -1.0, -1.0]),
];

impl Mul for Frame {
    type Output = Self;

    #[inline]
    fn mul(self, right: Self) -> Self {
        Moving::of(Plain, &self).times(&right).frame()
    }
}

/// Sine and cosine of an angle.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// Its sine.
    pub sin: f64,
    /// Its cosine.
    pub cos: f64,
}

/// A rigid transform in registers, for example a frame that is moved along a chain.
#[derive(Clone, Copy)]
pub struct Moving<S: Four> {
    /// The x axis.
    pub x: F4<S>,
    /// The y axis.
    pub y: F4<S>,
    /// The z axis.
    pub z: F4<S>,
    /// The origin (m).
    pub p: F4<S>,
}

impl<S: Four> Moving<S> {
    /// A frame, in registers.
    #[inline(always)]
    pub fn of(a: S, frame: &Frame) -> Self {
        Self {
            x: F4::new(a, frame.x.0),
            y: F4::new(a, frame.y.0),
            z: F4::new(a, frame.z.0),
            p: F4::new(a, frame.p.0),
        }
    }

    /// A transform given by the columns of its rotation and its origin (m).
    #[inline(always)]
    pub fn of_columns(a: S, columns: [[f64; 3]; 4]) -> Self {
        let [x, y, z, p] = columns.map(|[x, y, z]| F4::new(a, [x, y, z, 0.0]));
        Self { x, y, z, p }
    }

    /// `self * local`: the pose of `local` in the frame that `self` is in.
    #[inline(always)]
    #[must_use]
    pub fn times(self, local: &Frame) -> Self {
        let column = |V4([x, y, z, _]): V4| [x, y, z];
        self.times_columns(&[
            column(local.x),
            column(local.y),
            column(local.z),
            column(local.p),
        ])
    }

    /// The same with a transform given by its columns.
    #[inline(always)]
    #[must_use]
    pub fn times_columns(self, [x, y, z, p]: &[[f64; 3]; 4]) -> Self {
        Self {
            x: self.direction(*x),
            y: self.direction(*y),
            z: self.direction(*z),
            p: self.point(*p),
        }
    }

    /// A point (m) given in this frame.
    #[inline(always)]
    pub fn point(self, p: [f64; 3]) -> F4<S> {
        self.direction(p) + self.p
    }

    /// A direction given in this frame.
    #[inline(always)]
    pub fn direction(self, [x, y, z]: [f64; 3]) -> F4<S> {
        let a = self.p.build();
        let first = self.y.fma(F4::splat(a, y), self.x * x);
        self.z.fma(F4::splat(a, z), first)
    }

    /// This frame turned about its z axis, and then about its new x axis.
    #[inline(always)]
    #[must_use]
    pub fn turned(self, about_z: Turn, about_x: Turn) -> Self {
        let number = |x: f64| F4::splat(self.p.build(), x);
        let Self { x, y, z, p } = self;
        // Values that are computed last are added last.
        let (sin, cos) = (number(about_z.sin), number(about_z.cos));
        let back = y.taken_from(cos, x * sin);
        let x = y.fma(sin, x * cos);
        let (sin, cos) = (number(about_x.sin), number(about_x.cos));
        Self {
            x,
            y: back.taken_from(cos, z * sin),
            z: back.fma(sin, z * cos),
            p,
        }
    }

    /// This frame moved along its own x and y axis, m.
    #[inline(always)]
    #[must_use]
    pub fn shifted(self, [x, y]: [f64; 2]) -> Self {
        let a = self.p.build();
        let along = self.x.fma(F4::splat(a, x), self.p);
        Self {
            p: self.y.fma(F4::splat(a, y), along),
            ..self
        }
    }

    /// The transform in memory.
    #[inline(always)]
    pub fn frame(self) -> Frame {
        Frame {
            x: V4(self.x.array()),
            y: V4(self.y.array()),
            z: V4(self.z.array()),
            p: V4(self.p.array()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// The quaternion of a rotation, computed through its frame.
    fn found(turn: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let pose = Isometry3::from_parts(Translation3::identity(), *turn);
        Frame::from_isometry(&pose).isometry().rotation
    }

    /// Rotations about all axes give the same quaternions as nalgebra.
    #[test]
    fn quaternion_agrees_with_nalgebra() {
        for i in 0..20_000 {
            let (a, b) = (f64::from(i) * 0.618, f64::from(i % 141) * 0.0446);
            let axis = Vector3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
            let turn = UnitQuaternion::from_scaled_axis(axis * f64::from(i % 7919) * 4e-4);
            let theirs = UnitQuaternion::from_rotation_matrix(&turn.to_rotation_matrix());
            let error = (found(&turn).coords - theirs.coords).amax();
            assert!(error < 2e-15, "{turn}: {error}");
        }
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            let turn = UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI);
            assert!((found(&turn).coords - turn.coords).amax() < 1e-15, "{turn}");
        }
    }
}
