//! The least time along a straight line, as a lower bound for any path between the same ends.

use super::grid::Bounded;
use super::{Boundary, TimingOptions};

/// The least time (s) from rest to rest over a distance under a velocity, acceleration and jerk
/// limit, in consistent units; infinite limits have no effect.
///
/// ```
/// let time = trajectory::timing::least_time(1.0, [2.0, 10.0, 100.0]);
/// assert!((time - 0.8).abs() < 1e-12);
/// ```
///
/// # Source
/// Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section
/// 3.4 (double S), for zero velocities at both ends.
#[must_use]
pub fn least_time(distance: f64, [v, a, j]: [f64; 3]) -> f64 {
    let (v, a, j) = (v.min(1e100), a.min(1e50), j.min(1e60));
    let short = (32.0 * distance / j).cbrt();
    if v * j < a * a {
        let rise = 2.0 * (v / j).sqrt();
        return if distance >= v * rise {
            distance / v + rise
        } else {
            short
        };
    }
    let (rise, ramp) = (v / a + a / j, a / j);
    if distance >= v * rise {
        distance / v + rise
    } else if distance >= 2.0 * a * ramp * ramp {
        ramp + (ramp * ramp + 4.0 * distance / a).sqrt()
    } else {
        short
    }
}

/// The least time of any motion from rest to rest between the ends of the path: the largest of
/// those of each joint and of the tool along its chord. 0 for a moving start.
pub(super) fn chord_bound<const N: usize>(bounded: Bounded<'_, N>) -> f64 {
    let TimingOptions { start, .. } = bounded.options;
    if matches!(start, Boundary::Moving { .. }) {
        return 0.0;
    }
    let (first, last) = (bounded.path.at(0.0), bounded.path.at(bounded.path.end()));
    let step = last.joint.q[0] - first.joint.q[0];
    let limits = bounded.joint;
    let mut most = 0.0_f64;
    for i in 0..N {
        let all = [limits.velocity[i], limits.acceleration[i], limits.jerk[i]];
        most = most.max(least_time(step[i].abs(), all));
    }
    let tool = bounded.tool;
    let chord = last.tool.pose.translation.vector - first.tool.pose.translation.vector;
    most.max(least_time(
        chord.norm(),
        [tool.speed, tool.acceleration, tool.jerk],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_durations() {
        let limits = [2.0, 10.0, 100.0];
        assert!((least_time(1.0, limits) - 0.8).abs() < 1e-12);
        assert!((least_time(0.4, limits) - (0.1 + 0.17_f64.sqrt())).abs() < 1e-12);
        assert!((least_time(1e-3, limits) - (32e-5_f64).cbrt()).abs() < 1e-12);
        assert!((least_time(1.0, [2.0, f64::INFINITY, f64::INFINITY]) - 0.5).abs() < 1e-9);
        assert!((least_time(1.0, [1e9, 4.0, f64::INFINITY]) - 1.0).abs() < 1e-9);
    }
}
