//! Random moves of a robot: how long planning takes, and how long the motions last.
//!
//! A move starts at random joint positions and ends at a random pose that the arm can reach.

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};
use planner::motion::Planner;
use planner::robot::{Robot, RobotError};
use planner::task::{Move, Shape};
use planner::with_dof;

use crate::Random;

/// One planned move.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanningTime {
    /// How long planning took, in the caller's clock, s.
    pub planning: f64,
    /// How long the motion lasts, s; `None` for a move that was refused.
    pub motion: Option<f64>,
}

/// Random moves of one shape, the same for the same seed.
#[derive(Clone, Copy, Debug)]
pub struct RandomMoves {
    /// Shape of the path.
    pub shape: Shape,
    /// How many.
    pub count: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The clock that planning is measured with (s); the processor time of the thread, for a
    /// measure that other processes do not change.
    pub clock: fn() -> f64,
}

/// Joints start within this distance of zero, rad: a range of several turns would make most moves
/// turns of the last joint.
const HALF_TURN: f64 = std::f64::consts::PI;
/// Distance of joints from their limits, rad or m.
const MARGIN: f64 = 0.05;
/// Largest distance (m) along each axis and turn (rad) about each from one pose of a curve to the
/// next.
const NEAR: (f64, f64) = (0.15, 0.4);
/// Poses of a smooth move.
const POSES: usize = 5;
/// Radius of the ball round each intermediate pose of a smooth move, m.
const TOLERANCE: f64 = 0.01;

impl RandomMoves {
    /// Plans the moves with the flange of `robot` as the controlled point.
    ///
    /// # Errors
    /// [`RobotError`] when the robot cannot be planned for.
    ///
    /// ```
    /// use planner::task::Shape;
    /// let moves = measure::RandomMoves { shape: Shape::Joint, count: 3, seed: 1, clock: || 0.0 };
    /// let times = moves.measure(&planner::robot::load("ur5e")?)?;
    /// assert!(times.iter().all(|time| time.motion.is_some_and(|seconds| seconds > 0.0)));
    /// # Ok::<(), planner::robot::RobotError>(())
    /// ```
    pub fn measure(&self, robot: &Robot) -> Result<Vec<PlanningTime>, RobotError> {
        with_dof!(robot.dof(), N => self.measure_with::<N>(robot))
    }

    fn measure_with<const N: usize>(&self, robot: &Robot) -> Result<Vec<PlanningTime>, RobotError> {
        let planner = robot.planner::<N>()?;
        let mut random = Random::scattered(self.seed);
        let mut times = Vec::with_capacity(self.count);
        for _ in 0..self.count {
            let start = joints(&planner, &mut random);
            let motion = Move {
                shape: self.shape,
                poses: self.poses(&planner, &start, &mut random),
                tolerance: TOLERANCE,
                limits: robot.motion_limits(),
            };
            let since = (self.clock)();
            let planned = planner.plan(&motion, &start);
            times.push(PlanningTime {
                planning: (self.clock)() - since,
                motion: planned.ok().map(|planned| planned.trajectory.duration()),
            });
        }
        Ok(times)
    }

    fn poses<const N: usize>(
        &self,
        planner: &Planner<N>,
        start: &SVector<f64, N>,
        random: &mut Random,
    ) -> Vec<Isometry3<f64>> {
        let mut pose = planner.chain().forward(start);
        let count = match self.shape {
            Shape::Joint => return vec![planner.chain().forward(&joints(planner, random))],
            Shape::Straight => 1,
            Shape::Smooth => POSES,
        };
        let mut next = || {
            pose.translation.vector += vector(random, NEAR.0);
            pose.rotation *= UnitQuaternion::from_scaled_axis(vector(random, NEAR.1));
            pose
        };
        (0..count).map(|_| next()).collect()
    }
}

/// Random joint positions within the limits.
fn joints<const N: usize>(planner: &Planner<N>, random: &mut Random) -> SVector<f64, N> {
    let (lower, upper) = (planner.chain().lower(), planner.chain().upper());
    SVector::from_fn(|i, _| {
        let (low, high) = (lower[i].max(-HALF_TURN), upper[i].min(HALF_TURN));
        random.between(low + MARGIN, high - MARGIN)
    })
}

fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.between(-size, size))
}
