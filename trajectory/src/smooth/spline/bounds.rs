//! The bounds of an iterate: it may begin outside of the true ones.

use super::problem::{Point, Problem, Room};

/// Steps between two narrowings of widened bounds: they move the iterate well inside, so that each
/// narrowing is large.
const PATIENCE: usize = 4;

/// The bounds of an iterate: widened to contain it, and narrowed as it moves inwards.
pub(super) struct Bounds {
    pub(super) room: Room,
    /// Whether they are the true bounds.
    pub(super) tight: bool,
    /// Steps since they were narrowed last.
    since: usize,
}

impl Bounds {
    /// The narrowest bounds that contain an iterate.
    pub(super) fn around<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> Self {
        let mut room = Room::new(problem, point);
        let tight = room.tighten(problem, point);
        Self {
            room,
            tight,
            since: 0,
        }
    }

    /// Narrows them where it is time for that.
    pub(super) fn narrow<const D: usize>(&mut self, problem: &Problem<D>, point: &Point<D>) {
        self.since += 1;
        if self.tight || self.since > PATIENCE {
            self.tight = self.room.narrow(problem, point);
            self.since = 0;
        }
    }

    /// Whether they were narrowed before the last step.
    pub(super) fn are_new(&self) -> bool {
        self.since == 0
    }

    /// Has them narrowed before the next step.
    pub(super) fn narrow_next(&mut self) {
        self.since = PATIENCE;
    }
}
