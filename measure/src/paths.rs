//! Random paths for benchmarks and tests, the same for the same seed.

use nalgebra::SVector;
use trajectory::{JointLimits, SplinePath};

use crate::Random;

/// Random spline paths of `N` joints through waypoints within a radian of zero, with the limits
/// that the published comparisons use: 2 rad/s, 10 rad/s², 100 rad/s³.
///
/// ```
/// use measure::RandomPaths;
/// use trajectory::Path;
///
/// let paths: Vec<_> = RandomPaths::<7>::new(1, 11).take(3).collect();
/// assert_eq!(paths[2].end(), 10.0);
/// assert_eq!(paths, RandomPaths::<7>::new(1, 11).take(3).collect::<Vec<_>>());
/// ```
#[derive(Clone, Debug)]
pub struct RandomPaths<const N: usize> {
    random: Random,
    waypoints: usize,
}

impl<const N: usize> RandomPaths<N> {
    /// Paths of this many waypoints (two at least), from this seed.
    pub fn new(seed: u64, waypoints: usize) -> Self {
        Self {
            random: Random::new(seed),
            waypoints: waypoints.max(2),
        }
    }

    /// The limits that go with the paths.
    pub fn limits() -> JointLimits<N> {
        JointLimits::uniform(2.0, 10.0, 100.0)
    }
}

impl<const N: usize> Iterator for RandomPaths<N> {
    type Item = SplinePath<N>;

    fn next(&mut self) -> Option<SplinePath<N>> {
        let points: Vec<SVector<f64, N>> = (0..self.waypoints)
            .map(|_| SVector::from_fn(|_, _| self.random.between(-1.0, 1.0)))
            .collect();
        SplinePath::new(&points)
    }
}
