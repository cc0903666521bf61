//! Checks before and after planning.

use super::error::OtgError;
use super::joint::Joint;
use super::limits::Limits;
use super::motion::{Motion, Track};
use super::options::{Interface, Options};
use super::state::State;

/// Relative excess over a limit that is rounding.
const ROUNDING: f64 = 1e-12;

/// Checks every number that planning uses.
pub(crate) fn input<const N: usize>(
    start: &State<N>,
    target: &State<N>,
    limits: &Limits<N>,
    options: &Options<N>,
) -> Result<(), OtgError> {
    for joint in 0..N {
        if options.enabled[joint] {
            states(joint, start, target, options.interface[joint])?;
            bounds(joint, limits)?;
            reachable(joint, target, limits, options.interface[joint])?;
        }
    }
    let wait = options.minimum_duration;
    if !(wait.is_finite() && wait >= 0.0) {
        let expected = "finite and not negative";
        return Err(OtgError::BadOption {
            option: "minimum duration",
            expected,
            value: wait,
        });
    }
    match options.period {
        Some(value) if !(value.is_finite() && value > 0.0) => Err(OtgError::BadOption {
            option: "period",
            expected: "finite and positive",
            value,
        }),
        _ => Ok(()),
    }
}

fn states<const N: usize>(
    joint: usize,
    start: &State<N>,
    target: &State<N>,
    interface: Interface,
) -> Result<(), OtgError> {
    let numbers = [
        ("start position", start.position[joint]),
        ("start velocity", start.velocity[joint]),
        ("start acceleration", start.acceleration[joint]),
        ("target velocity", target.velocity[joint]),
        ("target acceleration", target.acceleration[joint]),
        ("target position", target.position[joint]),
    ];
    let count = if interface == Interface::Position {
        6
    } else {
        5
    };
    for (quantity, value) in numbers.into_iter().take(count) {
        if !value.is_finite() {
            return Err(OtgError::NotFinite {
                joint,
                quantity,
                value,
            });
        }
    }
    Ok(())
}

fn bounds<const N: usize>(joint: usize, limits: &Limits<N>) -> Result<(), OtgError> {
    let bad = |quantity, expected, value| {
        Err(OtgError::BadLimit {
            joint,
            quantity,
            expected,
            value,
        })
    };
    let acceleration = limits.acceleration_max[joint];
    if !(acceleration > 0.0 && acceleration.is_finite()) {
        return bad("upper acceleration", "positive and finite", acceleration);
    }
    let deceleration = limits.acceleration_min[joint];
    if !(deceleration < 0.0 && deceleration.is_finite()) {
        return bad("lower acceleration", "negative and finite", deceleration);
    }
    let (jerk, fast, slow) = (
        limits.jerk[joint],
        limits.velocity_max[joint],
        limits.velocity_min[joint],
    );
    if jerk.is_nan() || jerk <= 0.0 {
        return bad("jerk", "positive", jerk);
    }
    if fast.is_nan() || fast <= 0.0 {
        return bad("upper velocity", "positive", fast);
    }
    if slow.is_nan() || slow >= 0.0 {
        return bad("lower velocity", "negative", slow);
    }
    let (upper, lower) = (limits.position_max[joint], limits.position_min[joint]);
    if upper.is_nan() {
        return bad("upper position", "a number", upper);
    }
    if lower.is_nan() || lower > upper {
        return bad("lower position", "at most the upper one", lower);
    }
    Ok(())
}

/// The target must be inside the limits, and so must the motion just before and after it.
fn reachable<const N: usize>(
    joint: usize,
    target: &State<N>,
    limits: &Limits<N>,
    interface: Interface,
) -> Result<(), OtgError> {
    let beyond = |quantity, value, limit| {
        Err(OtgError::TargetBeyondLimit {
            joint,
            quantity,
            value,
            limit,
        })
    };
    let outside = |value: f64, low: f64, high: f64| {
        let room = ROUNDING * value.abs();
        if value > high + room {
            Some(high)
        } else if value < low - room {
            Some(low)
        } else {
            None
        }
    };
    let jerk = limits.jerk[joint];
    let a = target.acceleration[joint];
    if jerk.is_finite()
        && let Some(limit) = outside(
            a,
            limits.acceleration_min[joint],
            limits.acceleration_max[joint],
        )
    {
        return beyond("acceleration", a, limit);
    }
    if interface == Interface::Velocity {
        return Ok(());
    }
    let v = target.velocity[joint];
    let (slow, fast) = (limits.velocity_min[joint], limits.velocity_max[joint]);
    if let Some(limit) = outside(v, slow, fast) {
        return beyond("velocity", v, limit);
    }
    // A target that is slowing down has been faster.
    let before = v - 0.5 * a * a.abs() / jerk;
    if jerk.is_finite()
        && let Some(limit) = outside(before, slow, fast)
    {
        return beyond("velocity just before the target", before, limit);
    }
    let p = target.position[joint];
    match outside(p, limits.position_min[joint], limits.position_max[joint]) {
        Some(limit) => beyond("position", p, limit),
        None => Ok(()),
    }
}

/// The whole move must stay inside the position limits, which are widened to contain the start. A
/// joint that would leave them gets the direct profile of the same duration, made from its problem
/// in `joints` (none for a move along a straight line, which is not changed).
pub(crate) fn keep_positions<const N: usize>(
    motion: &mut Motion<N>,
    joints: &[Joint],
    limits: &Limits<N>,
    options: &Options<N>,
) -> Result<(), OtgError> {
    for joint in 0..N {
        let (lower, upper) = (limits.position_min[joint], limits.position_max[joint]);
        let bounded = lower.is_finite() || upper.is_finite();
        if !bounded || !options.enabled[joint] || options.interface[joint] != Interface::Position {
            continue;
        }
        let track = &mut motion.tracks[joint];
        let Some((value, limit)) = beyond(track, lower, upper) else {
            continue;
        };
        let mut other = *track;
        let blended_profile = joints
            .get(joint)
            .and_then(|j| j.direct_profile(track.duration));
        match blended_profile {
            Some(blended_profile) => other.blended_profile = blended_profile,
            None => {
                return Err(OtgError::PositionLimit {
                    joint,
                    value,
                    limit,
                });
            }
        }
        match beyond(&other, lower, upper) {
            None => *track = other,
            Some((value, limit)) => {
                return Err(OtgError::PositionLimit {
                    joint,
                    value,
                    limit,
                });
            }
        }
    }
    Ok(())
}

/// The position farthest beyond a limit, and that limit.
fn beyond(track: &Track, lower: f64, upper: f64) -> Option<(f64, f64)> {
    let (low, high) = track.extent();
    let room = ROUNDING * (low.abs() + high.abs());
    if high > upper.max(track.start[0]) + room {
        return Some((high, upper));
    }
    (low < lower.min(track.start[0]) - room).then_some((low, lower))
}
