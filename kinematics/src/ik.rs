//! Inverse kinematics: from a pose of the tool to joint positions.

mod branches;
mod classify;
mod closed;
mod failure;
mod frames;
mod goal;
mod numeric;
mod orient;
mod polish;
mod product;
mod report;
mod six;
mod solving;
mod subproblems;
mod swivel;
mod turns;

pub use goal::Goal;
pub(crate) use goal::PoseError;
pub(crate) use numeric::Restarts;
pub use report::{Branches, IkFailure, IkReport, MOST_BRANCHES, Solution};
use simd::Frame;

use crate::chain::Chain;
use crate::measure::{self, LENGTH};
use closed::Closed;
use goal::Target;
use nalgebra::{Isometry3, SMatrix, SVector};
use numeric::{Descent, SolverResult, Stop};

/// Restarts before a goal is reported as not reached.
const RESTARTS: u32 = 1500;
/// The same for an exact closed form that has found nothing: the search finds what stands in the way.
const EXPLAINING: u32 = 100;
/// How many values of the free parameter of seven joints are tried, the finer grid where the first finds
/// nothing.
const SWEEPS: [u32; 2] = [360, 1440];
/// Restarts after which the search ends if the position alone is out of reach.
const PATIENCE: u32 = 40;
/// Restarts of the search for all solutions.
const SEARCH: u32 = 120;

/// Solves inverse kinematics for one arm with its base and tool.
///
/// Every result is a pure function of the arguments: no clock, no random numbers, no heap.
///
/// ```
/// # let text = include_str!("../../robots/irb120/robot.urdf");
/// # use kinematics::{Solver, urdf};
/// let solver = Solver::new(urdf::read(text, None)?.chain::<6>()?);
/// let down = nalgebra::Vector3::y() * std::f64::consts::PI;
/// let pose = nalgebra::Isometry3::new(nalgebra::Vector3::new(0.3, 0.1, 0.3), down);
/// let solution = solver.solve(&pose)?;
/// assert!((solver.chain().forward(&solution.q).translation.vector - pose.translation.vector).norm() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solver<const N: usize> {
    chain: Chain<N>,
    stop: Stop,
    closed: Option<Closed>,
}

impl<const N: usize> Solver<N> {
    /// A solver for a chain of one to eight joints.
    #[must_use]
    pub fn new(chain: Chain<N>) -> Self {
        const { assert!(N >= 1 && N <= 8, "one to eight joints") };
        let stop = Stop {
            position: 1e-9,
            rotation: 1e-9,
            steps: 40,
            limits: true,
        };
        let mut solver = Self {
            chain,
            stop,
            closed: Closed::of(&chain),
        };
        if !solver.closed_form_holds() {
            solver.closed = None;
        }
        solver
    }

    /// A solver that never uses a closed form.
    #[must_use]
    pub fn numeric(chain: Chain<N>) -> Self {
        let stop = Stop {
            position: 1e-9,
            rotation: 1e-9,
            steps: 40,
            limits: true,
        };
        Self {
            chain,
            stop,
            closed: None,
        }
    }

    /// The same solver with other tolerances (m, rad) for numeric answers; 1e-9 each
    /// unless set. Closed forms are exact to rounding whatever these are.
    #[must_use]
    pub fn with_tolerance(mut self, position: f64, rotation: f64) -> Self {
        (self.stop.position, self.stop.rotation) = (position.max(1e-12), rotation.max(1e-12));
        self
    }

    /// The arm.
    #[must_use]
    pub fn chain(&self) -> &Chain<N> {
        &self.chain
    }

    /// Which closed form the arm has, or `numeric`.
    #[must_use]
    pub fn family(&self) -> &'static str {
        self.closed.as_ref().map_or("numeric", Closed::name)
    }

    /// Whether the closed form is exact to rounding; near ones (calibrated arms) seed a polish.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.closed.as_ref().is_some_and(Closed::exact)
    }

    /// One solution: for arms with a closed form, the branch nearest to the middle of the joint
    /// ranges.
    ///
    /// # Errors
    /// [`IkReport`]: what is in the way, and the nearest pose that was found.
    pub fn solve(&self, pose: &Isometry3<f64>) -> Result<Solution<N>, IkReport<N>> {
        self.nearest(pose, &Restarts::new(&self.chain).at(0))
    }

    /// The solution nearest to `seed` (rad, m); whole turns of its joints are also chosen nearest
    /// to it. For arms with seven joints, the free parameter (see [`Solver::parameter`]) stays as
    /// it is if possible; otherwise it is the nearest value that gives a solution.
    ///
    /// # Errors
    /// [`IkReport`]: what is in the way, and the nearest pose that was found.
    pub fn nearest(
        &self,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
    ) -> Result<Solution<N>, IkReport<N>> {
        let Some(closed) = &self.closed else {
            return self.reach(&Goal::Pose(*pose), seed);
        };
        let parameter = closed.parameter(seed);
        if let Some(solution) = self.nearest_at(closed, pose, seed, parameter) {
            return Ok(solution);
        }
        if closed.is_redundant() {
            for step in [0.1, 0.25, 0.5, 0.9, 1.4, 2.0, 3.0] {
                for side in [step, -step] {
                    let moved = self.nearest_at(closed, pose, seed, parameter + side);
                    if let Some(solution) = moved {
                        return Ok(solution);
                    }
                }
            }
            let grids = if closed.exact() {
                &SWEEPS[..]
            } else {
                &SWEEPS[..1]
            };
            for values in grids {
                if let Some(solution) = self.sweep(closed, pose, seed, *values) {
                    return Ok(solution);
                }
            }
        }
        let restarts = if closed.exact() { EXPLAINING } else { RESTARTS };
        self.reach_within(&Goal::Pose(*pose), seed, restarts)
    }

    /// All branches of a pose inside the limits, at most [`MOST_BRANCHES`], each with its whole
    /// turns nearest to the middle of the joint ranges. If the pose is singular, two branches may
    /// be the same joint position.
    ///
    /// Arms with seven joints have one free parameter; the branches are those at the
    /// parameter of the middle of the joint ranges, see [`Solver::solve_all_at`].
    /// Arms without a closed form are searched from a fixed sequence of seeds.
    #[must_use]
    pub fn solve_all(&self, pose: &Isometry3<f64>) -> Branches<N> {
        let middle = Restarts::new(&self.chain).at(0);
        match &self.closed {
            Some(closed) => self.branches_at(closed, pose, &middle, closed.parameter(&middle)),
            None => self.search_all(pose),
        }
    }

    /// All branches at one value (rad) of the free parameter; whole turns, and the free joints of
    /// singular poses, nearest to `seed`. For arms without a free parameter, all branches.
    #[must_use]
    pub fn solve_all_at(
        &self,
        pose: &Isometry3<f64>,
        parameter: f64,
        seed: &SVector<f64, N>,
    ) -> Branches<N> {
        match &self.closed {
            Some(closed) => self.branches_at(closed, pose, seed, parameter),
            None => self.search_all(pose),
        }
    }

    /// The free parameter of a seven-joint arm at `q`, rad: its swivel angle (spherical shoulder
    /// and wrist), or the joint that its closed form takes as given.
    #[must_use]
    pub fn parameter(&self, q: &SVector<f64, N>) -> f64 {
        self.closed
            .as_ref()
            .map_or(0.0, |closed| closed.parameter(q))
    }

    /// `count` values (rad) of the free parameter, evenly spaced over its range. With
    /// [`Solver::solve_all_at`] they give every way in which a seven-joint arm reaches a pose. One
    /// value if there is no free parameter.
    #[must_use]
    pub fn parameters(&self, count: usize) -> Vec<f64> {
        match &self.closed {
            Some(closed) if closed.is_redundant() => (0..count)
                .map(|i| self.parameter_at(closed, (i as f64 + 0.5) / count as f64))
                .collect(),
            _ => vec![0.0],
        }
    }

    /// Distance (m) and angle (rad) of the tool at `q` from a pose.
    #[must_use]
    pub fn error(&self, pose: &Isometry3<f64>, q: &SVector<f64, N>) -> (f64, f64) {
        let (pose_error, _) = self.pose_error_at(&Goal::Pose(*pose), q);
        (pose_error.position, pose_error.rotation)
    }

    /// Reaches any kind of goal, from `seed` and then from a fixed sequence of restarts.
    ///
    /// # Errors
    /// [`IkReport`]: what is in the way, and the nearest pose that was found.
    pub fn reach(&self, goal: &Goal, seed: &SVector<f64, N>) -> Result<Solution<N>, IkReport<N>> {
        self.reach_within(goal, seed, RESTARTS)
    }

    /// The same with at most so many restarts.
    fn reach_within(
        &self,
        goal: &Goal,
        seed: &SVector<f64, N>,
        restarts: u32,
    ) -> Result<Solution<N>, IkReport<N>> {
        let (target, seeds) = (goal.target(), Restarts::new(&self.chain));
        let mut best = self.descend(&target, seed, self.stop);
        for index in 0..restarts {
            if best.reached {
                return Ok(self.solution(&best, seed));
            }
            let next = self.restarted(&target, &seeds, index);
            if next.reached || score(&next) < score(&best) {
                best = next;
            }
            if index == PATIENCE && !best.reached {
                let place = self.best_place(goal.point(), &best.q);
                if !place.reached {
                    return Err(self.report(goal, &best, Some(place)));
                }
            }
        }
        if best.reached {
            Ok(self.solution(&best, seed))
        } else {
            Err(self.report(goal, &best, None))
        }
    }

    /// Follows a goal that moved a little from the pose at `seed`: no restarts, a bounded number of
    /// steps.
    ///
    /// # Errors
    /// [`IkReport`] as for [`Solver::reach`], with [`IkFailure::Singular`] where the
    /// arm cannot move on.
    pub fn track(&self, goal: &Goal, seed: &SVector<f64, N>) -> Result<Solution<N>, IkReport<N>> {
        let result = self.descend(&goal.target(), seed, self.stop);
        if result.reached {
            return Ok(self.solution(&result, seed));
        }
        let smallest = measure::dexterity(&self.chain, &result.q).smallest;
        Err(self.report_with(&result, IkFailure::Singular { smallest }))
    }

    /// Solutions found from the whole sequence of restarts, each once.
    fn search_all(&self, pose: &Isometry3<f64>) -> Branches<N> {
        let target = Goal::Pose(*pose).target();
        let (mut found, seeds) = (Branches::new(), Restarts::new(&self.chain));
        for index in 0..SEARCH {
            let result = self.restarted(&target, &seeds, index);
            let known =
                |other: &Solution<N>| turns::distance(&self.chain, &other.q, &result.q) < 1e-5;
            if result.reached && !found.iter().any(known) {
                found.push(self.solution(&result, &SVector::zeros()));
            }
        }
        found
    }

    /// Distance of the tool from a goal at `q`, and the Jacobian there.
    pub(crate) fn pose_error_at(
        &self,
        goal: &Goal,
        q: &SVector<f64, N>,
    ) -> (PoseError, SMatrix<f64, 6, N>) {
        self.pose_error_of(&goal.target(), q)
    }

    /// The same for a goal that is prepared.
    pub(crate) fn pose_error_of(
        &self,
        target: &Target,
        q: &SVector<f64, N>,
    ) -> (PoseError, SMatrix<f64, 6, N>) {
        let (tool, jacobian) = self.chain.jacobian(q);
        let tool = Frame::from_isometry(&tool);
        (target.pose_error(simd::Plain, &tool), jacobian)
    }

    fn descend(&self, target: &Target, seed: &SVector<f64, N>, stop: Stop) -> SolverResult<N> {
        self.chain.build().run(Descent {
            chain: &self.chain,
            target,
            seed: *seed,
            stop,
        })
    }

    /// One restart. Every second one may leave the limits during the search, which avoids local
    /// minima at corners of the limits; if it ends outside, it continues from the nearest corner.
    fn restarted(&self, target: &Target, seeds: &Restarts<'_, N>, index: u32) -> SolverResult<N> {
        let seed = seeds.at(index);
        let limits = index % 2 == 1;
        let mut result = self.descend(
            target,
            &seed,
            Stop {
                limits,
                ..self.stop
            },
        );
        if !limits {
            result.q = turns::nearest(&self.chain, &result.q, &seed);
            if !self.chain.within_limits(&result.q, 0.0) {
                // Near the goal, but outside the limits: the goal may be reached from the nearest
                // corner.
                result = self.descend(target, &self.clamped(&result.q), self.stop);
            }
        }
        result
    }

    /// The nearest joint position inside the limits.
    fn clamped(&self, q: &SVector<f64, N>) -> SVector<f64, N> {
        SVector::from_fn(|i, _| q[i].max(self.chain.lower()[i]).min(self.chain.upper()[i]))
    }

    fn solution(&self, result: &SolverResult<N>, seed: &SVector<f64, N>) -> Solution<N> {
        Solution {
            q: turns::nearest(&self.chain, &result.q, seed),
            branch: None,
        }
    }
}

/// Distance of a solver result from its goal, lengths in units of [`LENGTH`].
fn score<const N: usize>(result: &SolverResult<N>) -> f64 {
    (result.position / LENGTH).hypot(result.rotation)
}
