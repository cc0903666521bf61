//! The turns of a span: its control orientations as factors.

use nalgebra::UnitQuaternion;

use super::basis;
use crate::line::body_turn;
use crate::smooth::span::Turn;

/// The four factors of a span of five control orientations: the cumulative form of the basis.
///
/// # Source
/// M.-J. Kim, M.-S. Kim, S. Y. Shin, "A general construction scheme for unit
/// quaternion curves with simple high order derivatives", SIGGRAPH 1995.
pub(crate) fn turns(control: &[UnitQuaternion<f64>], h: f64) -> Vec<Turn> {
    let mut result = Vec::with_capacity(4);
    for j in 1..5 {
        let axis = body_turn(&control[j - 1], &control[j]);
        let mut sums = [0.0; 5];
        sums[j..].fill(1.0);
        result.push(Turn {
            axis,
            angle: basis::power(&sums, h),
        });
    }
    result
}
