//! The interior point iteration. It may stop at any time: every iterate after the first feasible
//! one is a valid motion.

use super::aimed::{AIMING, Aims, aim};
use super::anchor::{is_held_by_ends, is_let_go};
use super::begin::begin;
use super::bounds::Bounds;
use super::effort::Effort;
use super::line_search::Known;
use super::newton::{Step, System};
use super::pace::{Pace, ROUGHLY};
use super::problem::{Point, Problem};

/// Steps shortened to this fraction, this many times in a row, mean that the iterate is stuck
/// between constraints far from its centre: the weight is then lowered, once.
const SHORT: f64 = 0.1;
const STUCK: usize = 4;

/// More steps for a start in motion that a first iterate does not keep up with.
const ANCHORED: usize = 40;

/// Improves an iterate to the optimum within `effort`; the number of steps, or
/// `None` when no feasible iterate was found. Where the motion of an iterate sees the poses turned otherwise than its
/// rotation vectors say, `aims` tells it, and the vertices follow on the way.
///
/// # Source
/// S. Boyd, L. Vandenberghe, "Convex Optimization", 2004, 11.3 (barrier method); the bounds of an
/// infeasible iterate are widened to contain it, and narrowed as it moves inwards.
pub(crate) fn solve<const D: usize, const B: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
    effort: Effort,
    aims: Option<Aims<'_, D>>,
) -> Option<usize> {
    let mut system = System::<D, B>::new(point);
    let mut iteration = Iteration::begin(problem, point, effort);
    let more = usize::from(iteration.problem.anchor.is_some()) * ANCHORED;
    let most = iteration.pace.steps + more;
    for count in 0..most {
        iteration.narrow();
        // An iterate that is inside goes on until it is as fast as its start.
        if !iteration.bounds.tight && count >= effort.search {
            return None;
        }
        let done = iteration.is_done();
        let room = &iteration.bounds.room;
        let step = system.step(iteration.problem, iteration.point, room, iteration.weight);
        let Some(step) = step else {
            return done.then_some(count);
        };
        let moved = iteration.take(&step);
        let centred = step.decrement < iteration.centre(done);
        let looks = done && (!moved || centred || (count + 1).is_multiple_of(AIMING));
        let missed = iteration.aim(&mut system, aims.filter(|_| looks));
        if moved && !centred {
            continue;
        }
        if done && iteration.is_too_slow() {
            return None;
        }
        if iteration.is_at_its_end() {
            let turned = moved && missed > iteration.effort.aimed;
            if turned || !done && iteration.goes_on_past_ends() {
                continue;
            }
            return done.then_some(count);
        }
        if !iteration.begin_next_centre(moved, step.decrement) {
            return None;
        }
    }
    iteration.is_done().then_some(most)
}

/// An iterate on its way to the optimum.
struct Iteration<'a, const D: usize> {
    problem: &'a mut Problem<D>,
    point: &'a mut Point<D>,
    effort: Effort,
    pace: Pace,
    bounds: Bounds,
    known: Known,
    slow: Slow,
    /// Parameter of the barrier.
    parameter: f64,
    /// Weight on `z`.
    weight: f64,
}

impl<'a, const D: usize> Iteration<'a, D> {
    fn begin(problem: &'a mut Problem<D>, point: &'a mut Point<D>, effort: Effort) -> Self {
        let pace = Pace::new(problem, effort);
        begin(problem, point, effort);
        let bounds = Bounds::around(problem, point);
        let parameter = problem.parameter(point);
        Self {
            weight: parameter / (2.0 * point.z),
            known: Known::nothing(&bounds.room),
            slow: Slow::default(),
            problem,
            point,
            effort,
            pace,
            bounds,
            parameter,
        }
    }

    /// The weight with which an iterate begins.
    fn first_weight(&self) -> f64 {
        self.parameter / (2.0 * self.point.z)
    }

    /// Whether the iterate is a valid motion.
    fn is_done(&self) -> bool {
        self.bounds.tight && self.problem.anchor.is_none()
    }

    /// Narrows the bounds where it is time for that, and lets go an iterate that is as fast as its start.
    fn narrow(&mut self) {
        self.bounds.narrow(self.problem, self.point);
        if self.bounds.tight && is_let_go(self.problem, self.point) {
            self.known.forget();
            if self.problem.finish.is_some() {
                self.weight = self.first_weight();
            }
        }
    }

    /// Square of the Newton decrement that is near enough to a centre, for an iterate that is `done` or not.
    fn centre(&self, done: bool) -> f64 {
        if !done {
            ROUGHLY
        } else if self.is_at_its_end() {
            self.pace.last
        } else {
            self.pace.centre
        }
    }

    /// Goes along a step as far as it helps; false where it does not.
    fn take(&mut self, step: &Step) -> bool {
        let barrier = &self
            .pace
            .barrier(self.problem, &self.bounds.room, self.weight);
        let share = self
            .known
            .search(barrier, self.point, step, self.pace.rounds);
        // At the end there is nothing to come back to.
        let ends = self.is_at_its_end() && step.decrement < self.pace.last;
        let short = self.bounds.tight && share < SHORT && step.decrement < self.pace.low && !ends;
        if self.slow.is_new(short) {
            self.weight = self.weight.min(self.first_weight());
        }
        share > 0.0
    }

    /// [`aim`].
    fn aim<const B: usize>(&mut self, system: &mut System<D, B>, aims: Option<Aims<'_, D>>) -> f64 {
        let seen = (system, &self.bounds.room, &mut self.known);
        aim(self.problem, self.point, seen, aims)
    }

    /// Whether the optimum is above the longest useful time.
    fn is_too_slow(&self) -> bool {
        let least = (self.point.z - self.parameter / self.weight).max(0.0);
        self.point.spans() as f64 * self.problem.spacing(least) > self.effort.most
    }

    /// Whether the iterate is so near to its optimum as is wanted.
    fn is_at_its_end(&self) -> bool {
        self.bounds.tight && self.parameter / self.weight <= self.effort.gap * self.point.z
    }

    /// Lets go an iterate that only its ends hold, where that is wanted.
    fn goes_on_past_ends(&mut self) -> bool {
        if !self.effort.onward || !is_held_by_ends(self.problem, self.point) {
            return false;
        }
        self.weight = self.first_weight();
        self.known = Known::nothing(&self.bounds.room);
        // Where it keeps the bounds as it is they need not be widened.
        let barrier = self
            .pace
            .barrier(self.problem, &self.bounds.room, self.weight);
        if barrier.look(self.point, &[]).is_none() {
            self.bounds = Bounds::around(self.problem, self.point);
        }
        true
    }

    /// Raises the weight, or has widened bounds narrowed next; false where the iterate is stuck.
    fn begin_next_centre(&mut self, moved: bool, decrement: f64) -> bool {
        if self.bounds.tight {
            let last = 1.01 * self.parameter / (self.effort.gap * self.point.z);
            self.weight = (self.weight * self.pace.growth).min(last);
        } else if self.bounds.are_new() && !moved {
            return false;
        } else if decrement < self.pace.near || !moved {
            self.bounds.narrow_next();
        }
        true
    }
}

/// Counts short steps one after another.
#[derive(Default)]
struct Slow {
    steps: usize,
    told: bool,
}

impl Slow {
    /// Whether the descent has become slow, told once.
    fn is_new(&mut self, short: bool) -> bool {
        self.steps = if short { self.steps + 1 } else { 0 };
        let new = self.steps == STUCK && !self.told;
        self.told |= new;
        new
    }
}
