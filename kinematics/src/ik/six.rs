//! Closed forms of six turning joints.
//!
//! The arm is a product of rotations about its axes at q = 0: `pose * zero_pose^-1 = e1 e2 e3 e4 e5
//! e6`, expressed in [`Frames`] on those axes. Two families are solved, and two more with the chain
//! read backwards:
//! - axes 4, 5, 6 meet in a point (spherical wrist), and either axes 2 and 3 are
//!   parallel or axes 1 and 2 meet;
//! - axes 2, 3, 4 are parallel and axes 5 and 6 meet.
//!
//! # Source
//! A. J. Elias and J. T. Wen, "IK-Geo: unified robot inverse kinematics using
//! subproblem decomposition", Mech. Mach. Theory 209, 2025, sections 4.1 and 4.3.

use super::frames::Frames;
use super::product::{Columns, inverse};
use crate::links::{ScrewAxis, foot};
use nalgebra::Vector3;
use simd::{F4, Four, Frame, Mask};

/// How the first three joints position the wrist.
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
    /// Axes 2, 3, 4 are parallel, axes 5 and 6 meet in this point.
    Parallels([f64; 3]),
}

/// A six-joint chain with a closed form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Six {
    pub(crate) shape: Shape,
    /// Whether the axes are those of the chain read from its tip.
    pub(crate) reversed: bool,
    /// Squared relative error that counts as rounding; large for approximate shapes.
    pub(super) slack: f64,
    pub(super) frames: Frames,
    /// Constant left factor of the product of rotations, and the right one.
    pub(super) left: Frame,
    right: Columns,
    /// Where joint positions are found in angles of the frames: `sign * angle + offset`.
    pub(super) signs: [f64; 6],
    pub(super) offsets: [f64; 6],
    /// The two links of the elbow seen along its axis, m, and the angle (rad) by which the
    /// second is turned in its frame, as sine and cosine.
    pub(super) links: [f64; 2],
    pub(super) bend: [f64; 2],
    /// Whether axis 5 is perpendicular to its neighbours.
    pub(super) square: bool,
    /// Inverses of sines: between axes 1 and 2, and of those beside axis 5 multiplied.
    pub(super) inverse: [f64; 2],
}

/// Angles (rad) of `M` joints in two groups of four branches, and which of them exist.
pub(crate) struct Joints<A: Four, const M: usize> {
    pub(crate) angles: [[F4<A>; M]; 2],
    pub(crate) real: [Mask<A>; 2],
}

#[inline(always)]
pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Six {
    /// The closed form of axes that have this shape exactly.
    pub(crate) fn new(mut lines: [ScrewAxis; 6], shape: Shape, reversed: bool, slack: f64) -> Self {
        let way = if reversed { -1.0 } else { 1.0 };
        let mut signs = [way; 6];
        let parallel = match shape {
            Shape::Wrist(_, Placing::Parallel) => 2..3,
            Shape::Wrist(_, Placing::Meeting(_)) => 2..2,
            Shape::Parallels(_) => 2..4,
        };
        // Parallel axes must point in the same direction.
        for i in parallel {
            if dot(lines[1].h, lines[i].h) < 0.0 {
                lines[i].h = lines[i].h.map(|x| -x);
                signs[i] = -way;
            }
        }
        let frames = Frames::of(&lines, &origins(&lines, shape));
        let mut offsets = [0.0; 6];
        for i in 0..6 {
            offsets[i] = -signs[i] * frames.zero[i];
        }
        let [left, right] = if reversed {
            [inverse(&frames.last), inverse(&frames.back)]
        } else {
            [frames.back, frames.last]
        };
        let [upper, fore] = [frames.steps[1].shift, frames.steps[2].shift];
        let links = [upper[0], fore[0].hypot(fore[1])];
        let bend = fore[1].atan2(fore[0]);
        offsets[2] -= signs[2] * bend;
        let [first, .., before, behind] = frames.steps;
        Self {
            square: before.cos.abs() < 1e-12 && behind.cos.abs() < 1e-12,
            inverse: [1.0 / first.sin, 1.0 / (before.sin * behind.sin)],
            shape,
            reversed,
            slack,
            frames,
            left: Frame::from_columns(left),
            right,
            signs,
            offsets,
            links,
            bend: [bend.sin(), bend.cos()],
        }
    }

    /// Constant right factor of the product of rotations.
    pub(crate) fn right(&self) -> &Columns {
        &self.right
    }

    /// The joint of each frame.
    #[inline(always)]
    pub(crate) fn slots(&self) -> &'static [usize; 6] {
        if self.reversed {
            &[5, 4, 3, 2, 1, 0]
        } else {
            &[0, 1, 2, 3, 4, 5]
        }
    }
}

/// Origins of the frames: where axes meet, and else the nearest of the next axis.
fn origins(lines: &[ScrewAxis; 6], shape: Shape) -> [Vector3<f64>; 6] {
    let (meet, from, known) = match shape {
        Shape::Wrist(wrist, Placing::Parallel) => (wrist, lines[0].p, 3),
        Shape::Wrist(wrist, Placing::Meeting(point)) => (wrist, point, 3),
        Shape::Parallels(point) => (point, lines[0].p, 4),
    };
    let mut origins = [Vector3::from(meet); 6];
    origins[0] = foot(&lines[0], &from.into());
    for i in 1..known {
        origins[i] = foot(&lines[i], &origins[i - 1]);
    }
    origins
}
