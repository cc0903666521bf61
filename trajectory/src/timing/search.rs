//! The search for the final law of a problem: solves, bounds between the gridpoints, tightens the
//! rows that are exceeded there, solves again.

use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::{Descent, Interior};
use super::moving;
use super::tighten::{Draft, MOST_STEPS, tighten};
use crate::TimingError;

/// Newton steps after rows were tightened.
const FEW_STEPS: usize = 12;
/// Times that rows are tightened.
const ROUNDS: usize = 2;
/// Time that need not be gained back by another round.
const ENOUGH: f64 = 1.0005;

/// The fastest law found over `grid` once it is stretched to meet every bound. `None` if it is not
/// shorter than `limit` (s).
pub(super) fn best<const N: usize>(
    bounded: Bounded<'_, N>,
    gridpoints: &Gridpoints<'_, N>,
    limit: f64,
) -> Result<Option<Draft<N>>, TimingError> {
    let mut problem = bounded.problem(gridpoints);
    if problem.moving {
        return moving::best(bounded, gridpoints, problem).map(Some);
    }
    let mut descent = Descent {
        gap: bounded.options.gap,
        first: 0.3,
        steps: MOST_STEPS,
        limit,
    };
    // Tightened rows never make a law faster than it is now, up to the gap.
    let share = 1.0 - 2.0 * descent.gap;
    let mut interior = Interior::new(&problem);
    interior.slow_down(&problem);
    if !interior.solve(&problem, &descent) || interior.time() * share >= limit {
        return Ok(None);
    }
    let mut best = Draft::new(bounded, gridpoints, &problem, &interior);
    let mut last = None;
    for _ in 0..ROUNDS {
        let draft = last.as_ref().unwrap_or(&best);
        if draft.audit.stretch < ENOUGH {
            break;
        }
        tighten(&mut problem, draft, 1.0);
        (descent.first, descent.steps) = (0.02, FEW_STEPS);
        descent.limit = limit.min(best.duration);
        interior.slow_down(&problem);
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
