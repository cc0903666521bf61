//! Searches that go on from a solution which approaches a pose before it passes it: a pose counts as passed on the first approach.

use std::collections::BTreeSet;

use super::build::{Found, Task};
use super::problem::{Point, Problem, ways};
use super::solve::{Aims, Effort, solve};
use super::stretch::Stretch;
use crate::smooth::crossing::{Crossing, crossings_made};
use crate::smooth::seed::Seed;

/// Most further searches of an arm and of a tool, and times in knots that are the same.
const AGAIN: usize = 2;
const FORWARD: usize = 3;
const SAME: f64 = 0.1;

/// Times the usual steps with which a search begins and those of all: its new bounds are widened at first, at many control points.
const BEGINS: usize = 4;
const LONGER: usize = 2;

impl Task<'_> {
    /// Searches on with a solution that has not turned as it has to be on the first approach to a pose, so that it passes there. The
    /// solution stays where that does not help.
    pub(super) fn pass_first<const D: usize, const B: usize>(
        &self,
        (problem, point): (&mut Problem<D>, &mut Point<D>),
        (effort, aims): (Effort, Option<Aims<'_, D>>),
        used: [bool; 2],
    ) {
        for _ in 0..AGAIN {
            let h = problem.spacing(point.z);
            let passes = self.passes((problem, point), used, false);
            if missed(&passes, point, h).next().is_none() {
                return;
            }
            let (mut other, mut first) = (problem.clone(), point.clone());
            first.crossings = passes.iter().map(|pass| pass.time / h).collect();
            self.see_aims(&mut other, &first);
            if solve::<D, B>(&mut other, &mut first, effort, aims).is_none() {
                return;
            }
            (*problem, *point) = (other, first);
        }
    }

    /// Searches on from where a search ended, with a place that goes forward only on the leg before each pose that the tool
    /// approaches where it is not turned yet, or on `both` legs beside it. `None` where there are none, or no such motion is found.
    pub(super) fn forward<const D: usize, const B: usize>(
        &self,
        seed: &Seed,
        used: [bool; 2],
        [backwards, both]: [bool; 2],
    ) -> Option<Found> {
        let (mut problem, mut point) = self.ended(seed, used);
        let mut effort = self.effort();
        (effort.search, effort.steps) = (BEGINS * effort.search, LONGER * effort.steps);
        let aims = |problem: &Problem<D>, point: &Point<D>| self.aims(problem, point);
        let (mut vertices, mut nearer) = (BTreeSet::new(), BTreeSet::new());
        for _ in 0..FORWARD {
            let h = problem.spacing(point.z);
            let passes = self.passes((&problem, &point), used, backwards);
            let missed: Vec<usize> = missed(&passes, &point, h).collect();
            if missed.is_empty() {
                break;
            }
            // To go along its legs has not been enough.
            if !vertices.is_empty() {
                nearer.extend(missed.iter().copied());
            }
            vertices.extend(missed);
            let (mut other, mut first) = (problem.clone(), point.clone());
            let stretch = Stretch {
                vertices: &vertices,
                nearer: &nearer,
                backwards,
                both,
            };
            other.go_forward(&point, &stretch);
            self.see_aims(&mut other, &first);
            solve::<D, B>(&mut other, &mut first, effort, Some(&aims))?;
            (problem, point) = (other, first);
        }
        (!vertices.is_empty()).then(|| self.found(&problem, &point, used))
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

    /// How the motion of an iterate passes the poses.
    fn passes<const D: usize>(
        &self,
        (problem, point): (&Problem<D>, &Point<D>),
        used: [bool; 2],
        backwards: bool,
    ) -> Vec<Crossing> {
        let spans = self.spans(problem, point, used);
        crossings_made(&spans, (self.poses, backwards), self.options)
    }
}

/// The inner poses that are not passed when an iterate with this knot spacing passes them, and not within their tolerances.
fn missed<const D: usize>(
    passes: &[Crossing],
    point: &Point<D>,
    spacing: f64,
) -> impl Iterator<Item = usize> {
    let all = passes.iter().zip(&point.crossings).enumerate();
    let missed = move |(pass, time): (&Crossing, &f64)| {
        !pass.holds() && (pass.time / spacing - time).abs() >= SAME
    };
    all.filter(move |(_, both)| missed(*both)).map(|(i, _)| i)
}
