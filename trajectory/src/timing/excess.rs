//! By how much the limits are exceeded between the gridpoints of a law, and limits narrowed by that.

use super::block::{LANE, Lane};
use super::draft::Draft;
use super::problem::Problem;
use crate::limit::{Limit, order, root};

/// By how much limits are exceeded, or narrowed, in each cell; 1 where they are not.
#[derive(Clone, Debug, Default)]
pub(super) struct Excess {
    limits: Vec<Limit>,
    /// One row for each cell, one column for each limit.
    ratios: Vec<f64>,
}

impl Excess {
    /// Nothing is exceeded.
    pub(super) fn none<const N: usize>(draft: &Draft<N>) -> Self {
        let limits = draft.audit.limits.clone();
        Self {
            ratios: vec![1.0; limits.len().max(1) * draft.cells],
            limits,
        }
    }

    /// What the pieces of a draft exceed.
    pub(super) fn of<const N: usize>(draft: &Draft<N>) -> Self {
        let mut excess = Self::none(draft);
        let columns = excess.columns();
        for (row, cell) in draft.audit.ratios.chunks(columns).zip(&draft.pieces.cell) {
            for (most, ratio) in excess.ratios[cell * columns..].iter_mut().zip(row) {
                *most = if *ratio > *most { *ratio } else { *most };
            }
        }
        excess
    }

    fn columns(&self) -> usize {
        self.limits.len().max(1)
    }

    /// The same with all that is exceeded raised by a factor.
    pub(super) fn raised(mut self, more: f64) -> Self {
        for ratio in &mut self.ratios {
            *ratio *= if *ratio > 1.0 { more } else { 1.0 };
        }
        self
    }

    /// Both, one after the other.
    pub(super) fn and(mut self, other: &Self) -> Self {
        for (ratio, other) in self.ratios.iter_mut().zip(&other.ratios) {
            *ratio *= if *other > 1.0 { *other } else { 1.0 };
        }
        self
    }

    /// The factor by which time has to be stretched for the limits to hold in cell `k`; at least 1.
    pub(super) fn stretch(&self, k: usize) -> f64 {
        let columns = self.columns();
        let row = self.limits.iter().zip(&self.ratios[k * columns..]);
        let factors = row.map(|(limit, ratio)| root(*ratio, order(*limit)));
        factors.fold(1.0, f64::max)
    }

    /// The same over other cells, each of which lies in a cell; 1 where that is divided.
    pub(super) fn over(&self, cells: &[Option<usize>]) -> Self {
        let columns = self.columns();
        let row = |cell: &Option<usize>| {
            let row = cell.map(|k| &self.ratios[k * columns..(k + 1) * columns]);
            row.map_or(vec![1.0; columns], <[f64]>::to_vec)
        };
        Self {
            limits: self.limits.clone(),
            ratios: cells.iter().flat_map(row).collect(),
        }
    }

    /// Divides the limits of a problem by this.
    pub(super) fn narrow(&self, problem: &mut Problem) {
        let tools = Tools::new(&self.limits);
        for (k, row) in self.ratios.chunks(self.columns()).enumerate() {
            let exceeded = self.limits.iter().zip(row).filter(|(_, x)| **x > 1.0);
            for (limit, excess) in exceeded {
                scale(problem, k, &tools, *limit, *excess);
            }
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
