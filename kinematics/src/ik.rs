//! Inverse kinematics: from a pose of the tool to joint positions.

mod goal;
mod numeric;
mod report;
mod turns;

pub use goal::Goal;
pub(crate) use goal::{LENGTH, Miss};
pub use report::{Branches, MOST_BRANCHES, Obstacle, Report, Solution};

use crate::chain::Chain;
use crate::measure;
use goal::Target;
use nalgebra::{Isometry3, SMatrix, SVector};
use numeric::{Descent, Landing, Stop};

/// Restarts before a goal counts as not reached.
const RESTARTS: u32 = 120;

/// Solves inverse kinematics for one arm with its base and tool.
///
/// Every answer is a pure function of the question: no clock, no random numbers, no heap.
///
/// ```
/// # let text = include_str!("../../robots/irb120/robot.urdf");
/// # use kinematics::{Solver, urdf};
/// let solver = Solver::new(urdf::read(text, None)?.chain::<6>()?);
/// let pose = nalgebra::Isometry3::translation(0.3, 0.1, 0.4);
/// let solution = solver.solve(&pose)?;
/// assert!((solver.chain().forward(&solution.q).translation.vector - pose.translation.vector).norm() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solver<const N: usize> {
    chain: Chain<N>,
    stop: Stop,
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
        Self { chain, stop }
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

    /// One solution, without regard to where the arm stands.
    ///
    /// # Errors
    /// [`Report`]: what is in the way, and the nearest pose that was found.
    pub fn solve(&self, pose: &Isometry3<f64>) -> Result<Solution<N>, Report<N>> {
        self.reach(&Goal::Pose(*pose), &numeric::restart(&self.chain, 0))
    }

    /// The solution nearest to `seed` (rad, m), with the turns of its joints chosen nearest too.
    ///
    /// # Errors
    /// [`Report`]: what is in the way, and the nearest pose that was found.
    pub fn nearest(
        &self,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
    ) -> Result<Solution<N>, Report<N>> {
        self.reach(&Goal::Pose(*pose), seed)
    }

    /// Reaches any kind of goal, from `seed` and then from a fixed sequence of restarts.
    ///
    /// # Errors
    /// [`Report`]: what is in the way, and the nearest pose that was found.
    pub fn reach(&self, goal: &Goal, seed: &SVector<f64, N>) -> Result<Solution<N>, Report<N>> {
        let target = goal.target();
        let mut best = self.descend(&target, seed, self.stop);
        for index in 0..RESTARTS {
            if best.reached {
                return Ok(self.solution(&best, seed));
            }
            let next = self.descend(&target, &numeric::restart(&self.chain, index), self.stop);
            if next.reached || score(&next) < score(&best) {
                best = next;
            }
        }
        if best.reached {
            Ok(self.solution(&best, seed))
        } else {
            Err(self.report(goal, &best))
        }
    }

    /// Follows a goal that moved a little since `seed`: no restarts, a bounded number of steps.
    ///
    /// # Errors
    /// [`Report`] as for [`Solver::reach`], with [`Obstacle::Singular`] where the
    /// arm cannot move on.
    pub fn track(&self, goal: &Goal, seed: &SVector<f64, N>) -> Result<Solution<N>, Report<N>> {
        let landing = self.descend(&goal.target(), seed, self.stop);
        if landing.reached {
            return Ok(self.solution(&landing, seed));
        }
        let smallest = measure::dexterity(&self.chain, &landing.q).smallest;
        Err(self.report_with(&landing, Obstacle::Singular { smallest }))
    }

    /// Solutions found from the whole sequence of restarts, each once.
    #[must_use]
    pub fn solve_all(&self, pose: &Isometry3<f64>) -> Branches<N> {
        let target = Goal::Pose(*pose).target();
        let mut found = Branches::new();
        for index in 0..RESTARTS {
            let landing = self.restarted(&target, index);
            let known =
                |other: &Solution<N>| turns::distance(&self.chain, &other.q, &landing.q) < 1e-5;
            if landing.reached && !found.iter().any(known) {
                found.push(self.solution(&landing, &SVector::zeros()));
            }
        }
        found
    }

    /// Distance of the tool from a goal at `q`, and the Jacobian there.
    pub(crate) fn miss_at(&self, goal: &Goal, q: &SVector<f64, N>) -> (Miss, SMatrix<f64, 6, N>) {
        let chain = &self.chain;
        let (tool, jacobian) = chain.build().run(crate::chain::Jacobian { chain, q });
        (goal.target().miss(crate::arith::Plain, &tool), jacobian)
    }

    fn descend(&self, target: &Target, seed: &SVector<f64, N>, stop: Stop) -> Landing<N> {
        self.chain.build().run(Descent {
            chain: &self.chain,
            target,
            seed: *seed,
            stop,
        })
    }

    /// One restart. Every second one walks through the limits, which gets it past
    /// corners that they form, and counts when it ends inside them.
    fn restarted(&self, target: &Target, index: u32) -> Landing<N> {
        let seed = numeric::restart(&self.chain, index);
        let limits = index % 2 == 0;
        let mut landing = self.descend(
            target,
            &seed,
            Stop {
                limits,
                ..self.stop
            },
        );
        if !limits {
            landing.q = turns::nearest(&self.chain, &landing.q, &seed);
            if !self.chain.within_limits(&landing.q, 0.0) {
                landing.reached = false;
                (landing.position, landing.rotation) = (f64::INFINITY, f64::INFINITY);
            }
        }
        landing
    }

    fn solution(&self, landing: &Landing<N>, seed: &SVector<f64, N>) -> Solution<N> {
        Solution {
            q: turns::nearest(&self.chain, &landing.q, seed),
            branch: None,
            position_error: landing.position,
            rotation_error: landing.rotation,
        }
    }

    /// Finds out why a goal was not reached.
    #[cold]
    fn report(&self, goal: &Goal, best: &Landing<N>) -> Report<N> {
        let (point, pose) = match goal {
            Goal::Pose(pose) => (pose.translation.vector.into(), Some(pose)),
            Goal::Position(point) | Goal::Axis(point, _) => (*point, None),
        };
        let finite = point.coords.iter().all(|x| x.is_finite())
            && pose.is_none_or(|pose| pose.rotation.coords.iter().all(|x| x.is_finite()));
        if !finite {
            return self.report_with(best, Obstacle::NotFinite);
        }
        // A failed search for the position alone settles that it is the distance.
        let place = self.best_of(&Goal::Position(point), 12, self.stop, &best.q);
        if !place.reached {
            return self.report_with(
                best,
                Obstacle::OutOfReach {
                    distance: place.position,
                },
            );
        }
        let free = self.best_of(
            goal,
            24,
            Stop {
                limits: false,
                ..self.stop
            },
            &best.q,
        );
        if free.reached {
            let q = turns::nearest(&self.chain, &free.q, &best.q);
            let (joint, beyond) = self.worst_joint(&q);
            if beyond > 1e-9 {
                return self.report_with(best, Obstacle::AtLimit { joint, beyond });
            }
        }
        if best.position < 1e-4 && best.rotation < 1e-4 {
            let smallest = measure::dexterity(&self.chain, &best.q).smallest;
            return self.report_with(best, Obstacle::Singular { smallest });
        }
        self.report_with(
            best,
            Obstacle::Orientation {
                angle: best.rotation,
            },
        )
    }

    fn best_of(&self, goal: &Goal, tries: u32, stop: Stop, seed: &SVector<f64, N>) -> Landing<N> {
        let target = goal.target();
        let mut best = self.descend(&target, seed, stop);
        for index in 0..tries {
            if best.reached {
                break;
            }
            let next = self.descend(&target, &numeric::restart(&self.chain, index), stop);
            if next.reached || score(&next) < score(&best) {
                best = next;
            }
        }
        best
    }

    /// The joint farthest beyond its limits, and by how much.
    fn worst_joint(&self, q: &SVector<f64, N>) -> (usize, f64) {
        let beyond = |i: usize| (q[i] - self.chain.upper()[i]).max(self.chain.lower()[i] - q[i]);
        (0..N)
            .map(|i| (i, beyond(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0))
    }

    fn report_with(&self, best: &Landing<N>, obstacle: Obstacle) -> Report<N> {
        Report {
            obstacle,
            nearest: best.q,
            nearest_pose: self.chain.forward(&best.q),
            position_error: best.position,
            rotation_error: best.rotation,
        }
    }
}

/// Distance of a landing from its goal, lengths in units of [`LENGTH`].
fn score<const N: usize>(landing: &Landing<N>) -> f64 {
    (landing.position / LENGTH).hypot(landing.rotation)
}
