//! What follows a search whose motion does not hold: searches that go on from where it ended, and a place that is kept beside legs.

use super::{Attempts, Window};
use crate::smooth::certificate::corridor_of_legs;
use crate::smooth::crossing::Crossing;
use crate::smooth::judged::Judged;
use crate::smooth::later::later;
use crate::smooth::narrowing::narrow_legs;
use crate::smooth::seed::Seed;
use crate::smooth::span::Span;
use crate::smooth::spline::{self, Ahead, Request};

/// Most searches that go on from one another in a corridor that is narrower along the legs that were left.
const INSIDE: usize = 4;

impl Attempts<'_> {
    /// The inner poses that a search passes later than its motion does, for which it misses one. None where nothing turns: the place
    /// has nothing to wait for, and narrower balls do.
    pub(super) fn later(
        &self,
        request: &Request<'_>,
        (spans, seed, seen): (&[Span], &Seed, &Judged),
    ) -> Vec<usize> {
        let [_, turns] = request.moves();
        if !turns {
            return Vec::new();
        }
        let Window {
            poses,
            options,
            backwards,
            ..
        } = self.window;
        // It may have been slowed down.
        let spacing = spans.last().map_or(0.0, Span::end) / spans.len() as f64;
        let searched = (&seed.crossings[..], spacing);
        let poses = (poses, backwards);
        later(spans, poses, options, searched, &seen.crossings)
    }

    /// Keeps the place beside the legs on which it comes to some inner poses; false where it is kept so already.
    pub(super) fn keep_beside(&mut self, later: &[usize]) -> bool {
        let Window {
            poses,
            options,
            backwards,
            ..
        } = self.window;
        let before = self.shares.clone();
        for inner in later {
            let to = inner + 1 + usize::from(backwards);
            self.shares.keep_beside(to, poses, options.corridor());
        }
        self.shares != before
    }

    /// A motion that holds, from where the first search ended, and whether that failed by far.
    pub(super) fn gone_on(
        &self,
        request: &Request<'_>,
        (spans, seed, seen): (&[Span], Seed, &Judged),
    ) -> Option<(Vec<Span>, bool)> {
        let forward = self.forward(request, (&seed, seen));
        let inside = || self.inside(request, (spans, seed, seen));
        forward
            .map(|spans| (spans, true))
            .or_else(|| Some((inside()?, false)))
    }

    /// A motion that holds, from where a search ended that approaches poses before the tool is turned: its place goes forward there.
    fn forward(&self, request: &Request<'_>, (seed, seen): (&Seed, &Judged)) -> Option<Vec<Span>> {
        if seen.crossings.iter().all(Crossing::holds) {
            return None;
        }
        let request = Request {
            backwards: self.window.backwards,
            ..*request
        };
        [false, true].into_iter().find_map(|both| {
            let ahead = Some(Ahead { both });
            let mut spans = spline::further(&request, seed, ahead)?.spans;
            self.judge(&mut spans).holds().then_some(spans)
        })
    }

    /// A motion that holds, from where searches ended that leave the corridor between its samples, and keep all else: the corridor is
    /// narrowed along the legs where they do.
    fn inside(
        &self,
        request: &Request<'_>,
        (spans, mut seed, seen): (&[Span], Seed, &Judged),
    ) -> Option<Vec<Span>> {
        let mut left = seen.only_leaves().then(|| self.outside(spans, seen));
        let mut shares = request.shares.clone();
        for _ in 0..INSIDE {
            narrow_legs(&mut shares, &left?);
            let narrower = Request {
                shares: &shares,
                ..*request
            };
            let mut found = spline::further(&narrower, &seed, None)?;
            let seen = self.judge(&mut found.spans);
            if seen.holds() {
                return Some(found.spans);
            }
            let outside = || self.outside(&found.spans, &seen);
            (left, seed) = (seen.only_leaves().then(outside), found.seed);
        }
        None
    }

    /// The greatest distance of a motion from each leg over half the width of the corridor (m), by the pose at the end of the leg.
    pub(super) fn outside(&self, spans: &[Span], seen: &Judged) -> Vec<f64> {
        let Window { poses, options, .. } = self.window;
        corridor_of_legs(spans, poses, &seen.crossings, options.corridor())
    }
}
