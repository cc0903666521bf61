//! Random problems from a seed, for benchmarks and tests.

use crate::Random;
use nalgebra::SVector;
use trajectory::otg::{Limits, Options, Problem, State};

/// Which ends of a random problem move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Start and target both move, most of the time.
    Moving,
    /// The start moves, the target is at rest.
    Stopping,
    /// Start and target are at rest.
    Resting,
}

/// An endless sequence of random problems; the same seed gives the same sequence.
///
/// The distribution is the one of Ruckig's own benchmark: positions normal with deviation 4,
/// velocities and accelerations normal with deviation 0.8 or zero, limits even from 0.1 to 12
/// above what the target needs. Starts may break limits.
///
/// ```
/// use measure::{Ends, Problems};
/// use trajectory::otg::Otg;
///
/// let problem = Problems::new(7, Ends::Moving).draw::<6>();
/// let motion = Otg::plan(&problem.start, &problem.target, &problem.limits, &problem.options)?;
/// assert!(motion.duration() > 0.0);
/// # Ok::<(), trajectory::otg::OtgError>(())
/// ```
///
/// # Source
/// L. Berscheid, T. Kröger, "Jerk-limited Real-time Trajectory Generation with Arbitrary Target
/// States", RSS 2021, and the benchmark published with it.
#[derive(Clone, Debug)]
pub struct Problems {
    random: Random,
    ends: Ends,
}

impl Problems {
    /// The sequence of `seed`.
    pub fn new(seed: u64, ends: Ends) -> Self {
        Self {
            random: Random::scattered(seed),
            ends,
        }
    }

    /// The next problem whose target can be reached at all.
    pub fn draw<const N: usize>(&mut self) -> Problem<N> {
        loop {
            let problem = self.any();
            if problem.check().is_ok() {
                return problem;
            }
        }
    }

    fn any<const N: usize>(&mut self) -> Problem<N> {
        let moving = self.ends == Ends::Moving;
        let started = self.ends != Ends::Resting;
        let start: State<N> = State {
            position: self.normal_vector(4.0, 1.0),
            velocity: self.normal_vector(0.8, if started { 0.9 } else { 0.0 }),
            acceleration: self.normal_vector(0.8, if started { 0.8 } else { 0.0 }),
        };
        let target: State<N> = State {
            position: self.normal_vector(4.0, 1.0),
            velocity: self.normal_vector(0.8, if moving { 0.7 } else { 0.0 }),
            acceleration: self.normal_vector(0.8, if moving { 0.6 } else { 0.0 }),
        };
        let limits = Limits::symmetric(
            self.limit_vector() + target.velocity.abs(),
            self.limit_vector() + target.acceleration.abs(),
            self.limit_vector(),
        );
        Problem {
            start,
            target,
            limits,
            options: Options::default(),
        }
    }

    fn limit_vector<const N: usize>(&mut self) -> SVector<f64, N> {
        SVector::from_fn(|_, _| self.between(0.1, 12.0))
    }

    fn normal_vector<const N: usize>(&mut self, deviation: f64, share: f64) -> SVector<f64, N> {
        SVector::from_fn(|_, _| {
            if self.between(0.0, 1.0) < share {
                deviation * self.normal()
            } else {
                0.0
            }
        })
    }

    /// An even number from `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.between(low, high)
    }

    /// A normal number of deviation 1.
    pub fn normal(&mut self) -> f64 {
        self.random.normal()
    }
}
