//! A curve fitted through a long dense list, for callers that make its time law themselves, part by
//! part.

use std::ops::Range;

use nalgebra::{Isometry3, Vector3};

use super::chords::Chords;
use super::curve::{Curve, SEEN};
use super::fit::{Fit, Orientation};
use super::list::List;
use super::marks::Marks;
use super::moved::Moved;
use super::open::{AIM, Recipe};
use super::places::Units;
use super::profile::Profile;
use super::section::{DENSITIES, FIT_KNOTS, ORIENTATIONS, scaled};
use super::time_parameter::TimeParameter;
use super::{TURNING, are_dense, is_limited};
use crate::line::body_turn;
use crate::smooth::options::SmoothOptions;

/// An angle (rad) by which an arm may be off where it rests, and the share of the angular tolerance that this may be: a list
/// that turns by no more is fitted as one that does not turn.
const OFF: f64 = 1e-9;
const OFF_SHARE: f64 = 0.01;

/// Most knots of a curve over time, in those of the first fit: there is no other to compare it with.
const MOST_KNOTS: f64 = 2.0;

/// A smooth curve from the first pose of a long dense list to the last, without times: it passes all
/// poses between them in order within 0.98 of the tolerances, and stays within 0.98 of the corridor.
///
/// The curve is not kept, as a list may be long: four bytes for each pose say how it is made. A part of it at hand
/// (`FittedPart`) makes it, part by part, from the poses, to the last bit the same each time, and checks it.
#[derive(Clone, Debug)]
pub struct FittedCurve {
    pub(super) start: Isometry3<f64>,
    /// The poses without repeats, where the list has some.
    pub(super) moved: Option<Moved>,
    pub(super) recipe: Recipe,
    pub(super) turning: bool,
    /// Half width of the corridor, in balls.
    pub(super) corridor: f64,
    exact_stop: f64,
}

impl FittedCurve {
    /// The curves from `start` through a list that are worth a try, one after the other: each may turn out to miss
    /// a pose where it is made (`FittedPart::check`), then the next is one with more knots. None where another
    /// way of planning may be better or is needed: a list that is short or not dense all along, a way that
    /// turns back, a tolerance that shows each corner.
    ///
    /// ```
    /// use nalgebra::Isometry3;
    /// use trajectory::{ToolLimits, smooth::{FittedCurve, FittedPart, SmoothOptions}};
    /// let limits = ToolLimits { speed: 0.5, acceleration: 5.0, jerk: 100.0, ..ToolLimits::UNLIMITED };
    /// let at = |i: i32| 0.002 * f64::from(i);
    /// let poses: Vec<_> = (0..500)
    ///     .map(|i| Isometry3::translation(0.1 * at(i).cos(), 0.1 * at(i).sin(), 0.0))
    ///     .collect();
    /// let options = SmoothOptions::new(1e-4, limits);
    /// let curve = FittedCurve::all(&poses[0], &poses[1..], &options).next().unwrap();
    /// let mut part = FittedPart::begin(&curve, &poses[1..]).unwrap();
    /// assert!(part.cover(&curve, &poses[1..], curve.end()) && part.check());
    /// let passed = part.tool(part.passes(&curve, 99)[0]).pose;
    /// let missed = passed.translation.vector - poses[100].translation.vector;
    /// assert!(missed.norm() < 1e-4);
    /// ```
    pub fn all<'a>(
        start: &'a Isometry3<f64>,
        poses: &'a [Isometry3<f64>],
        options: &SmoothOptions,
    ) -> impl Iterator<Item = Self> + use<'a> {
        let mut trials = Trials::new(List::new(start, poses), options);
        std::iter::from_fn(move || trials.as_mut()?.next())
    }

    /// Last value of its parameter, which has no meaning.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.recipe.marks.spans() as f64
    }

    /// Number of the last of the knots that a time law sees; the first is 0.
    #[must_use]
    pub fn last_knot(&self) -> usize {
        self.recipe.marks.spans().div_ceil(SEEN)
    }

    /// Parameter at a knot.
    #[must_use]
    pub fn knot(&self, index: usize) -> f64 {
        (index * SEEN).min(self.recipe.marks.spans()) as f64
    }

    /// Time the motion would take with a stop at each pose, s.
    #[must_use]
    pub fn exact_stop(&self) -> f64 {
        self.exact_stop
    }

    /// The poses that are fitted.
    pub(super) fn list<'a>(&'a self, poses: &'a [Isometry3<f64>]) -> List<'a> {
        match &self.moved {
            Some(moved) => List::of(&moved.poses),
            None => List::new(&self.start, poses),
        }
    }
}

/// Why a curve cannot be made.
enum Unfit {
    /// A fit fails.
    Fit,
    /// The way is none for one curve.
    Way,
}

/// The curves that are tried for a list.
struct Trials<'a> {
    given: List<'a>,
    moved: Option<Moved>,
    options: SmoothOptions,
    units: Units,
    turning: bool,
    slight: Vector3<f64>,
    /// Straight legs of the list.
    legs: usize,
    next: usize,
}

impl<'a> Trials<'a> {
    fn new(given: List<'a>, options: &SmoothOptions) -> Option<Self> {
        given.check(options).ok()?;
        let options = options.finite();
        if !is_limited(&options) {
            return None;
        }
        let moved = Moved::new(&given);
        let list = moved.as_ref().map_or(given, |moved| List::of(&moved.poses));
        let legs = are_dense(&list, &options)?;
        let slight = slight_turn(&list, &options);
        let turning = slight.is_none() && list.legs().any(|leg| TURNING(&leg.map(|pose| *pose)));
        Some(Self {
            given,
            units: Units::new(&options),
            options,
            turning,
            slight: slight.unwrap_or_default(),
            legs,
            next: 0,
            moved,
        })
    }

    fn next(&mut self) -> Option<FittedCurve> {
        let ways = ORIENTATIONS.map(|way| DENSITIES.map(|density| (density, way)));
        let ways = ways.as_flattened();
        let ways = &ways[..if self.turning {
            ways.len()
        } else {
            DENSITIES.len()
        }];
        while self.next < 2 * ways.len() {
            let (way, timed) = (ways[self.next / 2], self.next.is_multiple_of(2));
            self.next += 1;
            let marks = if self.turning {
                self.marks::<7>(way, timed)
            } else {
                self.marks::<3>(way, timed)
            };
            match marks {
                Ok(marks) => return Some(self.curve(marks, way.1)),
                Err(Unfit::Way) => self.next = 2 * ways.len(),
                // Then no curve of so many knots.
                Err(Unfit::Fit) => self.next += usize::from(timed),
            }
        }
        None
    }

    fn curve(&self, marks: Marks, orientation: Orientation) -> FittedCurve {
        FittedCurve {
            start: *self.given.at(0),
            moved: self.moved.clone(),
            recipe: Recipe {
                marks,
                units: self.units,
                orientation,
                slight: self.slight,
            },
            turning: self.turning,
            corridor: self.options.corridor() / self.units.length,
            exact_stop: self.given.exact_stop(&self.options.limits),
        }
    }

    /// Parameters with so many times the knots: over about the time of a first fit, or over its chords.
    fn marks<const D: usize>(
        &self,
        (density, way): (f64, Orientation),
        timed: bool,
    ) -> Result<Marks, Unfit> {
        let list = self
            .moved
            .as_ref()
            .map_or(self.given, |moved| List::of(&moved.poses));
        let mut count = 0;
        let of = |poses: &[Isometry3<f64>], own: Range<usize>| {
            let points = self.units.points::<D>(poses);
            let chords = Chords::new(&points);
            if !chords.turning_points(&points).is_empty() {
                return Err(Unfit::Way);
            }
            count += chords.corners.iter().filter(|i| own.contains(i)).count();
            let parameters = scaled(&chords.parameters(&points), density);
            if !timed {
                return Ok(parameters);
            }
            let fit = Fit::in_blocks((&points, &parameters), (AIM, way)).ok_or(Unfit::Fit)?;
            drop((points, parameters));
            Ok(self.over_time(fit, &poses[0], density))
        };
        let marks = Marks::new(&list, &self.options, of)?;
        // The tolerance of a list that does not turn may show its corners.
        if D == 3 && Chords::show_corners(self.legs, count) {
            return Err(Unfit::Way);
        }
        Ok(marks)
    }

    /// Parameters over the time that a curve takes: one over these bends less where it is fast.
    fn over_time<const D: usize>(
        &self,
        fit: Fit<D>,
        start: &Isometry3<f64>,
        density: f64,
    ) -> Vec<f64> {
        let mut curve = Curve::new(fit, self.units, start);
        let mut parameters = std::mem::take(&mut curve.fit.parameters);
        let limits = &self.options.limits;
        let profile = Profile::new(&curve, limits);
        let timed = (|time| profile.parameter(time), profile.duration());
        let ramp = limits.acceleration / limits.jerk;
        let knots = [density * FIT_KNOTS, MOST_KNOTS];
        TimeParameter::new(&curve, timed, ramp, knots).change(&mut parameters);
        parameters
    }
}

/// The turn (rotation vector, rad, axes of the first pose) from the first pose to the last of a list in which no pose is
/// turned from the first by more than an arm may be off there.
fn slight_turn(list: &List<'_>, options: &SmoothOptions) -> Option<Vector3<f64>> {
    let most = OFF.min(OFF_SHARE * options.angular_tolerance());
    let turn = |pose: &Isometry3<f64>| body_turn(&list.at(0).rotation, &pose.rotation);
    let still = list.iter().all(|pose| turn(pose).norm() <= most);
    still.then(|| turn(list.last()))
}
