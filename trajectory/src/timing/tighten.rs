//! From a problem to the law that ships: solve, bound between the grid points, tighten the rows
//! that are exceeded there, solve again.

use super::audit::{self, Audit};
use super::certificate::Limit;
use super::grid::{Bounded, Grid};
use super::interior::Interior;
use super::pieces::{Maker, Pieces};
use super::problem::Problem;
use crate::{Path, TimingError};

/// Newton steps after which the best law so far is taken.
pub(super) const MOST_STEPS: usize = 60;
/// Newton steps after rows were tightened.
const FEW_STEPS: usize = 12;
/// Times that rows are tightened.
const ROUNDS: usize = 2;
/// Time that need not be gained back by another round.
const ENOUGH: f64 = 1.0005;

/// A law with its pieces and their bounds.
#[derive(Clone, Debug)]
pub(super) struct Draft<const N: usize> {
    pub(super) pieces: Pieces<N>,
    pub(super) audit: Audit,
    pub(super) iterations: usize,
    pub(super) cells: usize,
    pub(super) x: Vec<f64>,
    duration: f64,
}

impl<const N: usize> Draft<N> {
    /// The pieces of the law `x` and their bounds.
    pub(super) fn new<P: Path<N>>(
        bounded: Bounded<'_, P, N>,
        (grid, problem): (&Grid, &Problem),
        x: Vec<f64>,
        iterations: usize,
    ) -> Self {
        let pieces = Maker::new(bounded, grid).make(problem, &x);
        let audit = Audit::new(bounded, &pieces);
        let total: f64 = pieces.joint.iter().map(|piece| piece.duration).sum();
        let duration = total * audit.stretch();
        Self {
            pieces,
            audit,
            iterations,
            cells: problem.cells(),
            x,
            duration,
        }
    }
}

/// The fastest law found over `grid` once it is stretched to meet every bound.
pub(super) fn best<P: Path<N>, const N: usize>(
    bounded: Bounded<'_, P, N>,
    grid: &Grid,
) -> Result<Draft<N>, TimingError> {
    let mut problem = bounded.problem(grid);
    if problem.moving {
        return super::moving::best(bounded, grid, problem);
    }
    let mut interior = Interior::new(&problem, vec![1.0; problem.cells() + 2]);
    interior.solve(bounded.options.gap, 0.3, MOST_STEPS);
    let (x, mut iterations) = (interior.x, interior.iterations);
    let mut best = Draft::new(bounded, (grid, &problem), x, iterations);
    let mut last = best.clone();
    for _ in 0..ROUNDS {
        if last.audit.stretch() < ENOUGH {
            break;
        }
        tighten(&mut problem, &last, 1.0);
        let mut interior = Interior::new(&problem, last.x);
        interior.solve(bounded.options.gap, 0.02, FEW_STEPS);
        iterations += interior.iterations;
        last = Draft::new(bounded, (grid, &problem), interior.x, iterations);
        if last.duration < best.duration {
            best = last.clone();
        }
    }
    best.iterations = iterations;
    Ok(best)
}

/// Divides the limits that pieces exceed by their excess and `more`, in the cells of these pieces.
pub(super) fn tighten<const N: usize>(problem: &mut Problem, draft: &Draft<N>, more: f64) {
    let columns = draft.audit.limits.len().max(1);
    let count = columns * problem.cells();
    let mut excess = vec![1.0_f64; count];
    for (row, cell) in draft.audit.ratios.chunks(columns).zip(&draft.pieces.cell) {
        for (most, ratio) in excess[cell * columns..].iter_mut().zip(row) {
            *most = most.max(*ratio);
        }
    }
    let tools = Tools::new(&draft.audit.limits);
    for (k, row) in excess.chunks(columns).enumerate() {
        for (limit, excess) in draft
            .audit
            .limits
            .iter()
            .zip(row)
            .filter(|(_, x)| **x > 1.0)
        {
            scale(problem, (k, &tools), *limit, *excess * more);
        }
    }
}

/// Which tool rows there are.
struct Tools {
    linear_acceleration: bool,
    linear_jerk: bool,
}

impl Tools {
    fn new(limits: &[Limit]) -> Self {
        Self {
            linear_acceleration: limits.contains(&Limit::ToolAcceleration),
            linear_jerk: limits.contains(&Limit::ToolJerk),
        }
    }
}

/// Scales the rows of one limit in cell `k`.
fn scale(problem: &mut Problem, (k, tools): (usize, &Tools), limit: Limit, factor: f64) {
    let values = 2 * k..2 * k + 3;
    let places = problem.jerk_places[k]..problem.jerk_places[k + 1];
    let (norm_values, norm_places) = (problem.norm_accelerations(), problem.norm_jerks());
    match limit {
        Limit::JointAcceleration(j) => {
            let (group, l) = (j / super::lanes::LANE, j % super::lanes::LANE);
            for i in values {
                let rows = &mut problem.acceleration[i * problem.lanes + group];
                rows.iter_mut().for_each(|row| row[l] *= factor);
            }
        }
        Limit::JointJerk(j) => {
            let (group, l) = (j / super::lanes::LANE, j % super::lanes::LANE);
            for i in places {
                let rows = &mut problem.jerk[i * problem.lanes + group];
                rows.iter_mut().for_each(|row| row[l] *= factor);
            }
        }
        Limit::ToolAcceleration | Limit::AngularAcceleration => {
            let second = limit == Limit::AngularAcceleration && tools.linear_acceleration;
            for i in values {
                let row = &mut problem.norm_acceleration[i * norm_values + usize::from(second)];
                row.iter_mut().for_each(|x| *x *= factor);
            }
        }
        Limit::ToolJerk | Limit::AngularJerk => {
            let second = limit == Limit::AngularJerk && tools.linear_jerk;
            for i in places {
                let row = &mut problem.norm_jerk[i * norm_places + usize::from(second)];
                row.iter_mut().for_each(|x| *x *= factor);
            }
        }
        _ => {
            debug_assert_eq!(audit::order(limit), 1);
            problem.cap[values]
                .iter_mut()
                .for_each(|cap| *cap *= factor * factor);
        }
    }
}
