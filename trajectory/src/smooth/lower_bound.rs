//! A lower bound of the time of all motions through the poses within the limits.
//!
//! With tolerance and corridor zero every pose is a stop, and the way is straight legs. Each takes the time of
//! its tightest limit; a leg without length and turn is none.
//!
//! Otherwise two bounds that hold for every motion from rest to rest, whatever its shape, within balls as
//! wide as the certificate takes them:
//!
//! - **Length.** The limits bound the speed at any time after the start and before the end, so the
//!   distance covered in a given time is bounded; the distance is at least that between some of the
//!   poses, in order, less the tolerances at both ends of each part.
//! - **Turning back.** Along any direction, the speed is zero where the motion turns back. Between
//!   two such times it covers a known distance, from rest to rest.

use nalgebra::{Isometry3, Vector3};

use super::crossing::{Crossing, RESOLUTION};
use super::options::{SmoothError, SmoothOptions};
use super::ramp::{self, Caps};
use crate::ToolLimits;
use crate::line::{Line, body_turn};
use crate::timing::least_time as rest_to_rest;

/// So many powers of two are tried as the step from one to the next of the poses that bound a length.
const STEPS: u32 = 9;

/// Largest number of legs, and of bends, whose directions are used.
const DIRECTIONS: usize = 16;

/// A lower bound (s) of the time of all motions from rest to rest through these poses, within these
/// limits and tolerances. Poses in m; the first is the start.
///
/// # Errors
/// [`SmoothError`] when a number of the input is unusable.
pub fn least_time(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<f64, SmoothError> {
    options.check(poses)?;
    Ok(lower_bound(poses, &options.finite()))
}

/// A lower bound (s) of the time of all motions from rest to rest whose orientation travels `angle`
/// (rad) within these limits.
///
/// ```
/// use trajectory::{ToolLimits, smooth::least_turning_time};
/// let limits = ToolLimits {
///     angular_speed: 2.0,
///     ..ToolLimits::UNLIMITED
/// };
/// assert!((least_turning_time(5.0, &limits) - 2.5).abs() < 1e-2);
/// ```
#[must_use]
pub fn least_turning_time(angle: f64, limits: &ToolLimits) -> f64 {
    let options = SmoothOptions::new(0.0, *limits).finite();
    shortest(angle, &angular(&options.limits))
}

/// The limits of the rotation.
fn angular(limits: &ToolLimits) -> Caps {
    Caps {
        speed: limits.angular_speed,
        acceleration: limits.angular_acceleration,
        jerk: limits.angular_jerk,
    }
}

/// The better of the bounds, s.
pub(crate) fn lower_bound(poses: &[Isometry3<f64>], options: &SmoothOptions) -> f64 {
    let limits = &options.limits;
    let linear = Caps {
        speed: limits.speed,
        acceleration: limits.acceleration,
        jerk: limits.jerk,
    };
    let angular = angular(limits);
    let way = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        (b.translation.vector - a.translation.vector).norm()
    };
    let turn = |a: &Isometry3<f64>, b: &Isometry3<f64>| body_turn(&a.rotation, &b.rotation).norm();
    if options.tolerance <= RESOLUTION && options.corridor() <= RESOLUTION {
        let leg = |pair: &[Isometry3<f64>]| {
            // Rounding of a leg that is none would take microseconds: time goes with its cube root.
            if Line::new(pair[0], pair[1]).is_still() {
                return 0.0;
            }
            rest_to_rest(way(&pair[0], &pair[1]), linear.values())
                .max(rest_to_rest(turn(&pair[0], &pair[1]), angular.values()))
        };
        return poses.windows(2).map(leg).sum();
    }
    let [place, angle] = Crossing::accepted(options.tolerance, options.angular_tolerance());
    shortest(length(poses, place, way), &linear)
        .max(shortest(length(poses, angle, turn), &angular))
        .max(turning_back(poses, place, &linear))
}

/// Least length of a path that passes the poses, by one measure of distance: the greatest sum of the distances between
/// some of them, in order, each less the tolerances at its ends. Where poses are dense, few of them bound it better than all.
fn length(
    poses: &[Isometry3<f64>],
    tolerance: f64,
    distance: impl Fn(&Isometry3<f64>, &Isometry3<f64>) -> f64,
) -> f64 {
    let last = poses.len().saturating_sub(1);
    let mut least: Vec<f64> = vec![0.0; last + 1];
    for to in 1..=last {
        let steps = (0..STEPS).map(|k| 1 << k).take_while(|step| *step <= to);
        let whole = (to == last).then_some(last);
        least[to] = steps
            .chain(whole)
            .map(|step| {
                let from = to - step;
                let slack = f64::from(u8::from(from > 0) + u8::from(to < last)) * tolerance;
                least[from] + (distance(&poses[from], &poses[to]) - slack).max(0.0)
            })
            .fold(0.0, f64::max);
    }
    least[last]
}

/// Least time for a path of a given length: the speed follows the limits from either end, up to the
/// middle.
fn shortest(length: f64, caps: &Caps) -> f64 {
    if length <= 0.0 {
        return 0.0;
    }
    // Distance from rest after a time, with acceleration as soon as possible.
    let covered = |time: f64| {
        let rise = (caps.acceleration / caps.jerk).min((2.0 * caps.speed / caps.jerk).sqrt());
        let mut state = ramp::advance([0.0; 3], time.min(rise), caps.jerk);
        let full = ((caps.speed - state[1]) / state[2].max(1e-300)).max(0.0);
        let pull = (time - rise).clamp(0.0, full);
        state = ramp::advance(state, pull, 0.0);
        state[0] + caps.speed * (time - rise - pull).max(0.0)
    };
    let (mut low, mut high) = (0.0, 1.0);
    while covered(high) < 0.5 * length && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if covered(middle) < 0.5 * length {
            low = middle;
        } else {
            high = middle;
        }
    }
    2.0 * low
}

/// The greatest bound by turning back along some directions: of the whole way, of legs, and of the bends between legs, so that
/// it is the same wherever the list is laid.
fn turning_back(poses: &[Isometry3<f64>], tolerance: f64, caps: &Caps) -> f64 {
    let place = |i: usize| poses[i].translation.vector;
    let last = poses.len().saturating_sub(1);
    let leg = |i: usize| place(i) - place(i - 1);
    let step = last.div_ceil(DIRECTIONS).max(1);
    let mut directions = vec![place(last) - place(0)];
    directions.extend((1..=last).step_by(step).map(leg));
    directions.extend((2..=last).step_by(step).map(|i| leg(i) - leg(i - 1)));
    let along = |direction: &Vector3<f64>| {
        let unit = direction.try_normalize(1e-300)?;
        let places: Vec<f64> = poses
            .iter()
            .map(|pose| pose.translation.vector.dot(&unit))
            .collect();
        Some(standing_times(&turns(&places, tolerance), tolerance, caps))
    };
    directions.iter().filter_map(along).fold(0.0, f64::max)
}

/// The places at which a motion along one axis must turn back, with its ends:
/// successive ones differ by more than both tolerances.
fn turns(places: &[f64], tolerance: f64) -> Vec<f64> {
    let (first, goal) = (places[0], places[places.len() - 1]);
    let mut turns = vec![first];
    let (mut extreme, mut sign) = (first, 0.0);
    for place in places.iter().copied() {
        if sign == 0.0 {
            if (place - first).abs() > 2.0 * tolerance {
                (extreme, sign) = (place, (place - first).signum());
            }
        } else if sign * (place - extreme) >= 0.0 {
            extreme = place;
        } else if sign * (extreme - place) > 2.0 * tolerance {
            turns.push(extreme);
            (extreme, sign) = (place, -sign);
        }
    }
    // The path from the last turn to the goal may be shorter than to the last extreme; the distance
    // to the goal is certain.
    turns.push(goal);
    turns
}

/// Sum of the least times between places at rest.
fn standing_times(turns: &[f64], tolerance: f64, caps: &Caps) -> f64 {
    if let [first, goal] = turns {
        return rest_to_rest((goal - first).abs(), caps.values());
    }
    let last = turns.len() - 1;
    (1..=last)
        .map(|i| {
            let slack = f64::from(u8::from(i > 1) + u8::from(i < last)) * tolerance;
            let way = ((turns[i] - turns[i - 1]).abs() - slack).max(0.0);
            // The acceleration may be anything where it turns back.
            if way * caps.acceleration <= caps.speed * caps.speed {
                2.0 * (way / caps.acceleration).sqrt()
            } else {
                way / caps.speed + caps.speed / caps.acceleration
            }
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bound(places: &[[f64; 2]], tolerance: f64) -> f64 {
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            ..ToolLimits::UNLIMITED
        };
        let poses: Vec<_> = places
            .iter()
            .map(|[x, y]| Isometry3::translation(*x, *y, 0.0))
            .collect();
        lower_bound(&poses, &SmoothOptions::new(tolerance, limits).finite())
    }

    /// A straight line is known exactly: 0.1/0.5 + 0.5/5 + 0.05 s.
    #[test]
    fn exact_on_a_line() {
        assert!((bound(&[[0.0, 0.0], [0.1, 0.0]], 1e-3) - 0.35).abs() < 1e-9);
        assert_eq!(bound(&[[0.0, 0.0], [0.0, 0.0]], 1e-3), 0.0);
    }

    /// With tolerance zero the legs are known, stop to stop: two of 0.35 s.
    #[test]
    fn exact_with_stops() {
        let stops = bound(&[[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]], 0.0);
        assert!((stops - 0.7).abs() < 1e-9);
    }

    /// A repeated pose adds nothing, though its orientation may differ in the last digit.
    #[test]
    fn a_repeated_pose_is_no_leg() {
        let mut limits = ToolLimits::UNLIMITED;
        (limits.speed, limits.angular_jerk) = (0.5, 150.0);
        let options = SmoothOptions::new(0.0, limits).finite();
        let [start, goal] = [0.0, 0.1].map(|x| Isometry3::translation(x, 0.0, 0.0));
        let again = Isometry3::new(goal.translation.vector, Vector3::z() * 1e-17);
        let [once, twice] =
            [&[start, goal][..], &[start, goal, again]].map(|poses| lower_bound(poses, &options));
        assert_eq!(once, twice);
    }

    /// On a circle of 360 poses the balls of all of them take 72 of 377 mm off the length; those of every sixteenth 5 mm, and
    /// their chords 2 mm. The bound is that of a line of so many mm, and the same from the other end.
    #[test]
    fn few_poses_bound_a_dense_list() {
        let at = |i: u32| f64::from(i).to_radians().sin_cos();
        let mut places: Vec<_> = (0..=360)
            .map(|i| [0.06 * at(i).1, 0.06 * at(i).0])
            .collect();
        let least = bound(&places, 1e-4);
        assert!(
            least > 0.370 / 0.5 + 0.14 && least < 0.377 / 0.5 + 0.15,
            "{least}"
        );
        places.reverse();
        assert!((bound(&places, 1e-4) - least).abs() < 1e-9);
    }

    /// Back and forth: two distances of 99 mm between times at rest.
    #[test]
    fn turning_back_takes_time() {
        let there_and_back = bound(&[[0.0, 0.0], [0.1, 0.0], [0.0, 0.0]], 1e-3);
        assert!((there_and_back - 2.0 * (0.099 / 0.5 + 0.1)).abs() < 1e-9);
        // Within the tolerance nothing has to move at all.
        assert_eq!(bound(&[[0.0, 0.0], [5e-4, 0.0], [0.0, 0.0]], 1e-3), 0.0);
    }
}
