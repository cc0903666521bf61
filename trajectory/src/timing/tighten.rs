//! Computes the final law of a problem: solves, bounds between the gridpoints, tightens the rows
//! that are exceeded there, solves again.

use super::audit::Audit;
use super::certificate::{Limit, order};
use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::Interior;
use super::pieces::{Maker, Pieces};
use super::problem::Problem;
use super::simd::{LANE, Lane};
use crate::{Path, TimingError};

/// Newton steps after which the best law so far is used.
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
    duration: f64,
}

impl<const N: usize> Draft<N> {
    /// The pieces of the law `x` and their bounds.
    pub(super) fn new<P: Path<N>>(
        bounded: Bounded<'_, P, N>,
        (gridpoints, problem): (&Gridpoints<'_, N>, &Problem),
        interior: &Interior,
    ) -> Self {
        let pieces = Maker::new(bounded, gridpoints).make(problem, &interior.x);
        let audit = Audit::new(bounded, &pieces);
        let total: f64 = pieces.joint.iter().map(|piece| piece.duration).sum();
        let duration = total * audit.stretch;
        Self {
            pieces,
            audit,
            iterations: interior.iterations,
            cells: problem.cells(),
            duration,
        }
    }
}

/// The fastest law found over `grid` once it is stretched to meet every bound.
pub(super) fn best<P: Path<N>, const N: usize>(
    bounded: Bounded<'_, P, N>,
    gridpoints: &Gridpoints<'_, N>,
) -> Result<Draft<N>, TimingError> {
    let mut problem = bounded.problem(gridpoints);
    if problem.moving {
        return super::moving::best(bounded, gridpoints, problem);
    }
    let gap = bounded.options.gap;
    let mut interior = Interior::new(&problem);
    interior.slow_down(&problem);
    interior.solve(&problem, gap, 0.3, MOST_STEPS);
    let mut last = Draft::new(bounded, (gridpoints, &problem), &interior);
    let mut best = None;
    for _ in 0..ROUNDS {
        if last.audit.stretch < ENOUGH {
            break;
        }
        tighten(&mut problem, &last, 1.0);
        best = Some(faster(best, last));
        interior.slow_down(&problem);
        interior.solve(&problem, gap, 0.02, FEW_STEPS);
        last = Draft::new(bounded, (gridpoints, &problem), &interior);
    }
    let mut best = faster(best, last);
    best.iterations = interior.iterations;
    Ok(best)
}

/// The faster of two drafts, the first if they are equal.
fn faster<const N: usize>(first: Option<Draft<N>>, second: Draft<N>) -> Draft<N> {
    match first {
        Some(first) if first.duration <= second.duration => first,
        _ => second,
    }
}

/// Divides the limits that pieces exceed by their excess and `more`, in the cells of these pieces.
pub(super) fn tighten<const N: usize>(problem: &mut Problem, draft: &Draft<N>, more: f64) {
    let columns = draft.audit.limits.len().max(1);
    let count = columns * problem.cells();
    let mut excess = vec![1.0_f64; count];
    for (row, cell) in draft.audit.ratios.chunks(columns).zip(&draft.pieces.cell) {
        for (most, ratio) in excess[cell * columns..].iter_mut().zip(row) {
            *most = if *ratio > *most { *ratio } else { *most };
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
    let ends = [(k, false), (k, true), (k + 1, false)];
    let values = ends.map(|(k, middle)| (Problem::value_slot(k, middle), k % LANE));
    let (jerks, l) = (problem.jerk_slots(k), k % LANE);
    let (joints, tool_jerks) = (problem.joints, problem.tool_jerks);
    match limit {
        Limit::JointAcceleration(j) => {
            for (slot, l) in values {
                widen(&mut problem.acceleration[slot * joints + j], l, factor);
            }
        }
        Limit::JointJerk(j) => {
            for slot in jerks {
                widen(&mut problem.jerk[slot * joints + j], l, factor);
            }
        }
        Limit::ToolAcceleration | Limit::AngularAcceleration => {
            let second = limit == Limit::AngularAcceleration && tools.linear_acceleration;
            for (slot, l) in values {
                let row = slot * problem.tool_accelerations + usize::from(second);
                let vectors = &mut problem.norm_acceleration[row];
                vectors.iter_mut().for_each(|x| widen(x, l, factor));
            }
        }
        Limit::ToolJerk | Limit::AngularJerk => {
            let second = limit == Limit::AngularJerk && tools.linear_jerk;
            for slot in jerks {
                let vectors = &mut problem.norm_jerk[slot * tool_jerks + usize::from(second)];
                vectors.iter_mut().for_each(|x| widen(x, l, factor));
            }
        }
        _ => {
            debug_assert_eq!(order(limit), 1);
            for (slot, l) in values {
                problem.value[slot / 2][slot % 2][1][l] *= factor * factor;
            }
        }
    }
}

/// Scales the numbers of one cell in a row.
fn widen(row: &mut [Lane], l: usize, factor: f64) {
    row.iter_mut().for_each(|lane| lane[l] *= factor);
}
