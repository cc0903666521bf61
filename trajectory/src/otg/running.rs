//! A running move that is planned again while it runs.

use realtime::Sample;

use super::error::OtgError;
use super::motion::Motion;
use super::plan::plan;
use super::problem::Problem;

/// A running move: advanced in time, and planned again from its state as often as wanted.
///
/// Planning again never makes the arrival later while target, limits and options stay the same: the
/// rest of the running profile is a candidate, and is kept unless the new plan is faster. If
/// planning fails, the running move continues.
///
/// ```
/// use nalgebra::vector;
/// use trajectory::otg::{Limits, Options, Problem, Running, State};
///
/// let mut problem = Problem {
///     start: State::rest(vector![0.0]),
///     target: State::rest(vector![1.0]),
///     limits: Limits::symmetric(vector![1.0], vector![4.0], vector![40.0]),
///     options: Options::default(),
/// };
/// let mut running = Running::new(problem)?;
/// running.advance(0.5);
/// problem.target = State::rest(vector![-1.0]); // another target in the middle of the move
/// running.replan(&problem)?;
/// let end = running.advance(running.remaining());
/// assert_eq!(end.position, vector![-1.0]);
/// # Ok::<(), trajectory::otg::OtgError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Running<const N: usize> {
    asked: Problem<N>,
    motion: Motion<N>,
    elapsed: f64,
}

impl<const N: usize> Running<N> {
    /// Starts the fastest move of `problem`.
    ///
    /// # Errors
    /// See [`OtgError`].
    pub fn new(problem: Problem<N>) -> Result<Self, OtgError> {
        let Problem {
            start,
            target,
            limits,
            options,
        } = &problem;
        let motion = plan(start, target, limits, options)?;
        Ok(Self {
            asked: problem,
            motion,
            elapsed: 0.0,
        })
    }

    /// Advances by `period` (s) and returns the state of the joints then.
    pub fn advance(&mut self, period: f64) -> Sample<N> {
        self.elapsed += period;
        self.motion.sample(self.elapsed)
    }

    /// How long the move still lasts (s), not below zero.
    pub fn remaining(&self) -> f64 {
        (self.motion.duration() - self.elapsed).max(0.0)
    }

    /// The motion that runs, and how long (s) it has been running.
    pub fn motion(&self) -> (&Motion<N>, f64) {
        (&self.motion, self.elapsed)
    }

    /// Plans again from the present state to the target of `problem` under its limits and options;
    /// its start is not used. Returns whether the move was changed.
    ///
    /// # Errors
    /// See [`OtgError`]; the running move then continues unchanged.
    pub fn replan(&mut self, problem: &Problem<N>) -> Result<bool, OtgError> {
        let start = self.motion.sample(self.elapsed).into();
        let Problem {
            target,
            limits,
            options,
            ..
        } = problem;
        let asked = &self.asked;
        let same = (target, limits, options) == (&asked.target, &asked.limits, &asked.options);
        let rest = self.remaining();
        let next = plan(&start, target, limits, options);
        if same && next.as_ref().map_or(true, |next| next.duration() >= rest) {
            return Ok(false);
        }
        self.motion = next?;
        self.asked = Problem { start, ..*problem };
        self.elapsed = 0.0;
        Ok(true)
    }
}
