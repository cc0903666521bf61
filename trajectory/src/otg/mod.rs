//! State to state: the fastest jerk-limited move between two states of motion.

mod audit;
mod axis;
mod bench;
mod brake;
mod check;
mod direct;
mod error;
mod extent;
mod joint;
mod limits;
mod line;
mod motion;
mod options;
mod pace;
mod plan;
mod problems;
mod running;
mod side;
mod state;
mod strand;

pub use audit::Audit;
pub use bench::{Row, bench};
pub use error::OtgError;
pub use limits::Limits;
pub use motion::Motion;
pub use options::{Interface, Options, Synchronisation};
pub use problems::{Ends, Problem, Problems};
pub use running::Running;
pub use state::State;

/// Plans moves from state to state.
#[derive(Clone, Copy, Debug)]
pub struct Otg;

impl Otg {
    /// Plans the fastest move from `start` to `target`.
    ///
    /// # Errors
    /// See [`OtgError`].
    pub fn plan<const N: usize>(
        start: &State<N>,
        target: &State<N>,
        limits: &Limits<N>,
        options: &Options<N>,
    ) -> Result<Motion<N>, OtgError> {
        plan::plan(start, target, limits, options)
    }
}

#[cfg(test)]
mod tests;
