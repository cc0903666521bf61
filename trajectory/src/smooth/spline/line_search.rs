//! How far a step is gone.

use super::barrier::{Barrier, Seen};
use super::newton::Step;
use super::problem::{Point, Problem, Room, spreading};
use super::project::project;

/// Back-tracking factor of the line search.
const BACK: f64 = 0.6;

/// What is known of the barrier at the iterate, under these bounds.
pub(super) struct Known {
    room: Room,
    seen: Option<Seen>,
}

impl Known {
    pub(super) fn nothing(room: &Room) -> Self {
        let room = room.clone();
        Self { room, seen: None }
    }

    /// Forgets what was seen: the iterate is another.
    pub(super) fn forget(&mut self) {
        self.seen = None;
    }

    /// Keeps what is seen under these bounds.
    pub(super) fn keep(&mut self, room: &Room, seen: Seen) {
        self.room = room.clone();
        self.seen = Some(seen);
    }

    /// [`search`] from the iterate that is known, unless a bound has changed.
    pub(super) fn search<const D: usize>(
        &mut self,
        barrier: &Barrier<'_, D>,
        point: &mut Point<D>,
        step: &Step,
        rounds: usize,
    ) -> f64 {
        if self.room != *barrier.room {
            (self.room, self.seen) = (barrier.room.clone(), None);
        }
        let (share, seen) = search(barrier, point, (step, self.seen.take()), rounds);
        self.seen = seen;
        share
    }
}

/// Moves the iterate along the step as far as the barrier falls; returns the fraction of the step,
/// 0 if it does not fall at all, and the barrier there. With the step what is known of the barrier here.
fn search<const D: usize>(
    barrier: &Barrier<'_, D>,
    point: &mut Point<D>,
    (step, known): (&Step, Option<Seen>),
    rounds: usize,
) -> (f64, Option<Seen>) {
    let problem = barrier.problem;
    let Some(seen) = known.or_else(|| barrier.look(point, &[])) else {
        return (0.0, None);
    };
    let here = barrier.value(point, &seen);
    let mut share: f64 = if step.z < 0.0 {
        (-0.9 * point.z / step.z).min(1.0)
    } else {
        1.0
    };
    let mut trial = point.clone();
    for _ in 0..40 {
        go(problem, (point, &mut trial), (step, share));
        // Most trials that are too long break a limit, and to find their passes costs more than to see that.
        let there = if barrier.is_limited(&trial, &seen.slacks) {
            project(problem, &mut trial, Some(barrier.room), rounds);
            barrier.look(&trial, &seen.slacks)
        } else {
            None
        };
        if let Some(there) = there
            && barrier.value(&trial, &there) < here - 0.01 * share * step.decrement
        {
            *point = trial;
            return (share, Some(there));
        }
        share *= BACK;
    }
    (0.0, Some(seen))
}

/// Moves a trial to where a share of a step leads from an iterate.
pub(super) fn go<const D: usize>(
    problem: &Problem<D>,
    (point, trial): (&Point<D>, &mut Point<D>),
    (step, share): (&Step, f64),
) {
    trial.z = point.z + share * step.z;
    let free = trial.control.iter_mut().zip(&point.control).skip(4);
    for ((to, from), delta) in free.zip(step.control.chunks_exact(D)) {
        for d in 0..D {
            to[d] = from[d] + share * delta[d];
        }
    }
    follow(problem, trial, point.z);
    problem.pin(trial);
    trial.end_spare();
    trial.crossings.copy_from_slice(&point.crossings);
    let times = trial.crossings.iter_mut().zip(&step.times);
    for (time, change) in times.filter(|_| Problem::<D>::TURNS) {
        *time += share * change;
    }
}

/// Lets the free control points follow those that two ends in motion fix, which do not move evenly with `z`:
/// to second order they spread like the knots, and the others with them.
pub(super) fn follow<const D: usize>(problem: &Problem<D>, trial: &mut Point<D>, from: f64) {
    let Some((before, after)) = problem
        .pinned_last(from)
        .zip(problem.pinned_last(trial.z))
        .filter(|_| problem.anchor.is_none())
    else {
        return;
    };
    let change = trial.z - from;
    let spread = |before: &[[[f64; D]; 2]; 4], after: &[[[f64; D]; 2]; 4]| -> [f64; D] {
        std::array::from_fn(|d| {
            let off = |k: usize| after[k][0][d] - before[k][0][d] - before[k][1][d] * change;
            off(2) - off(1)
        })
    };
    let first = spread(&problem.pinned(from), &problem.pinned(trial.z));
    let ends = [first, spread(&before, &after)];
    let changes = spreading(ends, trial.control.len());
    for (control, change) in trial.control.iter_mut().zip(changes) {
        for d in 0..D {
            control[d] += change[d];
        }
    }
}
