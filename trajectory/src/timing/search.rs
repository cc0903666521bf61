//! The search for the final law of a problem: solves, bounds between the gridpoints, tightens the
//! rows that are exceeded there, solves again.

use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::Interior;
use super::moving;
use super::tighten::{Draft, MOST_STEPS, tighten};
use crate::TimingError;

/// Newton steps after rows were tightened.
const FEW_STEPS: usize = 12;
/// Times that rows are tightened.
const ROUNDS: usize = 2;
/// Time that need not be gained back by another round.
const ENOUGH: f64 = 1.0005;

/// The fastest law found over `grid` once it is stretched to meet every bound. A law that cannot be
/// shorter than `limit` (s) is not improved.
pub(super) fn best<const N: usize>(
    bounded: Bounded<'_, N>,
    gridpoints: &Gridpoints<'_, N>,
    limit: f64,
) -> Result<Draft<N>, TimingError> {
    let mut problem = bounded.problem(gridpoints);
    if problem.moving {
        return moving::best(bounded, gridpoints, problem);
    }
    let gap = bounded.options.gap;
    let mut interior = Interior::new(&problem);
    interior.slow_down(&problem);
    interior.solve(&problem, gap, 0.3, MOST_STEPS);
    let mut last = Draft::new(bounded, gridpoints, &problem, &interior);
    let mut best = None;
    for _ in 0..ROUNDS {
        // Tightened rows never make the law faster than it is now, up to the gap.
        if last.audit.stretch < ENOUGH || interior.time() * (1.0 - 2.0 * gap) >= limit {
            break;
        }
        tighten(&mut problem, &last, 1.0);
        best = Some(faster(best, last));
        interior.slow_down(&problem);
        interior.solve(&problem, gap, 0.02, FEW_STEPS);
        last = Draft::new(bounded, gridpoints, &problem, &interior);
    }
    let mut best = faster(best, last);
    best.iterations = interior.iterations;
    Ok(best)
}

/// The faster of two drafts, the first when they are even.
fn faster<const N: usize>(first: Option<Draft<N>>, second: Draft<N>) -> Draft<N> {
    match first {
        Some(first) if first.duration <= second.duration => first,
        _ => second,
    }
}
