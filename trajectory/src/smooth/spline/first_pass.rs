//! Searches that go on from a solution which approaches a pose before it passes it: a pose counts as passed on the first approach.

use std::collections::BTreeSet;

use super::aimed::Aims;
use super::build::Task;
use super::effort::Effort;
use super::further::Ahead;
use super::problem::{Point, Problem};
use super::solve::solve;
use super::stretch::Stretch;
use crate::smooth::crossing::crossings_made;
use crate::smooth::later::later;

/// Most searches one after another.
const FORWARD: usize = 3;

/// Times the usual steps with which a search begins and those of all: its new bounds are widened at first, at many control points.
const BEGINS: usize = 4;
const LONGER: usize = 2;

impl Task<'_> {
    /// Searches on for an arm with a solution that turns and has not turned as it has to be on the first approach to a pose: with a
    /// place that goes forward only on the leg before it. The solution stays where that does not help.
    pub(super) fn pass_first<const D: usize, const B: usize>(
        &self,
        (problem, point): (&mut Problem<D>, &mut Point<D>),
        (effort, aims): (Effort, Option<Aims<'_, D>>),
        used: [bool; 2],
    ) {
        if !Problem::<D>::TURNS {
            return;
        }
        let ahead = self.ahead::<D, B>((problem, point), (effort, aims), (used, Ahead::default()));
        let holds =
            |(other, first): &(Problem<D>, Point<D>)| self.later((other, first), used).is_empty();
        if let Some(ahead) = ahead.filter(holds) {
            (*problem, *point) = ahead;
        }
    }

    /// Where searches end that go on from an iterate with a place that goes forward only. `None` where it need not, or no such
    /// motion is found.
    pub(super) fn ahead<const D: usize, const B: usize>(
        &self,
        (problem, point): (&Problem<D>, &Point<D>),
        (mut effort, aims): (Effort, Option<Aims<'_, D>>),
        (used, Ahead { both }): ([bool; 2], Ahead),
    ) -> Option<(Problem<D>, Point<D>)> {
        (effort.search, effort.steps) = (BEGINS * effort.search, LONGER * effort.steps);
        let (mut vertices, mut nearer) = (BTreeSet::new(), BTreeSet::new());
        let mut ahead: Option<(Problem<D>, Point<D>)> = None;
        for _ in 0..FORWARD {
            let (before, from) = ahead.as_ref().map_or((problem, point), |(a, b)| (a, b));
            let missed = self.later((before, from), used);
            if missed.is_empty() {
                break;
            }
            // To go along its legs has not been enough.
            if !vertices.is_empty() {
                nearer.extend(missed.iter().copied());
            }
            vertices.extend(missed);
            let stretch = Stretch {
                vertices: &vertices,
                nearer: &nearer,
                backwards: self.request.backwards,
                both,
            };
            let (mut other, mut first) = (before.clone(), from.clone());
            other.go_forward(from, &stretch);
            for leg in stretch.legs() {
                let width = self.options.corridor();
                other.shares.keep_beside(leg + 1, self.poses, width);
            }
            self.see_aims(&mut other, &first);
            solve::<D, B>(&mut other, &mut first, effort, aims)?;
            ahead = Some((other, first));
        }
        ahead
    }

    /// The poses that an iterate passes later than its motion does, for which it misses one.
    fn later<const D: usize>(
        &self,
        (problem, point): (&Problem<D>, &Point<D>),
        used: [bool; 2],
    ) -> Vec<usize> {
        let spans = self.spans(problem, point, used);
        let searched = (&point.crossings[..], problem.spacing(point.z));
        let poses = (self.poses, self.request.backwards);
        let made = crossings_made(&spans, poses, self.options);
        later(&spans, poses, self.options, searched, &made)
    }
}
