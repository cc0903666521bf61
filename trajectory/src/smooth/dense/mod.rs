//! Lists that are dense in poses: the curve is nearly known, so it is fitted first and then timed.
//!
//! A curve of least change of curvature is laid through the balls, in time linear in the list; the
//! path timing finds its fastest law under the limits of the tool; the curve is fitted again over
//! that time, which makes it faster; curve and law together become spans, which are certified as
//! those of any smooth motion. Where the way turns back the motion rests, and where a fit fails the
//! list is divided at the pose that it misses most.
//!
//! All this happens in the normal form of the list, so a list that is laid elsewhere or reversed has
//! the same motion.

mod basis;
mod blocks;
mod chords;
mod curve;
mod fit;
mod fitted;
mod fitting;
mod places;
mod profile;
mod section;
mod spans;
mod targets;
mod time_parameter;

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};

use super::crossing::RESOLUTION;
use super::motion::Motion;
use super::options::SmoothOptions;
use super::rest::RestCause;
use crate::line::{Line, body_turn};
use chords::Chords;
pub use fitted::FittedCurve;
use places::Units;
use section::Section;
pub(super) use spans::spans_along;

/// Longest turn from one pose to the next that a straight line of quaternions stands for, rad.
const TURN: f64 = 0.1;
/// Fewest poses of a dense list.
const FEWEST: usize = 16;
/// A list is dense when most of its legs take less than this share of the braking time.
const LEG: f64 = 1.0 / 16.0;
/// A leg longer than so many short ones makes a list one of mixed density.
const LONGEST: f64 = 4.0;
/// Least share of the time that the turns take which the change of place takes, both at full speed.
const PLACE: f64 = 0.1;
/// Most ramps of the acceleration for each pose, in the time at full speed.
const MOST_RAMPS: f64 = 4.0;
/// Straight legs with so many poses on each, in the mean, are dense and not split.
const SPLIT: usize = 4;
/// Way (balls) over which a corner is seen between a long leg and dense poses, and the cosine of its turn at most.
const SEEN: f64 = 8.0;
const CORNER: f64 = 0.85;
/// Dense lists up to this length are planned in both ways.
const BOTH: usize = 64;

/// A motion from rest in the first pose to rest in the last along fitted curves; `None` where a limit
/// is missing or a list cannot be fitted. The options are finite.
pub(super) fn plan(given: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Motion> {
    if !is_limited(options) {
        return None;
    }
    let poses = moved(given);
    if poses.len() < FEWEST {
        return None;
    }
    if !poses.windows(2).any(TURNING) {
        sections::<3>(&poses, options)
    } else if options.angular_tolerance() > 1e3 * RESOLUTION {
        sections::<7>(&poses, options)
    } else {
        None
    }
}

/// Whether the orientation changes from one pose to the next.
const TURNING: fn(&[Isometry3<f64>]) -> bool =
    |pair| body_turn(&pair[0].rotation, &pair[1].rotation).norm() > RESOLUTION;

/// Whether a time law has limits, and a fit some room.
pub(super) fn is_limited(options: &SmoothOptions) -> bool {
    let limits = &options.limits;
    let limited = limits.speed < 1e6 && limits.acceleration < 1e8 && limits.jerk < 1e10;
    limited && options.tolerance > RESOLUTION && options.corridor() > RESOLUTION
}

/// Whether most legs are short beside the way of braking.
pub(super) fn is_dense(given: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    let poses = moved(given);
    let short = |pair: &&[Isometry3<f64>]| leg(pair, options) <= LEG;
    poses.len() >= FEWEST && 2 * poses.windows(2).filter(short).count() > poses.len()
}

/// Whether a list needs no other way of planning: it is long, and dense all along. Straight legs with few
/// poses on them count as one leg each.
pub(super) fn suffices(given: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    are_dense(&moved(given), options)
}

/// The same of poses without repeats.
fn are_dense(poses: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    let points = Units::new(options).points::<3>(poses);
    let corners = Chords::legs(&points).corners;
    let even = |pair: &[Isometry3<f64>]| leg(pair, options) <= LONGEST * LEG;
    if poses.len() > SPLIT * corners.len() {
        return poses.len() > BOTH && poses.windows(2).all(even);
    }
    let ends: Vec<_> = corners.iter().map(|i| poses[*i]).collect();
    ends.len() > BOTH && ends.windows(2).all(even)
}

/// Whether a list that is not dense may be fitted: the place changes along most of the way, as a curve
/// through turns on the spot has no direction, and the ramps of the acceleration are not so short that
/// the motion would have many more spans than the list has poses.
pub(super) fn may_be_fitted(poses: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    let limits = &options.limits;
    let (mut way, mut turn) = (0.0, 0.0);
    for pair in poses.windows(2) {
        way += (pair[1].translation.vector - pair[0].translation.vector).norm();
        turn += body_turn(&pair[0].rotation, &pair[1].rotation).norm();
    }
    let (ramp, time) = (limits.acceleration / limits.jerk, way / limits.speed);
    time > PLACE * turn / limits.angular_speed && time < MOST_RAMPS * ramp * poses.len() as f64
}

/// Time of a leg at full speed over the braking time.
fn leg(pair: &[Isometry3<f64>], options: &SmoothOptions) -> f64 {
    let limits = &options.limits;
    let brake = limits.speed / limits.acceleration + limits.acceleration / limits.jerk;
    let way = (pair[1].translation.vector - pair[0].translation.vector).norm();
    let turn = body_turn(&pair[0].rotation, &pair[1].rotation).norm();
    (way / limits.speed).max(turn / limits.angular_speed) / brake
}

/// The poses without repeats, and with more of them where the tool turns far.
fn moved(given: &[Isometry3<f64>]) -> Cow<'_, [Isometry3<f64>]> {
    let stays = |pair: &[Isometry3<f64>]| {
        let turn = body_turn(&pair[0].rotation, &pair[1].rotation);
        Line::new(pair[0], pair[1]).is_still() || parts(&turn) > 1
    };
    if !given.windows(2).any(stays) {
        return Cow::Borrowed(given);
    }
    let mut poses = vec![given[0]];
    for pose in &given[1..] {
        let from = poses[poses.len() - 1];
        if Line::new(from, *pose).is_still() {
            continue;
        }
        let turn = body_turn(&from.rotation, &pose.rotation);
        let way = pose.translation.vector - from.translation.vector;
        let parts = parts(&turn);
        for part in 1..parts {
            let share = part as f64 / parts as f64;
            let place = from.translation.vector + way * share;
            let rotation = from.rotation * UnitQuaternion::from_scaled_axis(turn * share);
            poses.push(Isometry3::from_parts(place.into(), rotation));
        }
        poses.push(*pose);
    }
    Cow::Owned(poses)
}

/// Straight lines of quaternions that stand for a turn.
fn parts(turn: &Vector3<f64>) -> usize {
    (turn.norm() / TURN).ceil().max(1.0) as usize
}

/// The motion through all sections between places where the way turns back, and between seams.
fn sections<const D: usize>(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Motion> {
    let units = Units::new(options);
    let points = units.points::<D>(poses);
    let turning = Chords::new(&points).turning_points(&points);
    let seams = seams(poses, &points, options);
    let mut ends: Vec<_> = turning.iter().chain(&seams).copied().collect();
    ends.push(poses.len() - 1);
    ends.sort_unstable();
    ends.dedup();
    let mut motion = Motion::default();
    let mut from = 0;
    for to in ends {
        let cause = if seams.contains(&from) {
            RestCause::Division
        } else {
            RestCause::TurnsBack
        };
        let section = Section::<D>::new(&poses[from..=to], options, units);
        motion.append(section.motion()?, cause);
        from = to;
    }
    Some(motion)
}

/// Where a long leg and dense poses meet at a corner that the tolerance shows. One curve through both would bend far beyond
/// the corner.
fn seams<const D: usize>(
    poses: &[Isometry3<f64>],
    points: &[SVector<f64, D>],
    options: &SmoothOptions,
) -> Vec<usize> {
    let long = |leg: usize| self::leg(&poses[leg..leg + 2], options) > LONGEST * LEG;
    let place = |i: usize| Vector3::new(points[i][0], points[i][1], points[i][2]);
    let is_seam = |i: &usize| {
        let i = *i;
        let [before, after] = [long(i - 1), long(i)];
        if before == after {
            return false;
        }
        let far = |k: &usize| (place(*k) - place(i)).norm() >= SEEN;
        let back = (0..i).rev().find(far);
        let on = (i + 1..poses.len()).find(far);
        back.zip(on).is_some_and(|(back, on)| {
            let (come, go) = (place(i) - place(back), place(on) - place(i));
            come.normalize().dot(&go.normalize()) < CORNER
        })
    };
    (1..poses.len() - 1).filter(is_seam).collect()
}
