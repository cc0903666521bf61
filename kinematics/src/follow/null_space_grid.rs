//! A grid over path parameter and null-space motion, and the cheapest way through it.
//!
//! The grid is filled by continuation: along the path without null-space motion, and beside each such place along the
//! self-motion of the arm. The cheapest way moves the joints little and keeps from limits and singular poses.

use super::differential::task_rows;
use super::linear::solve_once;
use super::null_space::NullSpace;
use super::trace::{Guess, Task};
use crate::measure::{LENGTH, NIMBLE, ROOM};
use arrayvec::ArrayVec;
use nalgebra::{Isometry3, SMatrix, SVector};

/// Size of a grid.
#[derive(Clone, Copy)]
pub(super) struct Size {
    /// Longest step along the path, as a fraction of it.
    along: f64,
    /// Steps of the null-space motion to either side.
    side: usize,
    /// Most such steps from one layer to the next.
    swing: usize,
}

/// Grids that are searched, the next one where no way is found through the one before.
pub(super) const SIZES: [Size; 2] = [
    Size {
        along: COMMON,
        side: 20,
        swing: 3,
    },
    Size {
        along: 0.5 * COMMON,
        side: 70,
        swing: 10,
    },
];
/// The step along the path for which costs are given.
const COMMON: f64 = 1.0 / 16.0;
/// How often a step along the path is halved where no cell is reached.
const HALVINGS: i32 = 5;
/// Size of a step of the null-space motion, rad.
const STEP: f64 = 0.1;
/// Distance of the tool at which a cell counts as reached, m (rad times 0.3 m).
const CLOSE: f64 = 1e-5;
/// Most cells of a column through which a polynomial foretells the next.
const KNOWN: usize = 3;
/// Largest difference of a joint from one cell of the grid to the next, rad.
const CELL_CHANGE: f64 = 0.8;
/// Difference of a joint from the cell before in its column from which on another branch is suspected.
const BRANCH: f64 = 0.4;
/// Least cosine of the angle by which the spare direction turns from one cell to the next.
const TURN: f64 = 0.3;
/// Steps of the power method at the start, and in each cell after another one.
const POWERS: [usize; 2] = [6, 2];
/// Weight of the motion of the joints.
const MOTION: f64 = 1000.0;
/// The ease that is wanted, in units of what a good path has ([`ROOM`], [`NIMBLE`]), and the weight of what is missing to it.
const EASE: f64 = 1.1;
const MISSING: f64 = 300.0;

/// A cell of the grid.
#[derive(Clone, Copy)]
pub(super) struct Cell<const N: usize> {
    pub(super) q: SVector<f64, N>,
    /// Direction (of length 1) in which the joints move without moving the tool.
    pub(super) spare: SVector<f64, N>,
    /// About the direction (of length 1) in which the tool moves least.
    weak: SVector<f64, 6>,
    /// What it costs to be here; infinite beyond limits.
    cost: f64,
    /// The cost of the cheapest way here, infinite where there is none, and the column of the layer before from which it comes.
    total: f64,
    from: usize,
}

impl<const N: usize> Cell<N> {
    /// A cell where nothing is known of costs.
    pub(super) fn at(q: SVector<f64, N>, spare: SVector<f64, N>) -> Self {
        Self {
            q,
            spare,
            weak: SVector::<f64, 6>::repeat(1.0).normalize(),
            cost: 0.0,
            total: f64::INFINITY,
            from: 0,
        }
    }
}

/// The cells at one place of the path.
struct Layer<const N: usize> {
    /// The place, from 0 to 1 over the path.
    x: f64,
    pose: Isometry3<f64>,
    cells: Vec<Option<Cell<N>>>,
}

/// The grid over path parameter and null-space motion.
pub(super) struct Grid<'a, const N: usize> {
    pub(super) task: &'a Task<'a, N>,
    /// No null-space motion.
    pub(super) still: &'a NullSpace<N>,
    pub(super) size: Size,
}

impl<const N: usize> Grid<'_, N> {
    /// The cheapest way through the grid, with the place of each cell; no farther than a way leads.
    pub(super) fn cheapest(&self, start: &SVector<f64, N>) -> Option<Vec<(f64, Cell<N>)>> {
        let mut first = self.layer(0.0);
        let mut cell = Cell::at(*start, *self.still.direction(0));
        let (_, jacobian) = self.task.solver.chain().jacobian(start);
        about_smallest(jacobian, &mut cell.weak, POWERS[0]);
        cell.total = 0.0;
        first.cells[self.size.side] = Some(cell);
        let (mut layers, mut step) = (vec![first], self.size.along);
        loop {
            let x = layers.last()?.x;
            if x >= 1.0 {
                return way(&layers);
            }
            let mut next = self.layer((x + step).min(1.0));
            self.fill(&layers, &mut next);
            if connect(layers.last()?, &mut next, self.size.swing) {
                layers.push(next);
                step = (2.0 * step).min(self.size.along);
            } else if step > self.size.along * 0.5_f64.powi(HALVINGS) {
                step *= 0.5;
            } else {
                return None;
            }
        }
    }

    /// A layer without cells.
    fn layer(&self, x: f64) -> Layer<N> {
        Layer {
            x,
            pose: (self.task.tool)(self.still.from + self.still.span * x).pose,
            cells: vec![None; 2 * self.size.side + 1],
        }
    }

    /// Fills a layer: from the cells to which ways lead in the layer before, the cheapest first, one cell is found without
    /// null-space motion, and others beside it, no farther than a step leads.
    fn fill(&self, layers: &[Layer<N>], next: &mut Layer<N>) {
        let Some(before) = layers.last() else { return };
        let total = |c: usize| before.cells[c].map_or(f64::INFINITY, |cell| cell.total);
        let mut columns: Vec<usize> = (0..before.cells.len())
            .filter(|c| total(*c).is_finite())
            .collect();
        let (Some(first), Some(last)) = (columns.first(), columns.last()) else {
            return;
        };
        let ends = (
            first.saturating_sub(self.size.swing),
            (last + self.size.swing).min(before.cells.len() - 1),
        );
        columns.sort_by(|a, b| total(*a).total_cmp(&total(*b)));
        for column in columns {
            let (None, Some(from)) = (&next.cells[column], &before.cells[column]) else {
                continue;
            };
            let at = from.spare.dot(&from.q);
            let mut near = ahead(layers, column, next.x).unwrap_or(from.q);
            near += from.spare * (at - from.spare.dot(&near));
            let Some(found) = self.cell(&near, (from, at), &next.pose) else {
                continue;
            };
            next.cells[column] = Some(found);
            self.spread(layers, next, column, ends);
        }
    }

    /// Fills a layer from one cell of it to both sides.
    fn spread(&self, layers: &[Layer<N>], next: &mut Layer<N>, from: usize, ends: (usize, usize)) {
        for (count, distance) in [(from - ends.0, -STEP), (ends.1 - from, STEP)] {
            let mut inner = next.cells[from];
            for step in 1..=count {
                let column = if distance < 0.0 {
                    from - step
                } else {
                    from + step
                };
                let (Some(last), None) = (inner, &next.cells[column]) else {
                    break;
                };
                let at = last.spare.dot(&last.q) + distance;
                let beside = last.q + last.spare * distance;
                let before = layers.last().and_then(|layer| layer.cells[column]);
                if before.is_some_and(|cell| (cell.q - beside).amax() > BRANCH) {
                    break;
                }
                let near = ahead(layers, column, next.x)
                    .filter(|near| (near - beside).amax() < STEP)
                    .unwrap_or(beside);
                inner = self.cell(&near, (&last, at), &next.pose);
                next.cells[column] = inner;
            }
        }
    }

    /// The cell at a pose near joints where the spare direction of another cell times the joints is `at`.
    fn cell(
        &self,
        near: &SVector<f64, N>,
        (other, at): (&Cell<N>, f64),
        pose: &Isometry3<f64>,
    ) -> Option<Cell<N>> {
        let mut measured = self.still.clone();
        measured.directions[0] = other.spare;
        let guess = Guess {
            q: near,
            within: CELL_CHANGE,
            exact: CLOSE,
        };
        let second = self.still.polynomials[1][0];
        let q = self.task.newton(&guess, pose, &measured, &[at, second])?;
        let chain = self.task.solver.chain();
        let (_, jacobian) = chain.jacobian(&q);
        let rows = task_rows(&jacobian, &measured);
        let mut only_spare = [0.0; 8];
        only_spare[6] = 1.0;
        let x = solve_once::<N>(chain.build(), &rows, &only_spare);
        let spare = SVector::<f64, N>::from_fn(|i, _| x[i]);
        let length = spare.norm();
        let mut weak = other.weak;
        let smallest = about_smallest(jacobian, &mut weak, POWERS[1]);
        // Not a number is refused too.
        (length * TURN <= 1.0).then(|| Cell {
            weak,
            cost: cost(self.task, &q, smallest),
            ..Cell::at(q, spare / length)
        })
    }
}

/// Where the joints of a column are about to be at `x`, by the polynomial through its last cells, up to [`KNOWN`].
fn ahead<const N: usize>(layers: &[Layer<N>], column: usize, x: f64) -> Option<SVector<f64, N>> {
    let known: ArrayVec<(f64, SVector<f64, N>), KNOWN> = layers
        .iter()
        .rev()
        .take(KNOWN)
        .map_while(|layer| layer.cells[column].map(|cell| (layer.x, cell.q)))
        .collect();
    let term = |(i, (at, q)): (usize, &(f64, SVector<f64, N>))| {
        let others = known.iter().enumerate().filter(|(j, _)| *j != i);
        q * others
            .map(|(_, (other, _))| (x - other) / (at - other))
            .product::<f64>()
    };
    (!known.is_empty()).then(|| known.iter().enumerate().map(term).sum())
}

/// The cheapest ways to the cells of a layer from the one before it, at most `swing` columns away; whether there is any.
fn connect<const N: usize>(before: &Layer<N>, layer: &mut Layer<N>, swing: usize) -> bool {
    let step = layer.x - before.x;
    let mut any = false;
    for (column, cell) in layer.cells.iter_mut().enumerate() {
        let Some(cell) = cell else { continue };
        let last = (column + swing).min(before.cells.len() - 1);
        for source in column.saturating_sub(swing)..=last {
            let Some(origin) = before.cells[source] else {
                continue;
            };
            // The same column can belong to another branch; the joints show it.
            let change = cell.q - origin.q;
            if change.amax() > CELL_CHANGE {
                continue;
            }
            let share = step / COMMON;
            let total = origin.total + share * cell.cost + MOTION * change.norm_squared() / share;
            if total < cell.total {
                (cell.total, cell.from) = (total, source);
                any = true;
            }
        }
    }
    any
}

/// The cheapest way to the last layer.
fn way<const N: usize>(layers: &[Layer<N>]) -> Option<Vec<(f64, Cell<N>)>> {
    let cells = layers.last()?.cells.iter().flatten();
    let mut cell = *cells.min_by(|a, b| a.total.total_cmp(&b.total))?;
    let mut way = Vec::with_capacity(layers.len());
    for (i, layer) in layers.iter().enumerate().rev() {
        way.push((layer.x, cell));
        if i > 0 {
            cell = layers[i - 1].cells[cell.from]?;
        }
    }
    way.reverse();
    Some(way)
}

/// The cost of `q`, where the smallest singular value is about `smallest`: grows towards limits and singular poses, infinite
/// beyond limits.
fn cost<const N: usize>(task: &Task<'_, N>, q: &SVector<f64, N>, smallest: f64) -> f64 {
    let chain = task.solver.chain();
    let missing = |ease: f64| MISSING * (EASE - ease).max(0.0).powi(2);
    let mut sum = (0.08 / smallest.max(1e-4)).powi(2) + missing(smallest / NIMBLE);
    for i in 0..N {
        let room = chain.room(i, q[i]);
        if room <= 0.0 {
            return f64::INFINITY;
        }
        sum += (0.15 / room).powi(2).min(1e6) + missing(room / ROOM);
    }
    sum
}

/// About the smallest singular value of a Jacobian, lengths in units of [`LENGTH`], by some steps from the direction `along`,
/// which comes nearer to the one that belongs to it; never less than it, and zero where it cannot be told from zero.
///
/// # Source
/// G. Golub, C. Van Loan, "Matrix Computations", 4th edition 2013, 8.2.2 (power method of the inverse).
fn about_smallest<const N: usize>(
    mut jacobian: SMatrix<f64, 6, N>,
    along: &mut SVector<f64, 6>,
    steps: usize,
) -> f64 {
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
    let Some(factor) = (jacobian * jacobian.transpose()).cholesky() else {
        return 0.0;
    };
    let mut most = 0.0;
    for _ in 0..steps {
        let next = factor.solve(along);
        most = next.norm();
        if !most.is_finite() {
            return 0.0;
        }
        *along = next / most;
    }
    1.0 / most.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the joints are about to be is exact for a parabola, also where the steps along the path differ.
    #[test]
    fn a_parabola_is_foreseen() {
        let joints = |x: f64| SVector::<f64, 7>::from_fn(|i, _| 0.3 + x * (1.0 - i as f64 * x));
        let layers = [0.0, 0.0625, 0.078_125, 0.109_375].map(|x| Layer {
            x,
            pose: Isometry3::identity(),
            cells: vec![Some(Cell::at(joints(x), SVector::zeros())), None],
        });
        let found = ahead(&layers, 0, 0.25).unwrap();
        assert!((found - joints(0.25)).amax() < 1e-12);
        assert!(ahead(&layers, 1, 0.25).is_none());
        // One cell is all that is known.
        assert_eq!(ahead(&layers[..1], 0, 0.25), Some(joints(0.0)));
    }

    /// Few steps from a direction near the one that belongs to it give the smallest singular value as well as many.
    #[test]
    fn the_smallest_singular_value_is_found_from_a_near_direction() {
        let text = include_str!("../../../robots/panda/robot.urdf");
        let chain = crate::urdf::read(text, None).unwrap().chain::<7>().unwrap();
        for k in 0..20 {
            let q = SVector::<f64, 7>::from_fn(|i, _| {
                let middle = 0.5 * (chain.lower()[i] + chain.upper()[i]);
                middle + (1.0 + 2.1 * i as f64 + 0.9 * f64::from(k)).sin()
            });
            let mut weak = SVector::<f64, 6>::repeat(1.0).normalize();
            let exact = crate::measure::dexterity(&chain, &q).smallest;
            let many = about_smallest(chain.jacobian(&q).1, &mut weak, POWERS[0]);
            let near = q.map(|joint| joint + 0.02);
            let few = about_smallest(chain.jacobian(&near).1, &mut weak, POWERS[1]);
            let wanted = crate::measure::dexterity(&chain, &near).smallest;
            assert!(many >= exact - 1e-9 && many < 1.3 * exact, "{many} {exact}");
            assert!(few >= wanted - 1e-9 && few < 1.2 * wanted, "{few} {wanted}");
        }
    }
}
