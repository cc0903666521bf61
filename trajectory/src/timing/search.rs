//! The search for the final law of a problem: solves, bounds between the gridpoints, tightens the
//! rows that are exceeded there, solves again.

use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::{self, Descent, Interior};
use super::moving;
use super::tighten::{Draft, MOST_STEPS, tighten};
use crate::TimingError;

/// Newton steps after rows were tightened.
const FEW_STEPS: usize = 12;
/// Times that rows are tightened.
const ROUNDS: usize = 2;

/// How a search begins, and when it is enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manner {
    /// The share of the square of the rate that limits allow with which it begins: first, and after rows
    /// were tightened.
    share: [f64; 2],
    /// The relative gap that is assumed then.
    gap: [f64; 2],
    /// Time that need not be gained back by another round.
    enough: f64,
    /// By how much more than their excess rows are tightened.
    more: f64,
}

/// Far from the limits.
pub(super) const FAR: Manner = Manner {
    share: [interior::FAR, interior::FAR],
    gap: [0.3, 0.02],
    enough: 1.0005,
    more: 1.0,
};

/// Near the limits: a fifth fewer steps, and hardly any third round.
pub(super) const NEAR: Manner = Manner {
    share: [0.9, 0.97],
    gap: [3.0, 0.02],
    enough: 1.0003,
    more: 1.0003,
};

/// The fastest law found over `grid` once it is stretched to meet every bound. `None` if it is not
/// shorter than `limit` (s).
pub(super) fn best<const N: usize>(
    bounded: Bounded<'_, N>,
    gridpoints: &Gridpoints<'_, N>,
    (limit, manner): (f64, &Manner),
) -> Result<Option<Draft<N>>, TimingError> {
    let mut problem = bounded.problem(gridpoints);
    if problem.moving {
        return moving::best(bounded, gridpoints, problem).map(Some);
    }
    let mut descent = Descent {
        gap: bounded.options.gap,
        first: manner.gap[0],
        steps: MOST_STEPS,
        limit,
    };
    // Tightened rows never make a law faster than it is now, up to the gap.
    let share = 1.0 - 2.0 * descent.gap;
    let mut interior = Interior::new(&problem);
    interior.slow_down_to(&problem, manner.share[0]);
    if !interior.solve(&problem, &descent) || interior.time() * share >= limit {
        return Ok(None);
    }
    let mut best = Draft::new(bounded, gridpoints, &problem, &interior);
    let mut last = None;
    for _ in 0..ROUNDS {
        let draft = last.as_ref().unwrap_or(&best);
        if draft.audit.stretch < manner.enough {
            break;
        }
        tighten(&mut problem, draft, manner.more);
        (descent.first, descent.steps) = (manner.gap[1], FEW_STEPS);
        descent.limit = limit.min(best.duration);
        interior.slow_down_to(&problem, manner.share[1]);
        if !interior.solve(&problem, &descent) || interior.time() * share >= descent.limit {
            break;
        }
        let next = Draft::new(bounded, gridpoints, &problem, &interior);
        last = keep_faster(&mut best, next);
    }
    best.iterations = interior.iterations;
    Ok(Some(best))
}

/// Keeps the faster of two drafts, the first when they are even; returns the second if it is slower.
fn keep_faster<const N: usize>(best: &mut Draft<N>, next: Draft<N>) -> Option<Draft<N>> {
    if best.duration <= next.duration {
        return Some(next);
    }
    *best = next;
    None
}

#[cfg(test)]
mod tests {
    use super::super::PathTiming;
    use crate::{
        Boundary, JointLimits, JointLine, JointPoint, TimingOptions, ToolLimits, ToolPoint,
    };
    use nalgebra::{Isometry3, SVector};

    /// Both searches find the same time within their gap, within all limits; that from near the limits
    /// takes fewer steps.
    #[test]
    fn a_search_from_near_the_limits_takes_fewer_steps() {
        let still = |_: &JointPoint<3>| ToolPoint::still(Isometry3::identity());
        let limits = JointLimits::uniform(2.0, 12.0, 6000.0);
        let options = TimingOptions {
            end: Boundary::Rest,
            gap: 2e-4,
            ..TimingOptions::default()
        };
        let mut steps = [0; 2];
        for i in 1..12 {
            let end = SVector::from_fn(|j, _| (f64::from(i) * (1.0 + j as f64)).sin());
            let line = JointLine::new(SVector::zeros(), end, still);
            let timing = PathTiming::new(&line, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
            let [far, near] = [timing.clone(), timing.near()].map(|timing| timing.solve().unwrap());
            let [a, b] = [&far, &near].map(|timed| timed.trajectory.duration());
            assert!((a - b).abs() < 1e-3 * a, "{a} {b}");
            let highest = |most: f64, peak: &crate::timing::LimitPeak| most.max(peak.ratio);
            assert!(near.certificate.peaks.iter().fold(0.0, highest) < 1.0 + 1e-9);
            steps[0] += far.certificate.iterations;
            steps[1] += near.certificate.iterations;
        }
        assert!(10 * steps[1] < 9 * steps[0], "{steps:?}");
    }

    /// With wider cells where the law without jerk limits does not switch a law takes hardly longer, and has fewer cells;
    /// those at both ends are as they were.
    #[test]
    fn wider_cells_cost_little_time() {
        let still = |_: &JointPoint<2>| ToolPoint::still(Isometry3::identity());
        let limits = JointLimits::uniform(2.0, 5.0, 500.0);
        let mut cells = [0; 2];
        for i in 1..12 {
            let end = SVector::from_fn(|j, _| 2.0 * (f64::from(i) * (1.0 + j as f64)).sin());
            let line = JointLine::new(SVector::zeros(), end, still);
            let law = |widest: usize| {
                let options = TimingOptions {
                    widest,
                    gap: 1e-5,
                    ..TimingOptions::default()
                };
                let timing = PathTiming::new(&line, &limits, &ToolLimits::UNLIMITED, &options);
                timing.unwrap().solve().unwrap()
            };
            let [even, wide] = [1, 8].map(law);
            let [a, b] = [&even, &wide].map(|timed| timed.trajectory.duration());
            assert!((b / a - 1.0).abs() < 5e-4, "{a} {b}");
            let firsts = [&even, &wide].map(|timed| timed.trajectory.pieces()[0].duration);
            assert!((firsts[1] / firsts[0] - 1.0).abs() < 0.05, "{firsts:?}");
            cells[0] += even.certificate.cells;
            cells[1] += wide.certificate.cells;
        }
        assert!(10 * cells[1] < 6 * cells[0], "{cells:?}");
    }
}
