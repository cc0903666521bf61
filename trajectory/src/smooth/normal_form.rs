//! A list in the form in which it is planned, which is the same for a list that is laid elsewhere,
//! reversed, or written in other units.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::crossing::RESOLUTION;
use super::fade::Fade;
use super::motion::Motion;
use super::options::SmoothOptions;
use super::span::Turn;
use crate::line::body_turn;

/// Coordinates are multiples of this, in units of the list, and so are the four numbers of an
/// orientation, or of less if the tolerance is small. So the rounding of a frame or a unit is not
/// seen: it could lead a search elsewhere.
const GRID: f64 = 1.0 / 1_073_741_824.0;
/// The finest grid: that of an orientation without a tolerance, and of the goal's, which is not moved
/// by more than rounding.
const LAST: f64 = 1.0 / 17_592_186_044_416.0;
/// The grid as a share of the tolerance, at most.
const SHARE: f64 = 1e-4;
/// The grid of a goal as a share of its distance from the start, at most.
const NEAR: f64 = 1e-9;
/// Distance of both ends of a list that is rounding, in units of the list.
const ROUNDED: f64 = 1e-14;
/// Relative difference of two lengths below which they tell no direction.
const EVEN: f64 = 1e-6;
/// Limits from these on are none: speed, acceleration, jerk.
const UNLIMITED: [f64; 3] = [1e6, 1e8, 1e10];

/// A list in the frame of one of its ends, in units of its own, with the options in these units.
#[derive(Clone, Debug)]
pub(super) struct NormalForm {
    pub(super) poses: Vec<Isometry3<f64>>,
    pub(super) options: SmoothOptions,
    /// The first pose of the form as it was given.
    frame: Isometry3<f64>,
    /// Whether the form begins at the end of the list.
    pub(super) backwards: bool,
    /// Unit of length, m.
    unit: f64,
    /// From the goal of the form to the goal that was given: the way in units of the form, and the turn as a rotation
    /// vector (rad).
    missing: [Vector3<f64>; 2],
}

impl NormalForm {
    /// The form of a list under finite options; `None` without a tolerance.
    pub(super) fn new(given: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Self> {
        if options.tolerance <= RESOLUTION || options.corridor() <= RESOLUTION {
            return None;
        }
        let backwards = is_better_reversed(given, unit(options));
        Some(Self::towards(given, options, backwards))
    }

    /// The form of the same list that begins at its other end.
    pub(super) fn turned(&self, given: &[Isometry3<f64>], options: &SmoothOptions) -> Self {
        Self::towards(given, options, !self.backwards)
    }

    /// The form of more poses between the same ends, from the same end.
    pub(super) fn through(&self, given: &[Isometry3<f64>], options: &SmoothOptions) -> Self {
        Self::towards(given, options, self.backwards)
    }

    /// The form that begins at one end.
    fn towards(given: &[Isometry3<f64>], options: &SmoothOptions, backwards: bool) -> Self {
        let unit = unit(options);
        let mut poses = given.to_vec();
        if backwards {
            poses.reverse();
        }
        let frame = poses[0];
        let least = options.tolerance.min(options.corridor()) / unit;
        let (grid, turns) = (grid(least), grid(options.angular_tolerance()));
        let last = poses.len() - 1;
        for (i, pose) in poses.iter_mut().enumerate() {
            let turns = if i == last { LAST } else { turns };
            let turned = frame.inv_mul(pose);
            let place = (turned.translation.vector / unit).map(|x| on_grid(x, grid));
            let turn = turned.rotation.into_inner().coords;
            // Of the two quaternions of one orientation.
            let turn = if turn.w < 0.0 { -turn } else { turn };
            let turn = Quaternion::from_vector(turn.map(|x| on_grid(x, turns)));
            *pose = Isometry3::from_parts(place.into(), UnitQuaternion::new_normalize(turn));
        }
        let goal = if backwards { given[0] } else { given[last] };
        let missing = round_goal(&mut poses, &frame.inv_mul(&goal), unit, [grid, turns]);
        Self {
            poses,
            options: in_units(options, unit, [2.0 * grid, 2.0 * turns]),
            frame,
            backwards,
            unit,
            missing,
        }
    }

    /// A motion through the form as one through the list that was given.
    pub(super) fn place(&self, mut motion: Motion) -> Motion {
        self.meet_goal(&mut motion);
        for span in &mut motion.spans {
            for c in &mut span.point {
                *c *= self.unit;
            }
            span.place(&self.frame);
        }
        if self.backwards {
            motion.reversed()
        } else {
            motion
        }
    }

    /// Moves the goal of a motion to where it was given, and nothing else by more.
    fn meet_goal(&self, motion: &mut Motion) {
        let [way, turn] = self.missing;
        let goal = self.poses[self.poses.len() - 1].translation.vector;
        let far = way.norm() <= NEAR * goal.norm();
        let along = if far {
            goal / goal.norm_squared().max(f64::MIN_POSITIVE)
        } else {
            Vector3::zeros()
        };
        let fade = Fade::over(motion.duration());
        for span in &mut motion.spans {
            let angle = fade.since(span.start);
            for (c, share) in span.point.iter_mut().zip(angle) {
                // A map in space leaves the motion at rest at its ends; one over time does but for rounding.
                *c += way * if far { along.dot(c) } else { share };
            }
            if turn != Vector3::zeros() {
                span.turns.push(Turn { axis: turn, angle });
            }
        }
    }
}

/// Puts the goal of a form on a grid as fine as it needs; what it then misses of the `goal` that was given, in m and rad from
/// the frame: the way in units of the form, and the turn as a rotation vector (rad).
fn round_goal(
    poses: &mut [Isometry3<f64>],
    goal: &Isometry3<f64>,
    unit: f64,
    [grid, turns]: [f64; 2],
) -> [Vector3<f64>; 2] {
    let last = poses.len() - 1;
    let place = goal.translation.vector / unit;
    // A list that closes has the same place at both ends, but for rounding.
    let far = place.norm() > ROUNDED;
    let grid = finer(grid, NEAR * place.norm());
    let end = if far {
        place.map(|x| on_grid(x, grid))
    } else {
        Vector3::zeros()
    };
    let way = if far { place - end } else { Vector3::zeros() };
    poses[last].translation.vector = end;
    // A list that does not turn ends in the orientation of its start, but for what an arm is off there.
    let identity = UnitQuaternion::identity();
    let still = poses[..last].iter().all(|pose| pose.rotation == identity);
    let turn = goal.rotation.scaled_axis();
    let slight = still && turn.norm() <= turns;
    if slight {
        poses[last].rotation = identity;
    }
    [way, if slight { turn } else { Vector3::zeros() }]
}

/// The unit of length, m: the way in a second at the first of the limits that there is.
fn unit(options: &SmoothOptions) -> f64 {
    let limits = &options.limits;
    let all = [limits.speed, limits.acceleration, limits.jerk];
    let limited = all
        .iter()
        .zip(UNLIMITED)
        .find(|(limit, none)| **limit < *none);
    limited.map_or(1.0, |(limit, _)| *limit)
}

/// Spacing of the grid for a tolerance in units of the list: a power of two.
fn grid(tolerance: f64) -> f64 {
    finer(GRID, SHARE * tolerance)
}

/// The spacing, or the largest power of two below it that is at most `most`, if there is one.
fn finer(grid: f64, most: f64) -> f64 {
    let mut grid = grid;
    while grid > most && grid > LAST {
        grid *= 0.5;
    }
    grid
}

fn on_grid(x: f64, grid: f64) -> f64 {
    (x / grid).round() * grid
}

/// A number without its last twelve digits (binary), in which the rounding of a unit is.
fn rounded(x: f64) -> f64 {
    f64::from_bits((x.to_bits() + (1 << 11)) & !0xfff)
}

/// The options in another unit of length (m), the tolerances smaller by `margins` (units, rad).
fn in_units(options: &SmoothOptions, unit: f64, margins: [f64; 2]) -> SmoothOptions {
    let [margin, turn] = margins;
    let mut scaled = options.clone();
    let limits = &mut scaled.limits;
    for (limit, none) in [
        (&mut limits.speed, UNLIMITED[0]),
        (&mut limits.acceleration, UNLIMITED[1]),
        (&mut limits.jerk, UNLIMITED[2]),
    ] {
        if *limit < none {
            *limit = rounded(*limit / unit);
        }
    }
    scaled.angular_tolerance = Some(rounded((options.angular_tolerance() - turn).max(0.0)));
    scaled.corridor = Some(rounded(options.corridor() / unit - margin));
    scaled.tolerance = rounded(options.tolerance / unit - margin);
    scaled
}

/// Whether the list is the other one of the two that are the same way there and back: seen from
/// both ends, the first two legs that differ decide, or the first distances over two legs. The
/// shorter one is first.
fn is_better_reversed(poses: &[Isometry3<f64>], unit: f64) -> bool {
    let last = poses.len() - 1;
    let size = |i: usize, j: usize| {
        let way = (poses[j].translation.vector - poses[i].translation.vector).norm();
        way / unit + body_turn(&poses[i].rotation, &poses[j].rotation).norm()
    };
    for step in 1..=2 {
        let pairs = (0..last.saturating_sub(step - 1))
            .map(|i| [size(i, i + step), size(last - i - step, last - i)]);
        let mut apart = pairs.filter(|[a, b]| (a - b).abs() > EVEN * (a + b));
        if let Some([first, other]) = apart.next() {
            return first > other;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;

    fn options(scale: f64) -> SmoothOptions {
        let limits = ToolLimits {
            speed: 0.5 * scale,
            acceleration: 5.0 * scale,
            jerk: 100.0 * scale,
            ..ToolLimits::UNLIMITED
        };
        let mut options = SmoothOptions::new(1e-4 * scale, limits);
        options.angular_tolerance = Some(0.002);
        options.finite()
    }

    /// A list that is laid elsewhere, reversed and in other units has the same form, to the last
    /// digit.
    #[test]
    fn the_form_of_a_list_is_one() {
        let at = |i: i32| {
            let x = f64::from(i);
            Isometry3::new(
                Vector3::new(0.011 * x, 0.3 * (0.2 * x).sin(), 0.01 * x * x),
                Vector3::new(0.0, 0.02 * x, 0.1),
            )
        };
        let poses: Vec<_> = (0..20).map(at).collect();
        let form = NormalForm::new(&poses, &options(1.0)).unwrap();
        let frame = Isometry3::new(Vector3::new(0.3, -0.9, 0.1), Vector3::new(1.0, 0.4, -2.0));
        let inches = |pose: &Isometry3<f64>| {
            let pose = frame * pose;
            Isometry3::from_parts((pose.translation.vector / 0.0254).into(), pose.rotation)
        };
        let other: Vec<_> = poses.iter().rev().map(inches).collect();
        let other = NormalForm::new(&other, &options(1.0 / 0.0254)).unwrap();
        assert_eq!(form.poses, other.poses);
        assert_eq!(form.options, other.options);
        assert_ne!(form.backwards, other.backwards);
    }
}
