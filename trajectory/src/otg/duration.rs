//! The shortest duration that all joints can have.

use super::error::OtgError;
use super::joint::Joint;
use super::options::Options;

/// The shortest duration (s) that is possible for all `joints` and fits `options`.
///
/// Starts from a lower bound; every joint in turn raises it to its next possible duration, until
/// all agree. So blocked intervals are computed only where they matter.
pub(crate) fn common_duration<const N: usize>(
    joints: &[Joint],
    options: &Options<N>,
) -> Result<f64, OtgError> {
    let mut duration = whole_periods(options.minimum_duration, options.period);
    let mut joint = slowest(joints);
    let mut agreed = 0;
    for _ in 0..(joints.len() * 8 + 16) {
        let next = joints[joint].next_possible(duration);
        if !next.is_finite() {
            return Err(OtgError::OutOfRange {
                joint,
                time: duration,
            });
        }
        let rounded = whole_periods(next, options.period);
        agreed = if next <= duration {
            agreed + 1
        } else if rounded <= next {
            1
        } else {
            0
        };
        duration = rounded.max(duration);
        if agreed >= joints.len() {
            return Ok(duration);
        }
        joint = (joint + 1) % joints.len();
    }
    Err(OtgError::OutOfRange {
        joint,
        time: duration,
    })
}

fn slowest(joints: &[Joint]) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, joint) in joints.iter().enumerate() {
        let guess = joint.guess();
        if guess > best.1 {
            best = (index, guess);
        }
    }
    best.0
}

/// `duration` rounded up to whole periods; an excess that is only rounding is ignored.
fn whole_periods(duration: f64, period: Option<f64>) -> f64 {
    match period {
        Some(period) => (duration / period * (1.0 - 4.0 * f64::EPSILON)).ceil() * period,
        None => duration,
    }
}
