//! The time of a start in motion, which holds an iterate until it is as fast.

use super::line_search::follow;
use super::problem::{Point, Problem};
use super::project::project;

/// Up to so many times the knot spacing of its start, cubed, an iterate is held by its ends.
const HELD: f64 = 1.02;

/// Whether the iterate has become faster than its start, which then holds it no longer.
pub(super) fn is_let_go<const D: usize>(problem: &mut Problem<D>, point: &mut Point<D>) -> bool {
    let Some(z) = problem.anchor.filter(|z| point.z < *z) else {
        return false;
    };
    problem.anchor = None;
    point.z = z;
    true
}

/// Whether an iterate between two ends in motion cannot become faster than its start only because of them: while their
/// control points stay those of the start, an end at a limit allows no less time. The iterate is then let go as it is.
pub(super) fn is_held_by_ends<const D: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
) -> bool {
    let Some(z) = problem.anchor.filter(|z| point.z < HELD * *z) else {
        return false;
    };
    if problem.finish.is_none() {
        return false;
    }
    problem.anchor = None;
    follow(problem, point, z);
    problem.pin(point);
    project(problem, point, None, 20);
    true
}
