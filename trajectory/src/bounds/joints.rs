//! Bounds of the joint motion: hulls of its polynomials.

use std::ops::Range;

use nalgebra::SVector;
use realtime::Piece;
use simd::Build;

use crate::extrema;
use crate::found::Found;
use crate::hull::{Extent, Extents, Hulls};
use crate::limit::Limit;
use crate::near_ends;
use crate::poly::bernstein;
use crate::{JointLimits, Trajectory};

/// Bounds of the joints over a whole motion.
pub(super) struct Joints<const N: usize> {
    /// Every finite limit with its bound.
    pub found: Vec<(Limit, Found)>,
    /// Lowest and highest positions (rad, m).
    pub positions: [SVector<f64, N>; 2],
    /// Ratios over each piece, one column for each of `found`.
    pub rows: Vec<f64>,
}

/// Hulls that exceed the known positions by less than this (rad, m) are not refined.
const POSITION: f64 = 1e-6;

/// A limit of a joint: 0 for velocity, 1 for acceleration, 2 for jerk, and the joint from 0.
#[derive(Clone, Copy)]
struct Column {
    order: usize,
    joint: usize,
}

/// Derivatives 1 to 3 of a piece in Bernstein form.
struct Derivatives<const N: usize> {
    velocity: [SVector<f64, N>; 5],
    acceleration: [SVector<f64, N>; 4],
    jerk: [SVector<f64, N>; 3],
}

impl<const N: usize> Derivatives<N> {
    fn of(piece: &Piece<N>) -> Self {
        let [_, c1, c2, c3, c4, c5] = piece.coefficients;
        let velocity = [c1, c2 * 2.0, c3 * 3.0, c4 * 4.0, c5 * 5.0];
        let acceleration = [c2 * 2.0, c3 * 6.0, c4 * 12.0, c5 * 20.0];
        let jerk = [c3 * 6.0, c4 * 24.0, c5 * 60.0];
        Self {
            velocity: bernstein(&velocity, 0.0, piece.duration),
            acceleration: bernstein(&acceleration, 0.0, piece.duration),
            jerk: bernstein(&jerk, 0.0, piece.duration),
        }
    }

    /// Adds one derivative of one joint, divided by its limit, to a search.
    fn search(&self, column: Column, limit: f64, when: Range<f64>, found: &mut Found) {
        fn one<const N: usize, const M: usize>(c: &[SVector<f64, N>; M], j: usize) -> [f64; M] {
            c.map(|c| c[j])
        }
        let size = |x: &f64| x.abs() / limit;
        let j = column.joint;
        match column.order {
            0 => found.take(&one(&self.velocity, j), when, 0.0, size),
            1 => found.take(&one(&self.acceleration, j), when, 0.0, size),
            _ => found.take(&one(&self.jerk, j), when, 0.0, size),
        }
    }
}

/// Bounds position, velocity, acceleration and jerk of every joint.
pub(super) fn bound<const N: usize>(
    trajectory: &Trajectory<N>,
    limits: &JointLimits<N>,
) -> Joints<N> {
    let values = [limits.velocity, limits.acceleration, limits.jerk];
    let names = [
        Limit::JointVelocity,
        Limit::JointAcceleration,
        Limit::JointJerk,
    ];
    let columns: Vec<Column> = (0..3)
        .flat_map(|order| (0..N).map(move |joint| Column { order, joint }))
        .filter(|column| values[column.order][column.joint].is_finite())
        .collect();
    let mut found = vec![Found::default(); columns.len()];
    let mut rows = Vec::with_capacity(columns.len() * trajectory.pieces().len());
    let (build, narrow) = (Build::detect(), values.map(|limit| limit.map(|x| 1.0 / x)));
    for piece in trajectory.pieces() {
        let hulls = build.run(Hulls {
            piece,
            narrow: &narrow,
        });
        for (Column { order, joint }, found) in columns.iter().zip(&mut found) {
            let hull = &hulls[*order];
            found.reached = found.reached.max(hull.ends[*joint]);
            rows.push(hull.most[*joint]);
        }
    }
    // Only pieces that may contain the largest value are refined.
    let starts = trajectory.times();
    for (i, piece) in trajectory.pieces().iter().enumerate() {
        let mut derivatives = None;
        for (c, column) in columns.iter().enumerate() {
            let (row, found) = (rows[i * columns.len() + c], &mut found[c]);
            if row <= found.bound {
                continue;
            }
            let derivatives = derivatives.get_or_insert_with(|| Derivatives::of(piece));
            let limit = values[column.order][column.joint];
            derivatives.search(*column, limit, starts[i]..starts[i + 1], found);
        }
    }
    // A value that is reached may differ from a bound by the rounding of another formula.
    found
        .iter_mut()
        .for_each(|found| found.bound = found.bound.max(found.reached));
    raise_near_ends(trajectory, limits, (&columns, &mut found, &mut rows));
    let limits = columns
        .iter()
        .map(|column| names[column.order](column.joint));
    Joints {
        found: limits.zip(found).collect(),
        positions: positions(trajectory),
        rows,
    }
}

/// Raises the ratios of speeds where less is allowed near the ends of the range.
fn raise_near_ends<const N: usize>(
    trajectory: &Trajectory<N>,
    limits: &JointLimits<N>,
    (columns, found, rows): (&[Column], &mut [Found], &mut [f64]),
) {
    if limits.ends.is_none() {
        return;
    }
    let starts = trajectory.times();
    for (i, piece) in trajectory.pieces().iter().enumerate() {
        for (c, column) in columns.iter().enumerate().filter(|(_, c)| c.order == 0) {
            let Some(near) = near_ends::over(piece, starts[i], (limits, column.joint)) else {
                continue;
            };
            let row = &mut rows[i * columns.len() + c];
            *row = row.max(near.bound);
            found[c].reached = found[c].reached.max(near.reached);
            found[c].raise(near.bound, near.time);
        }
    }
}

/// Lowest and highest position of each joint.
fn positions<const N: usize>(trajectory: &Trajectory<N>) -> [SVector<f64, N>; 2] {
    let mut lowest = SVector::<f64, N>::repeat(f64::INFINITY);
    let mut highest = SVector::<f64, N>::repeat(f64::NEG_INFINITY);
    let build = Build::detect();
    let pieces = trajectory.pieces().iter();
    let extents: Vec<Extent<N>> = pieces.map(|piece| build.run(Extents(piece))).collect();
    for ends in extents.iter().flat_map(|extent| extent.ends) {
        let ends = SVector::from(ends);
        (lowest, highest) = (lowest.inf(&ends), highest.sup(&ends));
    }
    for (extent, piece) in extents.iter().zip(trajectory.pieces()) {
        for j in 0..N {
            let [low, high] = [extent.hull[0][j], extent.hull[1][j]];
            if low < lowest[j] - POSITION || high > highest[j] + POSITION {
                let (low, high) = extrema::range(piece, j);
                lowest[j] = low.min(lowest[j]);
                highest[j] = high.max(highest[j]);
            } else {
                lowest[j] = low.min(lowest[j]);
                highest[j] = high.max(highest[j]);
            }
        }
    }
    [lowest, highest]
}
