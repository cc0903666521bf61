//! A plan along a fitted curve, and whether another way of planning may be faster.

use super::plan::{SmoothPlan, faster};

/// A motion along a fitted curve.
pub(super) struct Fit {
    pub(super) plan: SmoothPlan,
    /// Whether another way of planning may be faster.
    pub(super) eased: bool,
}

impl Fit {
    /// The faster of two, the first if they are equal.
    pub(super) fn faster(first: Option<Self>, second: Option<Self>) -> Option<Self> {
        let (first, second) = match (first, second) {
            (Some(first), Some(second)) => (first, second),
            (first, second) => return first.or(second),
        };
        let better = second.plan.duration() < first.plan.duration();
        let eased = if better { second.eased } else { first.eased };
        Some(Self {
            plan: faster(Some(first.plan), Some(second.plan))?,
            eased,
        })
    }

    /// Whether no other way of planning is faster by much: it is not slower than it might be, and
    /// rests nowhere. A motion that turns back without a rest saves up to the time of a ramp.
    pub(super) fn suffices(&self) -> bool {
        !self.eased && self.plan.rests().is_empty()
    }
}
