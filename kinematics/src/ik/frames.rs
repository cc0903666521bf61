//! Frames on six turning axes. Every axis is a z axis, and every constant rotation between two
//! frames is about x, so closed forms need few operations.
//!
//! With `q'` the angle from x axis to x axis, `base_from_first^-1 * product * last` equals `Rz(q1')
//! C1 Rz(q2') C2 ... C5 Rz(q6')`, each `C` a shift and then a turn about x.
//!
//! # Source
//! J. Denavit and R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
//! matrices", J. Appl. Mech. 22, 1955; here the origins may be anywhere on the axes, so that no
//! number becomes large if axes are nearly parallel.

use super::product::Columns;
use crate::links::{ScrewAxis, normal};
use nalgebra::Vector3;

/// From one axis to the next: a shift (m), then a turn about x by sine and cosine.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Step {
    pub(crate) sin: f64,
    pub(crate) cos: f64,
    pub(crate) shift: [f64; 3],
}

/// Frames on six axes at q = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames {
    /// Inverse of the first frame.
    pub(crate) back: Columns,
    /// The last frame.
    pub(crate) last: Columns,
    /// From each axis to the next.
    pub(crate) steps: [Step; 5],
    /// Angles from x axis to x axis at q = 0, rad.
    pub(crate) zero: [f64; 6],
}

impl Frames {
    /// Frames with these origins, each on its axis.
    pub(crate) fn of(lines: &[ScrewAxis; 6], origins: &[Vector3<f64>; 6]) -> Self {
        let z = lines.map(|line| Vector3::from(line.h));
        let mut x = [Vector3::zeros(); 6];
        let (mut steps, mut zero) = ([Step::default(); 5], [0.0; 6]);
        for i in 1..6 {
            let shift = origins[i] - origins[i - 1];
            x[i] = normal(&z[i - 1], &z[i], &shift);
            let y = z[i - 1].cross(&x[i]);
            steps[i - 1] = Step {
                sin: z[i - 1].cross(&z[i]).norm(),
                cos: z[i - 1].dot(&z[i]),
                shift: [shift.dot(&x[i]), shift.dot(&y), shift.dot(&z[i - 1])],
            };
            if i > 1 {
                zero[i - 1] = (-y.dot(&x[i - 1])).atan2(x[i].dot(&x[i - 1]));
            }
        }
        x[0] = x[1];
        let frame = |i: usize| [x[i], z[i].cross(&x[i]), z[i], origins[i]].map(Into::into);
        Self {
            back: super::product::inverse(&frame(0)),
            last: frame(5),
            steps,
            zero,
        }
    }
}
