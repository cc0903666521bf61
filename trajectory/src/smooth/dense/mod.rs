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
mod list;
mod marks;
mod moved;
mod open;
mod part;
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
use list::List;
pub use part::FittedPart;
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
/// is missing or a list cannot be fitted. Where a fit fails the list is divided: as often as needed if it may be
/// `divided`, else a few times. The options are finite.
pub(super) fn plan(
    given: &[Isometry3<f64>],
    options: &SmoothOptions,
    divided: bool,
) -> Option<Motion> {
    if !is_limited(options) {
        return None;
    }
    let poses = moved(given);
    if poses.len() < FEWEST {
        return None;
    }
    if !poses.windows(2).any(TURNING) {
        sections::<3>(&poses, options, divided)
    } else if options.angular_tolerance() > 1e3 * RESOLUTION {
        sections::<7>(&poses, options, divided)
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

/// Whether the tolerance shows the corner at each pose of a list that does not turn: its curve is not nearly known.
pub(super) fn shows_corners(given: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    let poses = moved(given);
    let points = Units::new(options).points::<3>(&poses);
    !poses.windows(2).any(TURNING) && Chords::new(&points).shows_corners(&points)
}

/// Whether a list needs no other way of planning: it is long, and dense all along. Straight legs with few
/// poses on them count as one leg each.
pub(super) fn suffices(given: &[Isometry3<f64>], options: &SmoothOptions) -> bool {
    are_dense(&List::of(&moved(given)), options).is_some()
}

/// The same of poses without repeats: the number of straight legs if so. Nothing is kept of them, as a list may be
/// long.
fn are_dense(poses: &List<'_>, options: &SmoothOptions) -> Option<usize> {
    let (units, origin) = (Units::new(options), poses.at(0).translation.vector);
    let point = |i: usize| {
        SVector::<f64, 3>::from((poses.at(i).translation.vector - origin) / units.length)
    };
    let even = |a: usize, b: usize| leg(&[*poses.at(a), *poses.at(b)], options) <= LONGEST * LEG;
    let last = poses.len() - 1;
    let legs = Chords::leg_ends(&point, last).count();
    let dense = if poses.len() > SPLIT * (legs + 1) {
        poses.len() > BOTH && (0..last).all(|i| even(i, i + 1))
    } else {
        let mut from = 0;
        let mut leg_ends = Chords::leg_ends(&point, last);
        legs + 1 > BOTH && leg_ends.all(|to| even(std::mem::replace(&mut from, to), to))
    };
    dense.then_some(legs)
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
    match moved_list(&List::of(given)) {
        Some(poses) => Cow::Owned(poses),
        None => Cow::Borrowed(given),
    }
}

/// The same of a list; `None` where nothing changes.
fn moved_list(given: &List<'_>) -> Option<Vec<Isometry3<f64>>> {
    let stays = |[from, to]: [&Isometry3<f64>; 2]| {
        let turn = body_turn(&from.rotation, &to.rotation);
        Line::new(*from, *to).is_still() || parts(&turn) > 1
    };
    if !given.legs().any(stays) {
        return None;
    }
    let mut poses = vec![*given.at(0)];
    for [_, pose] in given.legs() {
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
    Some(poses)
}

/// Straight lines of quaternions that stand for a turn.
fn parts(turn: &Vector3<f64>) -> usize {
    (turn.norm() / TURN).ceil().max(1.0) as usize
}

/// The motion through all sections between places where the way turns back, and between seams.
fn sections<const D: usize>(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    divided: bool,
) -> Option<Motion> {
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
        let section = Section::<D>::new(&poses[from..=to], options, (units, divided));
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
