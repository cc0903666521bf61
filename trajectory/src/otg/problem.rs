//! A state-to-state problem as one value.

use super::check;
use super::error::OtgError;
use super::limits::Limits;
use super::options::Options;
use super::state::State;

/// One state-to-state problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Problem<const N: usize> {
    /// Where the move starts.
    pub start: State<N>,
    /// What it must reach.
    pub target: State<N>,
    /// Limits during the move.
    pub limits: Limits<N>,
    /// Kind of move.
    pub options: Options<N>,
}

impl<const N: usize> Problem<N> {
    /// Whether the numbers are usable and the target can be reached at all.
    ///
    /// # Errors
    /// As [`super::Otg::plan`] for unusable numbers and targets beyond limits.
    pub fn check(&self) -> Result<(), OtgError> {
        check::input(&self.start, &self.target, &self.limits, &self.options)
    }
}
