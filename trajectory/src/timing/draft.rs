//! The pieces of a law with their bounds.

use super::audit::Audit;
use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::Interior;
use super::pieces::{Maker, Pieces};
use super::problem::Problem;

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
        gridpoints: &Gridpoints<N>,
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
