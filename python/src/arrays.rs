//! Between flat arrays of numbers and the types of the libraries.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use realtime::Sample;

use crate::error::argument;

/// An array of the Python layer, which makes all of them contiguous.
pub(crate) type Numbers<'py> = PyReadonlyArrayDyn<'py, f64>;

/// The numbers of an array that has this many in each row; the count of rows.
pub(crate) fn rows<'a>(
    array: &'a Numbers<'_>,
    name: &str,
    width: usize,
) -> PyResult<(&'a [f64], usize)> {
    let numbers = array
        .as_slice()
        .map_err(|_| argument(format!("{name}: expected an array that is contiguous")))?;
    if width == 0 || !numbers.len().is_multiple_of(width) || array.ndim() == 0 {
        let shape = array.shape();
        return Err(argument(format!(
            "{name}: expected {width} numbers in each row, got an array of shape {shape:?}"
        )));
    }
    Ok((numbers, numbers.len() / width))
}

/// How many joints an array has, 1 to 8.
pub(crate) fn joints(count: usize) -> PyResult<usize> {
    if (1..=8).contains(&count) {
        Ok(count)
    } else {
        Err(argument(format!("expected 1 to 8 joints, got {count}")))
    }
}

/// How far a matrix may be from a rotation: rounded decimals pass.
const ROTATION: f64 = 1e-6;

/// A pose from sixteen numbers, a homogeneous matrix row by row; `None` where it is not a rotation
/// and a translation.
pub(crate) fn pose(m: &[f64]) -> Option<Isometry3<f64>> {
    let turn = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let off = (turn * turn.transpose() - Matrix3::identity()).amax();
    let last = m[12].abs().max(m[13].abs()).max(m[14].abs());
    let last = last.max((m[15] - 1.0).abs());
    // Written so that NaN is refused.
    let is_pose = off <= ROTATION && last <= ROTATION && turn.determinant() > 0.0;
    let finite = m[3].is_finite() && m[7].is_finite() && m[11].is_finite();
    (is_pose && finite).then(|| {
        let rotation = Rotation3::from_matrix_unchecked(turn);
        Isometry3::from_parts(
            Translation3::new(m[3], m[7], m[11]),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    })
}

/// The homogeneous matrix of a pose, row by row.
pub(crate) fn matrix(pose: &Isometry3<f64>, out: &mut [f64]) {
    let turn = pose.rotation.to_rotation_matrix();
    let at = pose.translation.vector;
    for row in 0..3 {
        for column in 0..3 {
            out[4 * row + column] = turn[(row, column)];
        }
        out[4 * row + 3] = at[row];
    }
    out[12..16].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
}

/// A pose from x, y, z, w, i, j, k; the quaternion is normalised.
pub(crate) fn pose_of_seven(p: &[f64]) -> Isometry3<f64> {
    let turn = Quaternion::new(p[3], p[4], p[5], p[6]);
    Isometry3::from_parts(
        Translation3::new(p[0], p[1], p[2]),
        UnitQuaternion::from_quaternion(turn),
    )
}

/// x, y, z, w, i, j, k of a pose.
pub(crate) fn seven(pose: &Isometry3<f64>) -> [f64; 7] {
    let (at, turn) = (pose.translation, pose.rotation);
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k]
}

/// The error of an array whose row is not a pose.
pub(crate) fn not_a_pose(row: usize) -> PyErr {
    argument(format!(
        "pose {row}: expected a homogeneous matrix of a rotation and a translation, finite and \
         orthonormal within {ROTATION:e}"
    ))
}

/// Puts sample `k` of `count` into an array (4, count, N): position, velocity, acceleration, jerk.
pub(crate) fn put<const N: usize>(sample: &Sample<N>, k: usize, count: usize, out: &mut [f64]) {
    let orders = [
        &sample.position,
        &sample.velocity,
        &sample.acceleration,
        &sample.jerk,
    ];
    for (order, values) in orders.into_iter().enumerate() {
        let at = (order * count + k) * N;
        out[at..at + N].copy_from_slice(values.as_slice());
    }
}
