//! A motion that was found for a list, and what its search says about others.

use super::motion::Motion;
use super::plan::SmoothPlan;

/// A certified motion: as a plan of the list, and through its normal form.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) plan: SmoothPlan,
    /// The same motion through the form.
    pub(super) motion: Motion,
    /// Whether the form begins at the end of the list.
    pub(super) backwards: bool,
    /// Of the fastest of the motions that were tried, before their rests were bridged: its time (s), and
    /// whether it rested elsewhere than where the way turns back.
    pub(super) before: (f64, bool),
    /// Whether its way of planning may have found less than it usually does: another may be faster.
    pub(super) eased: bool,
}

impl Found {
    /// Whether no other way of planning is faster by much: it is not slower than it might be, and rests nowhere. A
    /// motion that turns back without a rest saves up to the time of a ramp.
    pub(super) fn suffices(&self) -> bool {
        !self.eased && self.plan.rests().is_empty()
    }

    /// Whether it rests elsewhere than where the way turns back, or did before its rests were bridged: then
    /// another way of planning may be faster.
    pub(super) fn is_divided(&self) -> bool {
        self.before.1
    }

    /// Whether an attempt at it failed: another search may do better.
    pub(super) fn is_hard(&self) -> bool {
        self.motion.retried || self.is_divided()
    }

    /// The faster of two, the first if they are equal.
    pub(super) fn faster(first: Option<Self>, second: Option<Self>) -> Option<Self> {
        Some(Self::ordered(first, second)?.0)
    }

    /// The same, and the other one.
    pub(super) fn ordered(
        first: Option<Self>,
        second: Option<Self>,
    ) -> Option<(Self, Option<Self>)> {
        let (mut first, mut second) = match (first, second) {
            (Some(first), Some(second)) => (first, second),
            (first, second) => return Some((first.or(second)?, None)),
        };
        let later = second.before.0 < first.before.0;
        let before = if later { second.before } else { first.before };
        (first.before, second.before) = (before, before);
        let better = second.plan.duration() < first.plan.duration();
        Some(if better {
            (second, Some(first))
        } else {
            (first, Some(second))
        })
    }
}
