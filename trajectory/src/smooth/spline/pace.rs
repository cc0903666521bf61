//! How the interior point iteration is led: faster or slower, by what is searched.

use super::barrier::{Barrier, KEEP};
use super::effort::Effort;
use super::problem::{FEW, Problem, Room};

/// Growth of the weight on `z` at each centre, and the square of the Newton decrement at one.
const GROWTH: f64 = 8.0;
const CENTRE: f64 = 3.0;

/// The same where the orientation is a part of the search: thousands of bounds that are curved shorten a long step to a
/// twentieth. With a small growth a step or two lead far enough, and what the decrement tells is a small share of the
/// parameter of the barrier.
const TURNING: f64 = 2.0;
const LOOSELY: f64 = 3000.0;

/// Rounds in which a trial looks for the passes, and where the orientations of few poses are searched. There a pass that is not
/// yet where it belongs may be inside of a ball which the pass itself is outside of: then no step leads on from the iterate.
const ROUNDS: usize = 3;
const MORE_ROUNDS: usize = 12;

/// Square of the Newton decrement from which short steps are normal, because the weight has just
/// been raised.
const LOW: f64 = 100.0;

/// Square of the Newton decrement that is near enough to a centre on the way to a first valid motion.
pub(super) const ROUGHLY: f64 = 30.0;

/// A gap from which on no more than a motion is wanted that is far inside of its bounds.
const ROUGH: f64 = 0.1;

/// How the iteration is led.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Most Newton steps.
    pub(super) steps: usize,
    /// Growth of the weight on `z` at each centre, and the square of the Newton decrement at one and at the last.
    pub(super) growth: f64,
    pub(super) centre: f64,
    pub(super) last: f64,
    /// Square of the decrement from which short steps are normal.
    pub(super) low: f64,
    /// Share of each slack that a step must leave.
    pub(super) keep: f64,
    /// Rounds in which a trial looks for the passes.
    pub(super) rounds: usize,
    /// Square of the decrement from which widened bounds are narrowed at once.
    pub(super) near: f64,
}

impl Pace {
    pub(super) fn new<const D: usize>(problem: &Problem<D>, effort: Effort) -> Self {
        if problem.finish.is_none() {
            return Self {
                steps: effort.steps,
                growth: if Problem::<D>::TURNS { TURNING } else { GROWTH },
                centre: if Problem::<D>::TURNS { LOOSELY } else { CENTRE },
                last: if Problem::<D>::TURNS { ROUGHLY } else { CENTRE },
                low: LOW,
                keep: KEEP,
                rounds: Self::rounds(problem),
                near: if effort.gap >= ROUGH { 3.0 } else { 0.1 },
            };
        }
        // Between two ends in motion the passes of a sharp corner wander, and an iterate that comes close
        // to a bound there does not leave it again: small changes of the weight, well centred, half of each
        // slack left. The weight is never lowered: from there the iterate does not come back.
        Self {
            steps: BETWEEN,
            growth: 1.2,
            centre: 1.0,
            last: 1.0,
            low: 0.0,
            keep: 0.5,
            rounds: MORE_ROUNDS,
            near: 0.1,
        }
    }

    /// Rounds in which a trial looks for the passes. Of a dense list they lead on from each other.
    pub(super) fn rounds<const D: usize>(problem: &Problem<D>) -> usize {
        if Problem::<D>::TURNS && problem.inner().len() <= FEW {
            MORE_ROUNDS
        } else {
            ROUNDS
        }
    }

    /// The barrier of a problem at this pace.
    pub(super) fn barrier<'a, const D: usize>(
        &self,
        problem: &'a Problem<D>,
        room: &'a Room,
        weight: f64,
    ) -> Barrier<'a, D> {
        Barrier {
            problem,
            room,
            weight,
            keep: self.keep,
        }
    }
}

/// Most Newton steps between two ends in motion.
const BETWEEN: usize = 400;
