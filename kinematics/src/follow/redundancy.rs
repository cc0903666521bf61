//! The null-space motion of arms with more than six joints: chosen over the whole path.

use super::ease::ease_along;
use super::error::{FollowCause, FollowError};
use super::null_space::{NullSpace, SHAPES};
use super::null_space_path;
use super::price::{Price, both_ways};
use super::spare_model;
use super::trace::Task;
use super::{Cost, FollowOptions, FollowPoint};
use crate::ik::IkFailure;
use nalgebra::{SMatrix, SVector};

/// A joint path and its null-space motion.
pub(super) type Resolved<const N: usize> = (Vec<FollowPoint<N>>, NullSpace<N>);

/// Follows without null-space motion if the quality is good, otherwise along the polynomial that a
/// search over the whole path finds.
pub(super) fn resolve<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
) -> Result<Resolved<N>, FollowError> {
    let still = resting_from(task, start);
    let first = task.trace(start, &still);
    let ease = first
        .as_ref()
        .map_or(f64::NEG_INFINITY, |points| ease_along(task, points));
    // A path cannot be expected to be better than its start.
    let answer = first.map(|points| (points, still.clone()));
    if ease >= 1.0 || is_beyond(&answer) {
        return answer;
    }
    // No null-space motion leads to an end that no joint position reaches.
    let end = answer.as_ref().err().and(task.grid.last());
    match end.and_then(|u| task.unreachable(*u, start)) {
        // Which limit is passed most on the path says more.
        Some(error) if is_limit(&error) => return answer,
        // A search that ended at a singular pose may have ended too early.
        Some(error) if !is_singular(&error) => return Err(error),
        _ => {}
    }
    for (found, moving) in judged(task, start, null_space_path::search(task, start, &still)) {
        if found <= ease {
            break;
        }
        if let Ok(points) = task.trace(start, &moving) {
            return Ok((points, moving));
        }
    }
    answer
}

/// Whether a path leads to a pose that the arm reaches with no joint position: no null-space motion helps.
fn is_beyond<P>(traced: &Result<P, FollowError>) -> bool {
    let cause = traced.as_ref().err().map(|error| error.cause);
    matches!(cause, Some(FollowCause::Unreachable(_)))
}

/// Whether a pose is not reached because a limit is in the way.
fn is_limit(error: &FollowError) -> bool {
    matches!(
        error.cause,
        FollowCause::Unreachable(IkFailure::AtLimit { .. })
    )
}

/// Whether the search for a pose ended near it, at a singular pose.
fn is_singular(error: &FollowError) -> bool {
    matches!(
        error.cause,
        FollowCause::Unreachable(IkFailure::Singular { .. })
    )
}

/// Null-space motions with the quality of their paths at a few places, the best first; those after a good one, and those
/// that lead nowhere, are left out.
fn judged<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    motions: Vec<NullSpace<N>>,
) -> Vec<(f64, NullSpace<N>)> {
    let places = Coarse::new(task, JUDGED);
    let coarse = places.of(task);
    let mut found: Vec<(f64, NullSpace<N>)> = Vec::new();
    for moving in motions {
        let Ok(points) = coarse.trace(start, &moving) else {
            continue;
        };
        let ease = ease_along(&coarse, &points).min(1.0);
        found.push((ease, moving));
        if ease >= 1.0 {
            break;
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found
}

/// A few places of a path, and how closely it is followed there to be judged.
pub(super) struct Coarse {
    grid: Vec<f64>,
    options: FollowOptions,
}

impl Coarse {
    /// One place for so many points, but no fewer than the second number.
    pub(super) fn new<const N: usize>(task: &Task<'_, N>, [every, fewest]: [usize; 2]) -> Self {
        let last = task.grid.len() - 1;
        let steps = (last / every).clamp(fewest, MOST).min(last);
        Self {
            grid: (0..=steps).map(|k| task.grid[k * last / steps]).collect(),
            options: FollowOptions {
                accuracy: COARSE,
                ..*task.options
            },
        }
    }

    /// The path at these places.
    pub(super) fn of<'a, const N: usize>(&'a self, task: &Task<'a, N>) -> Task<'a, N> {
        Task {
            grid: &self.grid,
            options: &self.options,
            ..*task
        }
    }
}

/// Sizes that are tried of each shape, one after the other, rad.
const SIZES: [f64; 4] = [0.4, 0.2, 0.1, 0.05];
/// Sizes that are tried of each part of a change along the path, with the first cost and with others, rad.
const PART_SIZES: [f64; 5] = [0.3, 0.15, 0.07, 0.035, 0.017];
const FINE_SIZES: [f64; 3] = [0.1, 0.04, 0.016];
/// What is added to the coefficient of a joint in the measure, one after the other.
const TILTS: [f64; 2] = [0.5, 0.2];
/// Least share of the cost that a round of steps has to save for a round of smaller ones.
const GAIN: f64 = 1e-3;
/// Points of the path for each step along it in which a motion is judged, and fewest steps.
const JUDGED: [usize; 2] = [4, 24];
/// Most such steps, and how far from the path the joints may be between two of them, m.
const MOST: usize = 64;
const COARSE: f64 = 1e-3;
/// Least share of the cost that another motion has to save.
pub(super) const WORTH: f64 = 0.01;

/// The null-space motion that costs least, from `start`, among those that stay as far from limits and
/// singular poses as the first without one, if it saves something. It is searched in three steps: the
/// function of the joints that stays constant, how its value changes over the path, and how it changes
/// along parts of it. Each of the costs after the first is searched along parts from what was found before.
/// The search may miss the best.
pub(super) fn cheapest<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    costs: &[&Cost<'_, N>],
) -> Option<NullSpace<N>> {
    let (cost, last) = (*costs.first()?, costs.last()?);
    let places = Coarse::new(task, JUDGED);
    let coarse = places.of(task);
    let still = resting_from(task, start);
    let first = coarse.trace(start, &still).ok()?;
    let ease = ease_along(&coarse, &first).min(1.0);
    let price = Price {
        coarse: &coarse,
        start,
        ease,
        cost,
    };
    let none = cost(&first);
    let begin = Search {
        price,
        best: still,
        least: none,
    };
    // The first step may lead away from what the second one finds alone.
    let (mut alone, mut after) = (begin.clone(), begin);
    alone.shape();
    after.measure(start, task);
    if after.least < none {
        after.shape();
    }
    let begun = [(alone.best, alone.least), (after.best, after.least)];
    let (best, least) = along_parts(price, &costs[1..], begun)?;
    (least < last(&first) * (1.0 - WORTH)).then_some(best)
}

/// The best of motions whose costs are known, after searches along parts of the path with that cost, then with the others; and the last
/// cost of it.
fn along_parts<const N: usize>(
    price: Price<'_, N>,
    others: &[&Cost<'_, N>],
    begun: [(NullSpace<N>, f64); 2],
) -> Option<(NullSpace<N>, f64)> {
    let cheapest = |motions: [(NullSpace<N>, f64); 2]| {
        let [one, other] = motions;
        if other.1 < one.1 { other } else { one }
    };
    // With two spare joints there would be two functions.
    if N != 7 {
        return Some(cheapest(begun));
    }
    let begun =
        begun.map(|known| spare_model::cheaper(&price, &known.0, &PART_SIZES).unwrap_or(known));
    let mut found = cheapest(begun);
    for cost in others {
        let price = Price {
            cost: *cost,
            ..price
        };
        found = spare_model::cheaper(&price, &found.0, &FINE_SIZES)?;
    }
    Some(found)
}

/// A search of the null-space motion that costs least.
#[derive(Clone)]
struct Search<'a, const N: usize> {
    price: Price<'a, N>,
    best: NullSpace<N>,
    least: f64,
}

impl<const N: usize> Search<'_, N> {
    /// Searches the function of the joints that is constant.
    fn measure(&mut self, start: &SVector<f64, N>, task: &Task<'_, N>) {
        for tilt in TILTS {
            let before = self.least;
            for joint in 0..N {
                let unit = SVector::<f64, N>::from_fn(|j, _| if j == joint { tilt } else { 0.0 });
                self.along(|from, sign| {
                    let mut directions = from.directions;
                    directions[0] = (directions[0] + unit * sign).normalize();
                    resting(task, start, &directions)
                });
            }
            if self.least >= before * (1.0 - GAIN) {
                return;
            }
        }
    }

    /// Searches how its value changes.
    fn shape(&mut self) {
        for (round, size) in SIZES.into_iter().enumerate() {
            let before = self.least;
            for shape in SHAPES {
                self.along(|from, sign| {
                    let mut other = from.clone();
                    other.add_shape(&shape, sign * size);
                    other
                });
            }
            if round > 0 && self.least >= before * (1.0 - GAIN) {
                return;
            }
        }
    }

    /// Takes steps in one direction, or against it, while they save something.
    fn along(&mut self, step: impl Fn(&NullSpace<N>, f64) -> NullSpace<N>) {
        both_ways(|sign| {
            let other = step(&self.best, sign);
            let cost = self.price.below(self.least, &other);
            if let Some(cost) = cost {
                (self.best, self.least) = (other, cost);
            }
            cost.is_some()
        });
    }
}

/// No null-space motion, measured along the directions in which the arm can move at the start.
fn resting_from<const N: usize>(task: &Task<'_, N>, start: &SVector<f64, N>) -> NullSpace<N> {
    let (_, jacobian) = task.solver.chain().jacobian(start);
    resting(task, start, &null_space(&jacobian))
}

/// No null-space motion, measured along directions.
fn resting<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    directions: &[SVector<f64, N>; 2],
) -> NullSpace<N> {
    let (from, to) = (task.grid[0], task.grid[task.grid.len() - 1]);
    NullSpace {
        directions: *directions,
        polynomials: directions.map(|direction| [direction.dot(start), 0.0, 0.0, 0.0, 0.0, 0.0]),
        from,
        span: to - from,
        still_ends: task.options.still_ends,
        spline: None,
        course: None,
    }
}

/// Directions in which the joints can move without moving the tool: `N - 6` of them,
/// at right angles to each other and to the rows of the Jacobian.
pub(super) fn null_space<const N: usize>(jacobian: &SMatrix<f64, 6, N>) -> [SVector<f64, N>; 2] {
    let mut basis: Vec<SVector<f64, N>> = Vec::new();
    let mut reduce = |mut v: SVector<f64, N>, keep: bool| {
        // Twice: the second pass removes the rounding of the first.
        for _ in 0..2 {
            for b in &basis {
                v -= b * b.dot(&v);
            }
        }
        let length = v.norm();
        if keep && length > 1e-9 {
            basis.push(v / length);
        }
        (v, length)
    };
    for i in 0..6 {
        reduce(jacobian.row(i).transpose(), true);
    }
    std::array::from_fn(|k| {
        if k + 6 >= N {
            return SVector::zeros();
        }
        let unit = |i: usize| SVector::from_fn(|row, _| if row == i { 1.0 } else { 0.0 });
        let longest = (0..N)
            .max_by(|a, b| {
                reduce(unit(*a), false)
                    .1
                    .total_cmp(&reduce(unit(*b), false).1)
            })
            .unwrap_or(0);
        let (v, length) = reduce(unit(longest), true);
        v / length.max(1e-300)
    })
}
