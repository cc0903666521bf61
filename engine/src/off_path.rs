//! How far an arm was off the path that was published.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::session::RunSample;

/// Number of published points that the measured one is compared with: the arm is behind by less.
const BEHIND: usize = 100;

/// The largest distance of the measured controlled point from the path that was published shortly
/// before: off the path, not behind on it.
///
/// ```
/// use engine::off_path::OffPath;
/// use nalgebra::vector;
///
/// let mut off_path = OffPath::default();
/// off_path.compare(vector![0.0, 0.0, 0.0], vector![0.0, 0.0, 0.0]);
/// off_path.compare(vector![1.0, 0.0, 0.0], vector![0.5, 0.002, 0.0]);
/// assert_eq!(off_path.largest(), 0.002); // behind by half the way, off it by 2 mm
/// ```
#[derive(Clone, Debug, Default)]
pub struct OffPath {
    path: VecDeque<Vector3<f64>>,
    largest: f64,
}

impl OffPath {
    /// Takes the sample of the next period.
    pub fn take(&mut self, sample: &RunSample) {
        self.compare(
            sample.workstation_from_tool.translation.vector,
            sample.measured_pose.translation.vector,
        );
    }

    /// Takes the next published point and the point that was measured in the same period (m).
    pub fn compare(&mut self, published: Vector3<f64>, measured: Vector3<f64>) {
        self.path.push_back(published);
        if self.path.len() > BEHIND {
            self.path.pop_front();
        }
        let legs = self.path.iter().zip(self.path.iter().skip(1));
        let nearest = legs
            .map(|(from, to)| from_segment(&measured, from, to))
            .fold(f64::INFINITY, f64::min);
        if nearest.is_finite() {
            self.largest = self.largest.max(nearest);
        }
    }

    /// The largest distance so far (m).
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.largest
    }
}

/// Distance of a point from the segment between two others.
fn from_segment(point: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let way = to - from;
    let squared = way.norm_squared();
    let part = if squared > 0.0 {
        ((point - from).dot(&way) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (from + way * part - point).norm()
}
