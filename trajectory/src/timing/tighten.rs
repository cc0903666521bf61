//! The pieces of a law with their bounds, and the rows tightened where these are exceeded between
//! the gridpoints.

use super::audit::Audit;
use super::block::{LANE, Lane};
use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::Interior;
use super::pieces::{Maker, Pieces};
use super::problem::Problem;
use crate::limit::{Limit, order};

/// Newton steps after which the best law so far is used.
pub(super) const MOST_STEPS: usize = 60;

/// A law with its pieces and their bounds.
#[derive(Clone, Debug)]
pub(super) struct Draft<const N: usize> {
    pub(super) pieces: Pieces<N>,
    pub(super) audit: Audit,
    pub(super) iterations: usize,
    pub(super) cells: usize,
    /// How long it takes once it is stretched to meet every bound (s).
    pub(super) duration: f64,
}

impl<const N: usize> Draft<N> {
    /// The pieces of the law `x` and their bounds.
    pub(super) fn new(
        bounded: Bounded<'_, N>,
        gridpoints: &Gridpoints<'_, N>,
        problem: &Problem,
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
            scale(problem, k, &tools, *limit, *excess * more);
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
fn scale(problem: &mut Problem, k: usize, tools: &Tools, limit: Limit, factor: f64) {
    let ends = [(k, false), (k, true), (k + 1, false)];
    let values = ends.map(|(k, middle)| (Problem::value_slot(k, middle), k % LANE));
    let (jerks, l) = (problem.jerk_slots(k), k % LANE);
    let (joints, tool_jerks) = (problem.joints, problem.tool_jerks);
    match limit {
        Limit::JointAcceleration(j) => {
            let Some(row) = problem.joint_row(0, j) else {
                return;
            };
            for (slot, l) in values {
                widen(&mut problem.acceleration[slot * joints + row], l, factor);
            }
        }
        Limit::JointJerk(j) => {
            let Some(row) = problem.joint_row(1, j) else {
                return;
            };
            for slot in jerks {
                widen(&mut problem.jerk[slot * joints + row], l, factor);
            }
        }
        Limit::ToolAcceleration | Limit::AngularAcceleration => {
            let second = limit == Limit::AngularAcceleration && tools.linear_acceleration;
            for (slot, l) in values {
                let row = slot * problem.tool_accelerations + usize::from(second);
                widen(&mut problem.norm_acceleration[row], l, factor * factor);
            }
        }
        Limit::ToolJerk | Limit::AngularJerk => {
            let second = limit == Limit::AngularJerk && tools.linear_jerk;
            for slot in jerks {
                let row = slot * tool_jerks + usize::from(second);
                widen(&mut problem.norm_jerk[row], l, factor * factor);
            }
        }
        _ => {
            assert_eq!(order(limit), 1);
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
