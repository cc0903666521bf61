//! A place that goes forward only: a bound of the search beside the limits, balls and corridor.
//!
//! At a corner a tool may have to turn for longer than its place needs. A motion that is as fast may then leave the ball and come
//! back, and a pose counts as passed on the first approach, where the tool is not turned yet. Where the place goes forward along
//! the leg before the pass until it passes, and then along the leg after it, there is no other approach.

/// How far the place goes forward at least from one control point to the next, as a share of what it covers at its greatest speed
/// in one knot interval; the same from which on the bound need not be widened.
const AHEAD: f64 = 1e-4;
const CLEAR: f64 = 1.5 * AHEAD;

/// What an iterate leaves at least of a widened bound, as a share of how far it goes forward or back.
const LEFT: f64 = 0.03;

/// A control point lies before another place, along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Forward {
    /// Index of the control point.
    pub(super) control: usize,
    /// The direction, of length one.
    pub(super) along: [f64; 3],
    /// What it lies before: this place, or else the next control point.
    pub(super) place: Option<[f64; 3]>,
}

impl Forward {
    /// By how much its control point lies before the other place, m.
    pub(super) fn ahead<const D: usize>(&self, control: &[[f64; D]]) -> f64 {
        let (from, next) = (&control[self.control], &control[self.control + 1]);
        let to = self.place.unwrap_or_else(|| [next[0], next[1], next[2]]);
        (0..3).map(|d| self.along[d] * (to[d] - from[d])).sum()
    }

    /// The control points that it depends on, with the sign of each.
    pub(super) fn ends(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let next = (self.control + 1, 1.0);
        let next = Some(next).filter(|_| self.place.is_none());
        [(self.control, -1.0)].into_iter().chain(next)
    }

    /// The share of a point along its direction.
    pub(super) fn share<const D: usize>(&self, point: &[f64; D]) -> f64 {
        (0..3).map(|d| self.along[d] * point[d]).sum()
    }

    /// The bound for an iterate that lies before by a share: how far it may lie behind; below 0 at the true bound.
    pub(super) fn narrowed(before: f64, ahead: f64) -> f64 {
        if ahead >= CLEAR {
            return -AHEAD;
        }
        before.min(AHEAD.max(LEFT * ahead.abs()) - ahead)
    }

    /// Whether a bound is the true one.
    pub(super) fn is_tight(behind: f64) -> bool {
        behind <= -AHEAD
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A widened bound contains the iterate, is never wider than before, and is the true one where the iterate is well inside.
    #[test]
    fn bounds_are_narrowed_to_the_iterate() {
        let mut behind = f64::INFINITY;
        for ahead in [-0.5, -0.2, -1e-3, 0.0, 1.2e-4, 1e-3] {
            let narrowed = Forward::narrowed(behind, ahead);
            assert!(narrowed <= behind && narrowed > -ahead);
            assert_eq!(Forward::is_tight(narrowed), ahead == 1e-3);
            behind = narrowed;
        }
    }
}
