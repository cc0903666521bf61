//! How far an arm reaches, for display and messages.

use crate::chain::Chain;
use crate::ik::Restarts;
use crate::measure;
use nalgebra::{Point3, Vector3};

/// Reach of an arm, sampled evenly over its joint ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachMap {
    /// Largest distance of the tool from the origin of the map, m.
    pub farthest: f64,
    /// Smallest such distance, m.
    pub nearest: f64,
    /// Corner of the box around all tool positions, lowest coordinates, m.
    pub low: Point3<f64>,
    /// Opposite corner, m.
    pub high: Point3<f64>,
    /// Median of the smallest singular value over the samples.
    pub typical_smallest: f64,
    /// Fraction of samples (0 to 1) in each shell of equal thickness from distance 0 to
    /// [`ReachMap::farthest`].
    pub shells: [f64; 10],
}

/// Samples the reach of an arm about a point, such as its shoulder, in the frame of
/// the chain's poses.
///
/// ```
/// # let text = include_str!("../../robots/irb120/robot.urdf");
/// let arm = kinematics::urdf::read(text, None)?.chain::<6>()?;
/// let map = kinematics::reach::map(&arm, &nalgebra::Point3::new(0.0, 0.0, 0.29), 2000);
/// assert!(map.farthest > 0.6 && map.farthest < 0.66);
/// # Ok::<(), kinematics::UrdfError>(())
/// ```
#[must_use]
pub fn map<const N: usize>(chain: &Chain<N>, origin: &Point3<f64>, samples: u32) -> ReachMap {
    let (mut low, mut high) = (
        Vector3::repeat(f64::INFINITY),
        Vector3::repeat(f64::NEG_INFINITY),
    );
    let (mut distances, mut smallest) = (Vec::new(), Vec::new());
    let places = Restarts::new(chain);
    for index in 0..samples.max(1) {
        let q = places.at(index);
        let point = chain.forward(&q).translation.vector;
        (low, high) = (low.inf(&point), high.sup(&point));
        distances.push((point - origin.coords).norm());
        smallest.push(measure::dexterity(chain, &q).smallest);
    }
    smallest.sort_unstable_by(f64::total_cmp);
    let farthest = distances.iter().copied().fold(0.0, f64::max);
    let mut shells = [0.0; 10];
    for distance in &distances {
        let shell = (distance / farthest.max(f64::MIN_POSITIVE) * 10.0) as usize;
        shells[shell.min(9)] += 1.0 / distances.len() as f64;
    }
    ReachMap {
        farthest,
        nearest: distances.iter().copied().fold(f64::INFINITY, f64::min),
        low: Point3::from(low),
        high: Point3::from(high),
        typical_smallest: smallest[smallest.len() / 2],
        shells,
    }
}
