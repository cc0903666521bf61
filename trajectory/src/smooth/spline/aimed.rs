//! Inner vertices that move to where the motion of an iterate sees the poses.

use super::barrier::{Barrier, Seen};
use super::line_search::{Known, go};
use super::newton::System;
use super::pace::Pace;
use super::problem::{Point, Problem, Room, ways};
use super::project::project;

/// Where the motion of an iterate sees the inner poses.
pub(super) type Aims<'a, const D: usize> = &'a dyn Fn(&Problem<D>, &Point<D>) -> Vec<[f64; D]>;

/// Steps from one look at where the poses are seen to the next.
pub(super) const AIMING: usize = 4;

/// Share of each slack that moved vertices must leave.
const LEAVE: f64 = 0.3;

/// Moves the inner vertices to where the motion of the iterate sees them: at once, if it stays well inside, else with the
/// iterate, as far as it stays so. By how much they may still be off, in radii of their balls.
pub(super) fn aim<const D: usize, const B: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
    (system, room, known): (&mut System<D, B>, &Room, &mut Known),
    aims: Option<Aims<'_, D>>,
) -> f64 {
    let Some(aims) = aims.map(|aims| aims(problem, point)) else {
        return 0.0;
    };
    let shift = |(aim, from): (&[f64; D], &[f64; D])| -> [f64; D] {
        let turn = Problem::<D>::LAST..3 * Problem::<D>::GROUPS;
        std::array::from_fn(|d| {
            if turn.contains(&d) {
                aim[d] - from[d]
            } else {
                0.0
            }
        })
    };
    let shifts: Vec<[f64; D]> = aims.iter().zip(problem.inner()).map(shift).collect();
    let radius = problem.groups[Problem::<D>::GROUPS - 1].radius;
    let far = |shift: &[f64; D]| shift.iter().map(|x| x * x).sum::<f64>().sqrt() / radius;
    let off = shifts.iter().map(far).fold(0.0, f64::max);
    let Some(seen) = left(problem, room, point, &[]) else {
        return 0.0;
    };
    let before = problem.vertices.clone();
    shifted(problem, &before, (&shifts, 1.0));
    if let Some(seen) = left(problem, room, point, &seen.slacks) {
        known.keep(room, seen);
        return 0.0;
    }
    shifted(problem, &before, (&shifts, 0.0));
    let Some(step) = system.shift(problem, point, (room, &shifts)) else {
        return off;
    };
    let mut share = 1.0;
    for _ in 0..5 {
        shifted(problem, &before, (&shifts, share));
        let mut trial = point.clone();
        go(problem, (point, &mut trial), (&step, share));
        project(problem, &mut trial, Some(room), Pace::rounds(problem));
        if let Some(seen) = left(problem, room, &trial, &seen.slacks) {
            known.keep(room, seen);
            *point = trial;
            return off;
        }
        share *= 0.4;
    }
    shifted(problem, &before, (&shifts, 0.0));
    off
}

/// Moves the inner vertices from where they were `before` by a share of their shifts.
fn shifted<const D: usize>(
    problem: &mut Problem<D>,
    before: &[[f64; D]],
    (shifts, share): (&[[f64; D]], f64),
) {
    let inner = problem.vertices.iter_mut().zip(before).skip(1);
    for ((to, from), shift) in inner.zip(shifts) {
        for d in 0..D {
            to[d] = from[d] + share * shift[d];
        }
    }
    problem.ways = ways(&problem.vertices);
}

/// The barrier at an iterate, if enough is left of the slacks `before`.
fn left<const D: usize>(
    problem: &Problem<D>,
    room: &Room,
    point: &Point<D>,
    before: &[f64],
) -> Option<Seen> {
    let barrier = Barrier {
        problem,
        room,
        weight: 0.0,
        keep: LEAVE,
    };
    barrier.look(point, before)
}
