//! Goals of inverse kinematics, and the distance of the tool from them.

use crate::measure::LENGTH;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use simd::{F4, Four, Frame, V4};

/// The goal of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// A full pose.
    Pose(Isometry3<f64>),
    /// A position, with any orientation.
    Position(Point3<f64>),
    /// A position with the tool's z axis along a direction; the angle about it is free.
    Axis(Point3<f64>, Unit<Vector3<f64>>),
}

/// A goal in the form that the solver's inner loop uses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    frame: Frame,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Pose,
    Position,
    Axis,
}

/// Distance from a goal, positions divided by [`LENGTH`], and its two plain sizes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseError {
    pub(crate) rows: [f64; 6],
    /// m.
    pub(crate) position: f64,
    /// rad.
    pub(crate) rotation: f64,
}

impl Goal {
    /// Where the tool is to be.
    pub(super) fn point(&self) -> Point3<f64> {
        match self {
            Self::Pose(pose) => pose.translation.vector.into(),
            Self::Position(point) | Self::Axis(point, _) => *point,
        }
    }

    /// Whether every number of its position, and of a pose's orientation, is finite.
    pub(super) fn is_finite(&self) -> bool {
        let turned = match self {
            Self::Pose(pose) => pose.rotation.coords.iter().all(|x| x.is_finite()),
            Self::Position(_) | Self::Axis(..) => true,
        };
        turned && self.point().coords.iter().all(|x| x.is_finite())
    }

    pub(crate) fn target(&self) -> Target {
        let (pose, kind) = match self {
            Self::Pose(pose) => (*pose, Kind::Pose),
            Self::Position(point) => (
                Isometry3::translation(point.x, point.y, point.z),
                Kind::Position,
            ),
            Self::Axis(point, axis) => {
                let turn = z_to(axis);
                (Isometry3::from_parts(point.coords.into(), turn), Kind::Axis)
            }
        };
        Target {
            frame: Frame::from_isometry(&pose),
            kind,
        }
    }
}

impl Target {
    /// The difference between goal and tool, in base axes.
    #[inline(always)]
    pub(crate) fn pose_error<A: Four>(&self, a: A, tool: &Frame) -> PoseError {
        let d = self.frame.p.minus(tool.p).0;
        let w = match self.kind {
            Kind::Pose => rotation_between(a, tool, &self.frame),
            Kind::Position => [0.0; 3],
            Kind::Axis => turn_between(a, tool.z, self.frame.z),
        };
        let square = |v: [f64; 3]| a.fma(v[0], v[0], a.fma(v[1], v[1], v[2] * v[2]));
        let scale = 1.0 / LENGTH;
        PoseError {
            rows: [d[0] * scale, d[1] * scale, d[2] * scale, w[0], w[1], w[2]],
            position: square([d[0], d[1], d[2]]).sqrt(),
            rotation: square(w).sqrt(),
        }
    }

    /// Scales the position rows of a Jacobian and removes the free directions of the goal from the
    /// angular rows.
    #[inline(always)]
    pub(crate) fn shape<A: Four>(&self, tool: &Frame, rows: &mut [[F4<A>; 2]; 6]) {
        for row in rows.iter_mut().take(3) {
            *row = [row[0] * (1.0 / LENGTH), row[1] * (1.0 / LENGTH)];
        }
        let zero = F4::splat(rows[0][0].build(), 0.0);
        match self.kind {
            Kind::Pose => {}
            Kind::Position => rows[3..].fill([zero; 2]),
            Kind::Axis => {
                let z = tool.z.0;
                for half in 0..2 {
                    let w = [rows[3][half], rows[4][half], rows[5][half]];
                    let along = w[0] * z[0] + w[1] * z[1] + w[2] * z[2];
                    for i in 0..3 {
                        rows[3 + i][half] = w[i] - along * z[i];
                    }
                }
            }
        }
    }
}

/// A rotation that takes z to `axis`.
fn z_to(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), axis).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

/// Rotation vector, in base axes, that turns frame `from` into frame `to`.
///
/// # Source
/// The logarithm of a rotation; J. J. Craig, Introduction to Robotics, 2005, eq. 2.80-2.82.
#[inline(always)]
fn rotation_between<A: Four>(a: A, from: &Frame, to: &Frame) -> [f64; 3] {
    let pairs = [(from.x, to.x), (from.y, to.y), (from.z, to.z)];
    let (mut s, mut trace) = ([0.0; 3], 0.0);
    for (f, t) in pairs {
        let cross = f.cross(a, t).0;
        for i in 0..3 {
            s[i] += 0.5 * cross[i];
        }
        trace = a.fma(
            f.0[0],
            t.0[0],
            a.fma(f.0[1], t.0[1], a.fma(f.0[2], t.0[2], trace)),
        );
    }
    let (sin2, cos) = (
        a.fma(s[0], s[0], a.fma(s[1], s[1], s[2] * s[2])),
        0.5 * (trace - 1.0),
    );
    if cos > 0.0 && sin2 < 1e-6 {
        // Angle over sine: series of the arc sine.
        let ratio = a.fma(sin2, a.fma(sin2, 3.0 / 40.0, 1.0 / 6.0), 1.0);
        return s.map(|value| value * ratio);
    }
    let sin = sin2.sqrt();
    if cos < 0.0 && sin < 1e-4 {
        return half_turn(from, to, s);
    }
    let ratio = sin.atan2(cos) / sin;
    s.map(|value| value * ratio)
}

/// Rotation vector of a rotation so near half a turn that its sine is too small to be used.
#[cold]
fn half_turn(from: &Frame, to: &Frame, s: [f64; 3]) -> [f64; 3] {
    // R + 1 = 2 axis axis^T at half a turn: its longest column gives the axis.
    let mut longest = Vector3::zeros();
    for j in 0..3 {
        let column = Vector3::from_fn(|i, _| {
            let r = from.x.0[j] * to.x.0[i] + from.y.0[j] * to.y.0[i] + from.z.0[j] * to.z.0[i];
            if i == j { r + 1.0 } else { r }
        });
        if column.norm_squared() > longest.norm_squared() {
            longest = column;
        }
    }
    let s = Vector3::from(s);
    let axis = longest.normalize();
    let axis = if axis.dot(&s) < 0.0 { -axis } else { axis };
    (axis * (std::f64::consts::PI - s.norm())).into()
}

/// Rotation vector that turns direction `from` into `to` the shortest way.
#[inline(always)]
fn turn_between<A: Four>(a: A, from: V4, to: V4) -> [f64; 3] {
    let s = from.cross(a, to).0;
    let cos = a.fma(
        from.0[0],
        to.0[0],
        a.fma(from.0[1], to.0[1], from.0[2] * to.0[2]),
    );
    let sin = a.fma(s[0], s[0], a.fma(s[1], s[1], s[2] * s[2])).sqrt();
    if sin < 1e-12 {
        if cos > 0.0 {
            return [s[0], s[1], s[2]];
        }
        // Opposite directions: any perpendicular axis is possible.
        let z = from.0;
        let across = if z[0].abs() < 0.7 {
            [0.0, z[2], -z[1]]
        } else {
            [-z[2], 0.0, z[0]]
        };
        let length = (across[0].powi(2) + across[1].powi(2) + across[2].powi(2)).sqrt();
        return across.map(|value| value / length * std::f64::consts::PI);
    }
    let ratio = sin.atan2(cos) / sin;
    [s[0] * ratio, s[1] * ratio, s[2] * ratio]
}
