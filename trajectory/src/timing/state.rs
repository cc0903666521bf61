//! Values and multipliers of the rows of a problem.

use super::block::{LANE, Lane};
use super::problem::Problem;

/// Values `g`, multipliers and their steps of a row in each cell of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ConstraintRow {
    pub g: Lane,
    pub multiplier: Lane,
    pub change: Lane,
}

/// The same of a row bounded in norm: the square of the norm, multipliers and their steps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Norm {
    pub square: Lane,
    pub multiplier: Lane,
    pub change: Lane,
}

/// All rows, in the order of the problem's.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub acceleration: Vec<ConstraintRow>,
    pub jerk: Vec<ConstraintRow>,
    /// Those of the caps, at both slots of values of each block.
    pub cap: Vec<[ConstraintRow; 2]>,
    pub norm_acceleration: Vec<Norm>,
    pub norm_jerk: Vec<Norm>,
}

impl State {
    /// For the rows of `problem`.
    pub(super) fn new(problem: &Problem) -> Self {
        Self {
            acceleration: vec![ConstraintRow::default(); problem.acceleration.len()],
            jerk: vec![ConstraintRow::default(); problem.jerk.len()],
            cap: vec![[ConstraintRow::default(); 2]; problem.value.len()],
            norm_acceleration: vec![Norm::default(); problem.norm_acceleration.len()],
            norm_jerk: vec![Norm::default(); problem.norm_jerk.len()],
        }
    }

    /// Rows in all.
    pub(super) fn rows(&self) -> usize {
        let joints = self.acceleration.len() + self.jerk.len() + 2 * self.cap.len();
        LANE * (joints + self.norm_acceleration.len() + self.norm_jerk.len())
    }
}
