//! Which limit decides the speed of a move, and when.

use nalgebra::SVector;
use serde::Serialize;
use trajectory::{JointLimits, ToolLimits, Trajectory};

use super::certificate::ToolSample;

/// A limit used to this share is active.
const ACTIVE: f64 = 0.98;

/// A stretch of the move over which one limit decides the speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActiveLimit {
    /// Name of the limit: `tool speed`, `velocity of elbow`, ...
    pub limit: String,
    /// From when after the start of the move, s.
    pub start_s: f64,
    /// Until when, s.
    pub end_s: f64,
}

/// The stretches over which limits are used to 98 % or more, in the order of
/// time, as seen in samples of the move.
pub(super) fn active<const N: usize>(
    trajectory: &Trajectory<N>,
    samples: &[ToolSample],
    (joints, limits): (&JointLimits<N>, &ToolLimits),
    names: &[String],
) -> Vec<ActiveLimit> {
    let states: Vec<_> = samples.iter().map(|s| trajectory.sample(s.time)).collect();
    let mut found = Vec::new();
    let mut add = |name: String, ratio: &dyn Fn(usize) -> f64| {
        stretches(samples, ratio, |start_s, end_s| {
            found.push(ActiveLimit {
                limit: name.clone(),
                start_s,
                end_s,
            });
        });
    };
    add("tool speed".into(), &|i| samples[i].speed / limits.speed);
    add("tool acceleration".into(), &|i| {
        samples[i].acceleration / limits.acceleration
    });
    add("angular speed".into(), &|i| {
        samples[i].angular_speed / limits.angular_speed
    });
    add("angular acceleration".into(), &|i| {
        samples[i].angular_acceleration / limits.angular_acceleration
    });
    let jerk = |i: usize| -> SVector<f64, N> {
        let Some(next) = samples.get(i + 1) else {
            return SVector::zeros();
        };
        let change = states[i + 1].acceleration - states[i].acceleration;
        change / (next.time - samples[i].time).max(1e-9)
    };
    for j in 0..N {
        let name = names
            .get(j)
            .cloned()
            .unwrap_or_else(|| format!("{}", j + 1));
        add(format!("velocity of {name}"), &|i| {
            states[i].velocity[j].abs() / joints.velocity[j]
        });
        add(format!("acceleration of {name}"), &|i| {
            states[i].acceleration[j].abs() / joints.acceleration[j]
        });
        add(format!("jerk of {name}"), &|i| {
            jerk(i)[j].abs() / joints.jerk[j]
        });
    }
    found.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    found
}

/// Calls `give` with the start and end of each run of samples with a high ratio.
fn stretches(samples: &[ToolSample], ratio: &dyn Fn(usize) -> f64, mut give: impl FnMut(f64, f64)) {
    let mut since = None;
    for (i, sample) in samples.iter().enumerate() {
        let high = ratio(i) >= ACTIVE;
        match since {
            None if high => since = Some(sample.time),
            Some(start) if !high => {
                give(start, sample.time);
                since = None;
            }
            _ => {}
        }
    }
    if let (Some(start), Some(last)) = (since, samples.last()) {
        give(start, last.time);
    }
}
