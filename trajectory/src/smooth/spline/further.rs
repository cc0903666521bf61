//! Searches of the tool alone that go on from where another one ended.

use super::aimed::Aims;
use super::build::{Found, Task};
use super::problem::{Point, Problem, ways};
use super::request::Request;
use super::solve::solve;
use crate::smooth::seed::Seed;

/// Time-optimal spline under the bounds of a request from where a search ended. Where the motion of that search approaches poses
/// before it passes them it goes on `ahead`: with a place that goes forward only on the legs before these poses, or on both legs
/// beside them. `None` where that is of no use, or the bounds do not hold in the end.
pub(crate) fn further(request: &Request<'_>, seed: &Seed, ahead: Option<Ahead>) -> Option<Found> {
    let task = Task::new(request);
    let (place, turn, all) = ([true, false], [false, true], [true; 2]);
    match request.moves() {
        [true, turns] if !turns || !request.coupled => task.further::<3, 20>(seed, place, ahead),
        [false, true] if ahead.is_none() => task.further::<3, 20>(seed, turn, None),
        [true, true] if request.has_few_poses() => task.further::<6, 20>(seed, all, ahead),
        [true, true] => task.further::<6, 36>(seed, all, ahead),
        _ => None,
    }
}

/// How a place goes forward.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ahead {
    /// Whether the place goes forward on both legs beside a pose; else on the leg before it.
    pub(crate) both: bool,
}

impl Task<'_> {
    fn further<const D: usize, const B: usize>(
        &self,
        seed: &Seed,
        used: [bool; 2],
        ahead: Option<Ahead>,
    ) -> Option<Found> {
        let (mut problem, mut point) = self.ended(seed, used);
        let aims = |problem: &Problem<D>, point: &Point<D>| self.aims(problem, point);
        let aims: Aims<'_, D> = &aims;
        if let Some(ahead) = ahead {
            let effort = (self.effort(), Some(aims));
            (problem, point) = self.ahead::<D, B>((&problem, &point), effort, (used, ahead))?;
        } else {
            let aims = (used == [true, true]).then_some(aims);
            solve::<D, B>(&mut problem, &mut point, self.effort(), aims)?;
        }
        Some(self.found(&problem, &point, used))
    }

    /// The problem of a search that has ended, and its last iterate.
    fn ended<const D: usize>(&self, seed: &Seed, used: [bool; 2]) -> (Problem<D>, Point<D>) {
        let vertices = Seed::used(&seed.vertices);
        let problem = Problem {
            scale: seed.spacing,
            ways: ways(&vertices),
            vertices,
            ..self.problem(used)
        };
        let point = Point {
            control: Seed::used(&seed.control),
            z: 1.0,
            crossings: seed.crossings.clone(),
        };
        (problem, point)
    }
}
