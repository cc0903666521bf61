//! What tests of the Newton system share: corners to be passed, and the barrier along a step.

use super::barrier::Barrier;
use super::line_search::go;
use super::newton::Step;
use super::problem::{Group, Point, Problem, Room};
use super::project::project;

/// Corners in position and orientation, from rest to rest.
pub(super) fn corners() -> Problem<6> {
    let vertices = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.1, 0.0, 0.0, 0.3, 0.0, 0.1],
        [0.1, 0.1, 0.0, 0.3, 0.4, 0.0],
        [0.0, 0.1, 0.1, 0.0, 0.4, 0.3],
        [0.0, 0.2, 0.1, 0.1, 0.1, 0.3],
    ];
    let group = |scale: f64, radius: f64| Group {
        caps: [0.5, 5.0, 100.0].map(|cap| cap * scale),
        radius,
        width: 2.0 * radius,
    };
    Problem::at_rest(vertices.to_vec(), [group(1.0, 0.01), group(4.0, 0.08)])
}

/// The barrier where a share of a step leads, with this weight on `z`.
pub(super) fn along<'a, const D: usize>(
    (problem, room): (&'a Problem<D>, &'a Room),
    (point, step): (&'a Point<D>, &'a Step),
    weight: f64,
) -> impl Fn(f64) -> f64 + 'a {
    let barrier = Barrier {
        problem,
        room,
        weight,
        keep: 0.0,
    };
    move |share| {
        let mut moved = point.clone();
        go(problem, (point, &mut moved), (step, share));
        project(problem, &mut moved, Some(room), 20);
        let seen = barrier.look(&moved, &[]).unwrap();
        barrier.value(&moved, &seen)
    }
}
