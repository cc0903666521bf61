//! The best polynomial of the null-space motion over a whole path.
//!
//! A grid over path parameter and null-space motion is filled by continuation. The cheapest path
//! through it weighs distance from limits, distance from singular poses and changes of the
//! null-space motion. The candidates are polynomials fitted to that path.

use super::null_space::{NullSpace, NullSpacePolynomial};
use super::trace::{Guess, Task};
use crate::measure::LENGTH;
use nalgebra::{Isometry3, SMatrix, SVector};

/// Steps along the path.
const LAYERS: usize = 32;
/// Steps of the null-space motion to either side.
const SIDE: usize = 14;
const WIDTH: usize = 2 * SIDE + 1;
/// Size of such a step, rad.
const STEP: f64 = 0.1;
/// Most such steps from one layer to the next.
const SWING: usize = 3;
/// Distance of the tool at which a cell counts as reached, m (rad times 0.3 m).
const CLOSE: f64 = 1e-7;
/// Steps of the power method.
const POWERS: usize = 6;
/// Largest difference of a joint from one cell of the grid to the next, rad.
const CELL_CHANGE: f64 = 0.8;

/// A cell of the grid: the joints and the cost of this cell.
#[derive(Clone, Copy)]
struct Cell<const N: usize> {
    q: SVector<f64, N>,
    cost: f64,
}

type Layer<const N: usize> = Vec<Option<Cell<N>>>;

/// The polynomials to try, best fit first; none if the search finds no path.
pub(super) fn search<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    still: &NullSpace<N>,
) -> Vec<NullSpacePolynomial> {
    let Some(way) = Grid { task, still }.cheapest(start) else {
        return Vec::new();
    };
    let points: Vec<(f64, f64)> = way
        .iter()
        .enumerate()
        .map(|(i, column)| {
            let offset = (*column as f64 - SIDE as f64) * STEP;
            let [progress, ..] = still.progress(i as f64 / LAYERS as f64);
            (progress, offset)
        })
        .collect();
    let base = still.at(still.from)[0];
    [5, 4, 3, 2, 1]
        .into_iter()
        .filter_map(|degree| fit(&points, base, degree))
        .collect()
}

/// The grid over path parameter and null-space motion, measured as `still` says.
struct Grid<'a, const N: usize> {
    task: &'a Task<'a, N>,
    still: &'a NullSpace<N>,
}

impl<const N: usize> Grid<'_, N> {
    /// Columns of the cheapest path through the grid, which is filled by continuation from the start; no farther
    /// than a path leads.
    fn cheapest(&self, start: &SVector<f64, N>) -> Option<Vec<usize>> {
        let mut layer = self.first(start);
        // A path can only begin at the start itself.
        let mut total = vec![f64::INFINITY; WIDTH];
        total[SIDE] = 0.0;
        let mut back: Vec<Vec<usize>> = Vec::with_capacity(LAYERS);
        for i in 1..=LAYERS {
            let next = self.next(&layer, i);
            let (sums, from) = reached(&layer, &total, &next);
            if sums.iter().all(|sum| sum.is_infinite()) {
                return None;
            }
            back.push(from);
            (layer, total) = (next, sums);
        }
        let last = (0..WIDTH).min_by(|a, b| total[*a].total_cmp(&total[*b]))?;
        let mut way = vec![last];
        for from in back.iter().rev() {
            way.push(from[*way.last()?]);
        }
        way.reverse();
        Some(way)
    }

    /// The cells at the start.
    fn first(&self, start: &SVector<f64, N>) -> Layer<N> {
        let pose = (self.task.tool)(self.still.from).pose;
        let mut layer: Layer<N> = vec![None; WIDTH];
        layer[SIDE] = Some(Cell {
            q: *start,
            cost: 0.0,
        });
        for step in 1..=SIDE {
            for (near, column) in [
                (SIDE + step - 1, SIDE + step),
                (SIDE + 1 - step, SIDE - step),
            ] {
                layer[column] = layer[near].and_then(|near| self.cell(&near.q, &pose, column));
            }
        }
        layer
    }

    /// The cells of layer `i`, from those of the one before it.
    fn next(&self, before: &Layer<N>, i: usize) -> Layer<N> {
        let u = self.still.from + self.still.span * i as f64 / LAYERS as f64;
        let pose = (self.task.tool)(u).pose;
        let cell = |column: usize| {
            let near = [Some(column), column.checked_sub(1), Some(column + 1)];
            let mut seeds = near.into_iter().flatten().filter_map(|c| *before.get(c)?);
            seeds.find_map(|seed| self.cell(&seed.q, &pose, column))
        };
        (0..WIDTH).map(cell).collect()
    }

    /// The cell of a column at a pose, near joints.
    fn cell(
        &self,
        near: &SVector<f64, N>,
        pose: &Isometry3<f64>,
        column: usize,
    ) -> Option<Cell<N>> {
        let mut at = self.still.at(self.still.from);
        at[0] += (column as f64 - SIDE as f64) * STEP;
        let guess = Guess {
            q: near,
            within: CELL_CHANGE,
            exact: CLOSE,
        };
        let q = self.task.newton(&guess, pose, self.still, &at)?;
        let cost = cost(self.task, &q);
        Some(Cell { q, cost })
    }
}

/// The least cost to each cell of a layer from the one before it, whose costs are `total`, and the column from which
/// it is reached; infinite where it is not.
fn reached<const N: usize>(
    before: &Layer<N>,
    total: &[f64],
    layer: &Layer<N>,
) -> (Vec<f64>, Vec<usize>) {
    let (mut next, mut from) = (vec![f64::INFINITY; WIDTH], vec![0; WIDTH]);
    for (column, cell) in layer.iter().enumerate() {
        let Some(cell) = cell else { continue };
        for source in column.saturating_sub(SWING)..(column + SWING + 1).min(WIDTH) {
            let Some(before) = before[source] else {
                continue;
            };
            // The same null-space value can belong to another branch; the joints show it.
            if (before.q - cell.q).amax() > 2.0 * CELL_CHANGE {
                continue;
            }
            let swing = column.abs_diff(source) as f64;
            let sum = total[source] + cell.cost + 0.3 * swing * swing;
            if sum < next[column] {
                (next[column], from[column]) = (sum, source);
            }
        }
    }
    (next, from)
}

/// The cost of `q`: grows towards limits and singular poses, infinite beyond them.
fn cost<const N: usize>(task: &Task<'_, N>, q: &SVector<f64, N>) -> f64 {
    let chain = task.solver.chain();
    let mut sum = 0.0;
    for i in 0..N {
        let room = (chain.upper()[i] - q[i]).min(q[i] - chain.lower()[i]);
        if room <= 0.0 {
            return f64::INFINITY;
        }
        sum += (0.15 / room).powi(2).min(1e6);
    }
    let (_, jacobian) = chain.jacobian(q);
    sum + (0.08 / about_smallest(jacobian).max(1e-4)).powi(2)
}

/// About the smallest singular value of a Jacobian, lengths in units of [`LENGTH`]; never less than it.
///
/// # Source
/// G. Golub, C. Van Loan, "Matrix Computations", 4th edition 2013, 8.2.2 (power method of the inverse).
fn about_smallest<const N: usize>(mut jacobian: SMatrix<f64, 6, N>) -> f64 {
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
    let Some(factor) = (jacobian * jacobian.transpose()).cholesky() else {
        return 0.0;
    };
    let mut along = SVector::<f64, 6>::repeat(1.0).normalize();
    let mut most = 0.0;
    for _ in 0..POWERS {
        along = factor.solve(&along);
        most = along.norm();
        along /= most;
    }
    1.0 / most.sqrt()
}

/// Least-squares polynomial of a degree up to 5 through points `(progress, offset)`, with
/// offset zero at the start, added to `base`.
fn fit(points: &[(f64, f64)], base: f64, degree: usize) -> Option<NullSpacePolynomial> {
    let mut normal = SMatrix::<f64, 5, 5>::identity();
    let mut right = SVector::<f64, 5>::zeros();
    for i in 0..degree {
        for j in 0..degree {
            normal[(i, j)] = points.iter().map(|(x, _)| x.powi((i + j + 2) as i32)).sum();
        }
        right[i] = points.iter().map(|(x, y)| x.powi(i as i32 + 1) * y).sum();
    }
    let c = normal.cholesky()?.solve(&right);
    Some([base, c[0], c[1], c[2], c[3], c[4]])
}
