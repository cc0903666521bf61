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
mod draft;
mod evaluate;
mod excess;
mod grid;
mod gridpoints;
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
mod refined;
mod reparametrization;
mod rise;
mod rows;
mod search;
mod state;
mod step_length;

pub use crate::limit::{ActiveSpan, Limit, LimitPeak};
pub use certificate::TimeCertificate;
pub use law::{Law, LawProblem};
pub use least::least_time;
pub use options::{Boundary, TimingOptions};
pub use reach::{ReachGrid, duration as reach_duration};

use grid::{Bounded, Grid};
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
    PathTiming::new(path, joint, tool, options)?.solve()
}

/// About how long the fastest motion along a path takes from rest to rest (s): [`PathTiming::expected`] from a look at the knots
/// and a few places between them, for about a tenth of its work. To compare paths.
///
/// # Errors
/// [`TimingError`] when a limit is not positive, or the path is not finite.
pub fn about_time<const N: usize>(
    path: &dyn Path<N>,
    joint: &JointLimits<N>,
    tool: &ToolLimits,
) -> Result<f64, TimingError> {
    check_joints(joint)?;
    tool.check()?;
    reachability::about(path, joint, tool)
}

/// A path whose fastest law without jerk limits is known: a tenth of the work of [`time_path`], and
/// a bound that tells whether the rest is worth it.
///
/// ```
/// # use nalgebra::{Isometry3, vector};
/// # use trajectory::{JointLimits, JointLine, TimingOptions, ToolLimits, ToolPoint};
/// use trajectory::timing::PathTiming;
/// let still = |_: &trajectory::JointPoint<2>| ToolPoint::still(Isometry3::identity());
/// let line = JointLine::new(vector![0.0, 0.0], vector![1.0, 0.5], still);
/// let limits = JointLimits::uniform(2.0, 10.0, 100.0);
/// let options = TimingOptions::default();
/// let timing = PathTiming::new(&line, &limits, &ToolLimits::UNLIMITED, &options)?;
/// let least = timing.lower_bound();
/// let timed = timing.solve()?;
/// assert!(timed.trajectory.duration() >= least && timed.trajectory.duration() < 1.02 * least);
/// # Ok::<(), trajectory::TimingError>(())
/// ```
#[derive(Clone)]
pub struct PathTiming<'a, const N: usize> {
    bounded: Bounded<'a, N>,
    reachability: ReachabilityPass,
    manner: search::Manner,
}

impl<'a, const N: usize> PathTiming<'a, N> {
    /// Checks the path and finds the fastest law without jerk limits.
    ///
    /// # Errors
    /// As [`time_path`].
    pub fn new(
        path: &'a dyn Path<N>,
        joint: &'a JointLimits<N>,
        tool: &'a ToolLimits,
        options: &'a TimingOptions,
    ) -> Result<Self, TimingError> {
        check_joints(joint)?;
        tool.check()?;
        options.check()?;
        let bounded = Bounded {
            path,
            joint,
            tool,
            options,
        };
        let mut reachability = ReachabilityPass::new(path, joint, tool, options)?;
        reachability.bound = reachability.bound.max(least::chord_bound(bounded));
        Ok(Self {
            bounded,
            reachability,
            manner: search::FAR,
        })
    }

    /// The same with a search that begins near the limits: fewer steps for the same gap, and another law
    /// within it. For paths that are timed once; a search over many paths may depend on the last bits.
    #[must_use]
    pub fn near(self) -> Self {
        Self {
            manner: search::NEAR,
            ..self
        }
    }

    /// No motion along this path within these limits is shorter (s): see
    /// [`TimeCertificate::lower_bound`].
    #[must_use]
    pub fn lower_bound(&self) -> f64 {
        self.reachability.bound
    }

    /// About how long the fastest motion along this path takes (s), no bound: the law without jerk limits
    /// loses the time once in which its accelerations build up.
    #[must_use]
    pub fn expected(&self) -> f64 {
        self.reachability.duration() + self.reachability.ramp
    }

    /// The fastest motion along the path.
    ///
    /// # Errors
    /// As [`time_path`].
    pub fn solve(&self) -> Result<Timed<N>, TimingError> {
        let timed = self.solve_below(f64::INFINITY)?;
        timed.ok_or(TimingError::Unbounded)
    }

    /// The fastest motion along the path; `None`, for less work, if it is not shorter than `limit` (s).
    ///
    /// # Errors
    /// As [`time_path`].
    pub fn solve_below(&self, limit: f64) -> Result<Option<Timed<N>>, TimingError> {
        let draft = draft(self.bounded, &self.reachability, (limit, &self.manner))?;
        Ok(draft.map(|draft| self.finished(draft)))
    }

    /// The motion of a draft, slowed down until it keeps every limit.
    fn finished(&self, draft: draft::Draft<N>) -> Timed<N> {
        let draft::Draft { pieces, audit, .. } = draft;
        // A moving start fixes the law there, so it cannot be stretched and must hold as it is.
        let moving = matches!(self.bounded.options.start, Boundary::Moving { .. });
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
            lower_bound: self.lower_bound(),
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
        Timed {
            trajectory,
            law,
            certificate,
        }
    }
}

/// The best law after the reachability pass. A moving start near the limits may need finer cells
/// than the whole law.
fn draft<const N: usize>(
    bounded: Bounded<'_, N>,
    reachability: &ReachabilityPass,
    goal: (f64, &search::Manner),
) -> Result<Option<draft::Draft<N>>, TimingError> {
    let mut options = *bounded.options;
    let mut refused = None;
    for _ in 0..FINER {
        let grid = Grid::new(
            reachability,
            bounded.path.knots(),
            bounded.path.end(),
            &options,
        );
        let cells = grid.nodes.len() - 1;
        match search::best(bounded, grid, goal) {
            Err(error @ TimingError::StartTooFast { .. }) => refused = refused.or(Some(error)),
            answer => return answer,
        }
        options.cells = Some(2 * cells);
    }
    let unknown = String::new();
    Err(refused.unwrap_or(TimingError::StartTooFast {
        ratio: 1.0,
        limit: unknown,
    }))
}

/// Grids that are tried for a moving start, each twice as fine as the one before.
const FINER: usize = 3;
