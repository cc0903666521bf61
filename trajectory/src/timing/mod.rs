//! The fastest time law along a given path.
//!
//! A reachability pass over the path gives the fastest law without jerk limits. Smoothed, it
//! becomes the parameter in which the final law is computed: a C1, piecewise quadratic squared
//! rate, found by an interior point method under all limits at once. The law then becomes quintic
//! pieces in time, and every limit is bounded on the pieces themselves, for all times.

mod audit;
mod band;
mod block;
mod bound;
mod certificate;
mod evaluate;
mod grid;
mod gridpoints;
mod hull;
mod interior;
mod joint;
mod law;
mod least;
mod lines;
mod moving;
mod newton_system;
mod options;
mod pieces;
mod problem;
mod reach;
mod reachability;
mod reparametrization;
mod rows;
mod search;

mod state;
mod step_length;
mod tighten;

pub use crate::limit::{ActiveSpan, Limit, LimitPeak};
pub use certificate::TimeCertificate;
pub use law::{Law, LawProblem};
pub use least::least_time;
pub use options::{Boundary, TimingOptions};
pub use reach::{ReachGrid, duration as reach_duration};

use grid::{Bounded, Grid};
use gridpoints::Gridpoints;
use reachability::ReachabilityPass;

use crate::limits::check_joints;
use crate::{JointLimits, Path, TimingError, ToolLimits, Trajectory};

/// A path with its time law.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed<const N: usize> {
    /// The motion: C2 quintic pieces in time (rad, s).
    pub trajectory: Trajectory<N>,
    /// The path parameter over time, on the same pieces.
    pub law: Trajectory<1>,
    /// What is known for certain about it.
    pub certificate: TimeCertificate,
}

/// The fastest motion along `path` within the limits.
///
/// # Errors
/// [`TimingError`] when a limit or an option is not positive, when the path is not finite or has
/// a corner, or when a moving start cannot be continued.
pub fn time_path<const N: usize>(
    path: &dyn Path<N>,
    joint: &JointLimits<N>,
    tool: &ToolLimits,
    options: &TimingOptions,
) -> Result<Timed<N>, TimingError> {
    check_joints(joint)?;
    tool.check()?;
    options.check()?;
    let reachability = ReachabilityPass::new(path, joint, tool, options)?;
    let bounded = Bounded {
        path,
        joint,
        tool,
        options,
    };
    let draft = draft(bounded, &reachability)?;
    let tighten::Draft { pieces, audit, .. } = draft;
    // A moving start fixes the law there, so it cannot be stretched and must hold as it is.
    let moving = matches!(options.start, Boundary::Moving { .. });
    let stretch = if moving {
        1.0
    } else {
        audit.stretch * (1.0 + 1e-12)
    };
    let trajectory = Trajectory::new(pieces.joint).into_stretched(stretch);
    let law = Trajectory::new(pieces.law).into_stretched(stretch);
    let certificate = TimeCertificate {
        peaks: audit.peaks(stretch),
        active: audit.active(stretch),
        duration: trajectory.duration(),
        lower_bound: reachability.bound.max(least::chord_bound(bounded)),
        fit_error: pieces.fit_error,
        tool_margin: audit.tool_margin,
        stretch,
        given: if moving {
            trajectory.pieces()[0].duration
        } else {
            0.0
        },
        cells: draft.cells,
        iterations: draft.iterations,
    };
    Ok(Timed {
        trajectory,
        law,
        certificate,
    })
}

/// The best law after the reachability pass. A moving start near the limits may need finer cells
/// than the whole law.
fn draft<const N: usize>(
    bounded: Bounded<'_, N>,
    reachability: &ReachabilityPass,
) -> Result<tighten::Draft<N>, TimingError> {
    let mut options = *bounded.options;
    let mut refused = None;
    for _ in 0..FINER {
        let grid = Grid::new(
            reachability,
            bounded.path.knots(),
            bounded.path.end(),
            &options,
        );
        match search::best(bounded, &Gridpoints::new(bounded, &grid)) {
            Err(error @ TimingError::StartTooFast { .. }) => refused = refused.or(Some(error)),
            answer => return answer,
        }
        options.cells = Some(2 * (grid.nodes.len() - 1));
    }
    let limit = String::new();
    Err(refused.unwrap_or(TimingError::StartTooFast { ratio: 1.0, limit }))
}

/// Grids that are tried for a moving start, each twice as fine as the one before.
const FINER: usize = 3;
