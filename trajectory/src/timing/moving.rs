//! Laws that start from a given state of motion.
//!
//! Such a law cannot be slowed down uniformly, so a feasible one has to be found first. All limits
//! are widened to contain the first guess; the iterate moves to the centre of the feasible set; the
//! limits are narrowed to what it needs; and so on until they are the true ones.

use super::draft::{Draft, MOST_STEPS};
use super::excess::Excess;
use super::grid::Bounded;
use super::gridpoints::Gridpoints;
use super::interior::{Descent, Interior};
use super::problem::Problem;
use crate::TimingError;
use crate::limit::Limit;

/// Times that limits are narrowed.
const NARROWINGS: usize = 60;
/// Newton steps for each.
const STEPS: usize = 6;
/// Times that rows are tightened between the grid points.
const ROUNDS: usize = 10;
/// Share of the law's time in which the reserve grows.
const GROWING: f64 = 0.2;
/// What a given state may exceed the limits by.
const ROUNDING: f64 = 1e-6;

/// The fastest law found over `grid` that meets every bound as it is.
pub(super) fn best<const N: usize>(
    bounded: Bounded<'_, N>,
    gridpoints: &Gridpoints<N>,
    mut problem: Problem,
) -> Result<Draft<N>, TimingError> {
    reserve(
        &mut problem,
        &gridpoints.grid.nodes,
        bounded.options.reserve,
    );
    problem.release_start();
    let mut interior = Interior::new(&problem);
    for round in 0..ROUNDS {
        enter(&mut interior, &problem)?;
        interior.slow_down(&problem);
        let descent = Descent {
            gap: bounded.options.gap,
            first: 0.3,
            steps: MOST_STEPS,
            limit: f64::INFINITY,
        };
        interior.solve(&problem, &descent);
        let draft = Draft::new(bounded, gridpoints, &problem, &interior);
        if draft.audit.stretch_after_first() <= 1.0 {
            return start_holds(draft);
        }
        let excess = Excess::of(&draft).raised(1.0 + 5e-4 * (round + 1) as f64);
        excess.narrow(&mut problem);
        problem.release_start();
    }
    Err(TimingError::StartTooFast {
        ratio: 1.0,
        limit: "between the grid points".to_owned(),
    })
}

/// Narrows the limits by a share that grows from nothing at the start.
fn reserve(problem: &mut Problem, nodes: &[f64], share: f64) {
    let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
        return;
    };
    for (k, node) in nodes.iter().enumerate() {
        let grown = ((node - first) / (GROWING * (last - first))).min(1.0);
        problem.narrow(k, 1.0 / (1.0 - share * grown));
    }
}

/// The draft, if its first piece, which the start state determines, keeps the limits.
fn start_holds<const N: usize>(draft: Draft<N>) -> Result<Draft<N>, TimingError> {
    let (limit, ratio) = draft.audit.first();
    if ratio <= 1.0 + ROUNDING {
        return Ok(draft);
    }
    Err(TimingError::StartTooFast {
        ratio,
        limit: limit.map_or(String::new(), |x: Limit| x.to_string()),
    })
}

/// Goes to a law in which every row has a slack.
fn enter(interior: &mut Interior, problem: &Problem) -> Result<(), TimingError> {
    let mut wide = 1.02 * interior.worst(problem);
    for _ in 0..NARROWINGS {
        if wide <= 1.0 {
            return Ok(());
        }
        let relaxed = problem.relaxed(wide);
        interior.slow_down(&relaxed);
        interior.center(&relaxed, STEPS);
        let worst = interior.worst(problem);
        if worst < 1.0 {
            return Ok(());
        }
        if worst > 0.9995 * wide {
            break;
        }
        wide = worst + 0.2 * (wide - worst);
    }
    Err(TimingError::StartTooFast {
        ratio: wide,
        limit: "any along the way".to_owned(),
    })
}
