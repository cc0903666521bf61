//! The law alone, before it is bounded and made into pieces.

use super::TimingOptions;
use super::grid::{Bounded, Grid};
use super::interior::Interior;
use super::problem::Problem;
use super::stations::Stations;
use super::survey::Survey;
use super::tighten::MOST_STEPS;
use crate::{JointLimits, Path, TimingError, ToolLimits};

/// The optimisation inside [`time_path`](super::time_path), ready to be solved: for benches beside
/// other solvers, which end here too.
#[derive(Clone, Debug)]
pub struct LawProblem {
    problem: Problem,
    gap: f64,
}

/// A law over a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// How long it takes (s). Limits hold on the grid, not yet between its points.
    pub duration: f64,
    /// Newton steps taken.
    pub iterations: usize,
}

impl LawProblem {
    /// The problem for `path`.
    ///
    /// # Errors
    /// As [`time_path`](super::time_path).
    pub fn new<const N: usize>(
        path: &impl Path<N>,
        joint: &JointLimits<N>,
        tool: &ToolLimits,
        options: &TimingOptions,
    ) -> Result<Self, TimingError> {
        let survey = Survey::new(path, joint, tool, options)?;
        let grid = Grid::new(&survey, path.knots(), path.end(), options);
        let bounded = Bounded {
            path,
            joint,
            tool,
            options,
        };
        let problem = bounded.problem(&Stations::new(bounded, &grid));
        Ok(Self {
            problem,
            gap: options.gap,
        })
    }

    /// Cells of the law.
    pub fn cells(&self) -> usize {
        self.problem.cells()
    }

    /// The fastest law.
    pub fn solve(&self) -> Law {
        let mut interior = Interior::new(&self.problem);
        interior.slow_down(&self.problem);
        interior.solve(&self.problem, self.gap, 0.3, MOST_STEPS);
        Law {
            duration: interior.time(),
            iterations: interior.iterations,
        }
    }
}
