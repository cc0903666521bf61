//! What a null-space motion costs, and steps to one that costs less.

use super::ease::ease_along;
use super::null_space::NullSpace;
use super::trace::Task;
use super::{Cost, FollowPoint};
use nalgebra::SVector;

/// How often one step is taken in one direction.
const REPEATS: usize = 3;

/// What a null-space motion costs.
#[derive(Clone, Copy)]
pub(super) struct Price<'a, const N: usize> {
    /// The path at a few places.
    pub(super) coarse: &'a Task<'a, N>,
    pub(super) start: &'a SVector<f64, N>,
    /// The least ease that it must have along the path.
    pub(super) ease: f64,
    /// The cost of the joints along the path.
    pub(super) cost: &'a Cost<'a, N>,
}

impl<const N: usize> Price<'_, N> {
    /// The joints with a motion and their cost, if it has the ease.
    pub(super) fn of(&self, moving: &NullSpace<N>) -> Option<(Vec<FollowPoint<N>>, f64)> {
        let points = self.coarse.trace(self.start, moving).ok()?;
        let eased = ease_along(self.coarse, &points) >= self.ease;
        let cost = eased.then(|| (self.cost)(&points))?;
        Some((points, cost))
    }

    /// A motion with its cost, if it has the ease and costs less than `least`.
    pub(super) fn below(&self, least: f64, moving: &NullSpace<N>) -> Option<f64> {
        let (_, cost) = self.of(moving)?;
        (cost < least).then_some(cost)
    }
}

/// Takes steps in one direction (1), or against it (-1), while they save something, as `step` says of each.
pub(super) fn both_ways(mut step: impl FnMut(f64) -> bool) {
    for sign in [1.0, -1.0] {
        let taken = (0..REPEATS).take_while(|_| step(sign)).count();
        if 0 < taken && taken < REPEATS {
            return;
        }
    }
}
