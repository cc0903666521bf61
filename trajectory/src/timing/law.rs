//! The law alone, before it is made into pieces and bounded.

use super::TimingOptions;
use super::draft::MOST_STEPS;
use super::grid::{Bounded, Grid};
use super::gridpoints::Gridpoints;
use super::interior::{Descent, Interior};
use super::problem::Problem;
use super::reachability::ReachabilityPass;
use crate::{JointLimits, Path, TimingError, ToolLimits};

/// The optimisation inside [`time_path`](super::time_path), ready to be solved: for benchmarks,
/// because other solvers do only this part.
#[derive(Clone, Debug)]
pub struct LawProblem {
    problem: Problem,
    gap: f64,
}

/// A law over a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Its duration (s). Limits hold on the grid, not yet between its points.
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
        path: &dyn Path<N>,
        joint: &JointLimits<N>,
        tool: &ToolLimits,
        options: &TimingOptions,
    ) -> Result<Self, TimingError> {
        let reachability = ReachabilityPass::new(path, joint, tool, options)?;
        let grid = Grid::new(&reachability, path.knots(), path.end(), options);
        let bounded = Bounded {
            path,
            joint,
            tool,
            options,
        };
        let problem = bounded.problem(&Gridpoints::new(bounded, grid));
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
        interior.solve(&self.problem, &descent(self.gap));
        Law {
            duration: interior.time(),
            iterations: interior.iterations,
        }
    }
}

/// From a law that is only known to be possible, to a relative gap.
fn descent(gap: f64) -> Descent {
    Descent {
        gap,
        first: 0.3,
        steps: MOST_STEPS,
        limit: f64::INFINITY,
    }
}

/// The problem of a path whose tool moves and turns with its joints, under limits of both.
#[cfg(test)]
pub(super) fn swaying(cells: usize) -> Problem {
    use super::Boundary;
    use crate::{JointPoint, PathPoint, SplinePath, ToolPoint};
    use nalgebra::{Isometry3, SVector, Vector3};

    struct Swaying(SplinePath<5>);

    impl Path<5> for Swaying {
        fn end(&self) -> f64 {
            self.0.end()
        }
        fn knots(&self) -> &[f64] {
            self.0.knots()
        }
        fn at(&self, u: f64) -> PathPoint<5> {
            let JointPoint { q } = self.0.at(u).joint;
            let part = |k: usize, i: usize| Vector3::new(q[k][i], q[k][i + 1], q[k][i + 2]);
            let tool = ToolPoint {
                pose: Isometry3::identity(),
                linear: [part(1, 0), part(2, 0), part(3, 0)],
                angular: [part(1, 2), part(2, 2), part(3, 2)],
            };
            PathPoint {
                joint: JointPoint { q },
                tool,
            }
        }
    }

    let points = (0..4).map(|i| SVector::from_fn(|j, _| (1.3 * f64::from(i) + j as f64).sin()));
    let points: Vec<SVector<f64, 5>> = points.collect();
    let path = Swaying(SplinePath::new(&points).unwrap_or_else(|| unreachable!("four points")));
    let tool = ToolLimits {
        speed: 1.0,
        acceleration: 6.0,
        jerk: 80.0,
        angular_speed: 2.0,
        angular_acceleration: 9.0,
        angular_jerk: 90.0,
    };
    let options = TimingOptions {
        end: Boundary::Rest,
        cells: Some(cells),
        ..TimingOptions::default()
    };
    let limits = JointLimits::uniform(2.0, 10.0, 100.0);
    let problem = LawProblem::new(&path, &limits, &tool, &options);
    problem.map_or_else(|error| unreachable!("{error}"), |law| law.problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::Build;

    /// The wide build and that for every processor give the same bits, whatever is left over in
    /// the last block.
    #[test]
    fn both_builds_find_the_same_law() {
        for cells in [8, 9, 10, 11, 60] {
            let problem = swaying(cells);
            let [wide, plain] = [Build::detect(), Build::Plain].map(|build| {
                let mut interior = Interior::with(&problem, build);
                interior.slow_down(&problem);
                interior.solve(&problem, &descent(1e-6));
                interior
            });
            assert_eq!(wide.x, plain.x);
            assert!(wide.iterations > 5 && wide.iterations == plain.iterations);
            assert!(wide.time().is_finite());
        }
    }
}
