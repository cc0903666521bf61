//! An iterate moved into the balls that it misses by a little.
//!
//! A search that begins at the motion of an arm takes a few dozen steps to come inside, as all bounds hold it back at once. A little
//! bend around each pass is enough for that; what the joints lose by it they win back in a few steps.

use std::f64::consts::FRAC_PI_2;

use super::joint::Joint;
use super::problem::{Point, Problem};
use super::project::project;

/// Share of a ball outside of which an iterate is moved, and to which.
const OUTSIDE: f64 = 0.985;
const INSIDE: f64 = 0.93;
/// Fewest and most knots at either side of a pass over which it moves.
const REACH: [f64; 2] = [2.0, 12.0];
/// Control points at either end that do not move.
const FIXED: usize = 4;
/// Rounds over all passes: a spline follows its control points a little less far than they move.
const ROUNDS: usize = 3;

/// Moves an iterate around each pass that misses its ball, unless a joint then leaves its range.
pub(super) fn nudge<const D: usize>(problem: &Problem<D>, point: &mut Point<D>) {
    let before = point.clone();
    for _ in 0..ROUNDS {
        let mut moved = false;
        for i in 0..point.crossings.len() {
            if let Some(way) = way_inside(problem, point, i) {
                bend(point, i, &way);
                moved = true;
            }
        }
        if !moved {
            break;
        }
    }
    project(problem, point, None, 20);
    let within = |joint: &Joint<D>| joint.is_within(&point.control);
    if !problem.joints.iter().all(within) {
        *point = before;
    }
}

/// The way from where an iterate passes an inner vertex into its balls; `None` if it is inside.
fn way_inside<const D: usize>(
    problem: &Problem<D>,
    point: &Point<D>,
    i: usize,
) -> Option<[f64; D]> {
    let (at, vertex) = (point.at(point.crossings[i])[0], &problem.inner()[i]);
    let mut way = [0.0; D];
    for g in 0..Problem::<D>::GROUPS {
        let radius = problem.radius(g, i);
        let coordinates = 3 * g..3 * g + 3;
        let squares = coordinates.clone().map(|d| (at[d] - vertex[d]).powi(2));
        let far = squares.sum::<f64>().sqrt();
        if far > OUTSIDE * radius {
            let share = 1.0 - INSIDE * radius / far;
            coordinates.for_each(|d| way[d] = share * (vertex[d] - at[d]));
        }
    }
    way.iter().any(|x| *x != 0.0).then_some(way)
}

/// Moves the control points around a pass: the nearest all the way, those at the passes beside it not at all.
fn bend<const D: usize>(point: &mut Point<D>, i: usize, way: &[f64; D]) {
    let time = point.crossings[i];
    let before = i.checked_sub(1).map_or(0.0, |i| point.crossings[i]);
    let after = point.crossings.get(i + 1).copied();
    let after = after.unwrap_or(point.spans() as f64);
    let [fewest, most] = REACH;
    let reach = (time - before).min(after - time).min(most).max(fewest);
    let last = point.control.len() - FIXED;
    for (k, control) in point.control[..last].iter_mut().enumerate().skip(FIXED) {
        let x = (k as f64 - 1.5 - time) / reach;
        if x.abs() < 1.0 {
            let share = (FRAC_PI_2 * x).cos().powi(2);
            for (c, way) in control.iter_mut().zip(way) {
                *c += share * way;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::spline::problem::Group;
    use crate::smooth::spline::start;

    /// A corner, with a first iterate that passes it beside its ball.
    fn beside() -> (Problem<3>, Point<3>) {
        let group = Group {
            caps: [0.5, 5.0, 100.0],
            radius: 0.01,
            width: 0.02,
        };
        let vertices = vec![[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.2, 0.0]];
        let mut problem = Problem::at_rest(vertices, [group; 2]);
        let mut point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
        project(&problem, &mut point, None, 20);
        problem.vertices[1][2] += 0.012;
        project(&problem, &mut point, None, 20);
        assert!(way_inside(&problem, &point, 0).is_some());
        (problem, point)
    }

    /// A joint that is the third coordinate, and may go so far.
    fn joint(count: usize, far: f64) -> Joint<3> {
        Joint {
            caps: [1.0; 3],
            range: vec![[0.0, far]; count],
            base: vec![0.0; count],
            changes: vec![[0.0, 0.0, 1.0]; count],
        }
    }

    /// What misses a ball is moved into it, and nothing moves at the ends.
    #[test]
    fn what_misses_is_moved_inside() {
        let (mut problem, before) = beside();
        let (mut point, count) = (before.clone(), before.control.len());
        problem.joints = vec![joint(count, 0.1)];
        nudge(&problem, &mut point);
        assert!(way_inside(&problem, &point, 0).is_none());
        assert_eq!(point.control[..FIXED], before.control[..FIXED]);
        let last = count - FIXED;
        assert_eq!(point.control[last..], before.control[last..]);
    }

    /// Nothing is moved where a joint would leave its range.
    #[test]
    fn no_joint_leaves_its_range() {
        let (mut problem, before) = beside();
        let mut point = before.clone();
        problem.joints = vec![joint(before.control.len(), 1e-3)];
        nudge(&problem, &mut point);
        assert_eq!(point.control, before.control);
    }
}
