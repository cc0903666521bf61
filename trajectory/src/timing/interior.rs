//! The interior point method that finds the fastest time law.
//!
//! Every iterate is feasible, so the search may stop at any time.
//!
//! # Source
//! Primal-dual interior point method for convex inequalities (Boyd and Vandenberghe, Convex
//! Optimization, 2004, section 11.7). A pair of bounds `|g| <= 1` is the one inequality
//! `g² - 1 <= 0`. The jerk row `g = sqrt(a) x` is not convex: it enters with the Gauss-Newton
//! part of its curvature, which is the convex inner approximation by its tangent.

use super::band::{self, Band};
use super::evaluate::{Evaluate, Multipliers, Turn, Worth};
use super::newton_system::AssembleNewton;
use super::problem::Problem;
use super::state::State;
use super::step_length::{Measure, StepLength};
use simd::Build;

/// How a law is improved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Descent {
    /// Relative gap of the duration at which to end.
    pub gap: f64,
    /// The assumed relative gap of the start.
    pub first: f64,
    /// Most Newton steps.
    pub steps: usize,
    /// A law that takes this long (s) is of no use.
    pub limit: f64,
}

/// Times the gap that a law may still gain. Until the multipliers meet their equations the gap is an
/// estimate.
const SURE: f64 = 2.0;
/// Largest share of the first error in these equations with which the estimate is used.
const SETTLED: f64 = 0.05;

/// Share of the largest square of the rate that the limits allow, where every row has much slack.
pub(super) const FAR: f64 = 0.75;

/// An iterate of the law with the multipliers of its rows. It can solve all problems over one grid,
/// one after the other.
#[derive(Clone, Debug)]
pub(super) struct Interior {
    /// The unknowns: see [`Problem`].
    pub x: Vec<f64>,
    /// Newton steps taken.
    pub iterations: usize,
    before: Vec<f64>,
    step: Vec<f64>,
    matrix: Band,
    state: State,
    /// Number of rows that count in addition to those of `state`, and the multiplier of all rows
    /// that bound nothing.
    idle: f64,
    idle_multiplier: f64,
    worth: Worth,
    build: Build,
}

impl Interior {
    /// Memory for laws of `problem`; the law is 1 everywhere.
    pub(super) fn new(problem: &Problem) -> Self {
        Self::with(problem, Build::detect())
    }

    /// The same in the given build.
    pub(super) fn with(problem: &Problem, build: Build) -> Self {
        let count = problem.unknowns();
        let state = State::new(problem);
        Self {
            x: vec![1.0; count],
            iterations: 0,
            before: vec![1.0; count],
            step: vec![0.0; count],
            matrix: vec![[0.0; 3]; count],
            idle: problem.counted_rows() as f64 - state.rows() as f64,
            idle_multiplier: 0.0,
            state,
            worth: Worth {
                flat: f64::INFINITY,
                steep: f64::INFINITY,
                time: f64::INFINITY,
            },
            build,
        }
    }

    /// The search continued over another grid, on which the law is this.
    pub(super) fn over(&self, problem: &Problem, law: &[f64]) -> Self {
        let mut over = Self::with(problem, self.build);
        over.x[..law.len()].copy_from_slice(law);
        over.iterations = self.iterations;
        over
    }

    /// How long the law takes (s).
    pub(super) fn time(&self) -> f64 {
        self.worth.time
    }

    /// Computes the value of every row.
    fn evaluate(&mut self, problem: &Problem) {
        self.worth = self.build.run(Evaluate {
            problem,
            x: &self.x,
            state: &mut self.state,
        });
    }

    /// Starts from the law as it is, slowed down so that every row has a slack. A law with a moving
    /// start cannot be slowed down and has to be feasible already.
    pub(super) fn slow_down(&mut self, problem: &Problem) {
        self.slow_down_to(problem, FAR);
    }

    /// The same with the square of the rate at this share of what the limits allow.
    pub(super) fn slow_down_to(&mut self, problem: &Problem, share: f64) {
        self.evaluate(problem);
        let Worth { flat, steep, time } = self.worth;
        let worst = flat.sqrt().max(steep.cbrt());
        if !problem.moving && time.is_finite() && worst.is_finite() && worst > 0.0 {
            let factor = share / worst;
            self.x.iter_mut().for_each(|x| *x *= factor);
            self.evaluate(problem);
        }
    }

    /// Whether every row of the law has a slack.
    fn feasible(&self) -> bool {
        let Worth { flat, steep, time } = self.worth;
        time.is_finite() && flat < 1.0 && steep < 1.0
    }

    /// Improves the law until the relative gap of its duration is below that of `descent`; false if it
    /// ended because the fastest law is not shorter than the limit.
    pub(super) fn solve(&mut self, problem: &Problem, descent: &Descent) -> bool {
        let Descent { gap, limit, .. } = *descent;
        let mut time = self.worth.time;
        let count = problem.counted_rows() as f64;
        let mut mu = descent.first * time / count;
        self.turn(Turn::Balance(mu), mu);
        let (mut sigma, mut error) = (0.3, 1.0);
        for _ in 0..descent.steps {
            let centre = sigma * mu;
            let reach = self.newton(problem, centre);
            let dual = (0.95 / reach.dual).min(1.0);
            let Some(primal) = self.advance(problem, (0.95 / reach.primal).min(1.0)) else {
                break;
            };
            let total = self.turn(Turn::Advance(dual), centre);
            self.iterations += 1;
            let before = time;
            time = self.worth.time;
            mu = total / count;
            let best = primal.min(dual);
            if total < gap * time && best > 0.5 && (before - time).abs() < gap * time {
                break;
            }
            error *= 1.0 - best;
            if error < SETTLED && time - SURE * total >= limit {
                return false;
            }
            sigma = (1.0 - best).powi(2).clamp(0.06, 0.7);
        }
        true
    }

    /// Moves towards the centre of the feasible set, `steps` Newton steps, without regard to time.
    pub(super) fn center(&mut self, problem: &Problem, steps: usize) {
        let mu = 100.0 * self.worth.time / problem.counted_rows() as f64;
        self.turn(Turn::Balance(mu), mu);
        for _ in 0..steps {
            let reach = self.newton(problem, mu);
            let primal = (0.9 / reach.primal).min(1.0);
            if self.advance(problem, primal).is_none() {
                break;
            }
            self.turn(Turn::Advance((0.9 / reach.dual).min(1.0)), mu);
            self.iterations += 1;
        }
    }

    /// The largest ratio of any row to its limit.
    pub(super) fn worst(&mut self, problem: &Problem) -> f64 {
        self.evaluate(problem);
        let Worth { flat, steep, time } = self.worth;
        if time.is_finite() {
            flat.max(steep).sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// Turns the multipliers, those of idle rows towards `mu`; returns the sum of multiplier times
    /// slack.
    fn turn(&mut self, turn: Turn, mu: f64) -> f64 {
        self.idle_multiplier = match turn {
            Turn::Balance(mu) => mu,
            Turn::Advance(factor) => self.idle_multiplier + factor * (mu - self.idle_multiplier),
        };
        let state = &mut self.state;
        let total = self.build.run(Multipliers { state, turn });
        total + self.idle * self.idle_multiplier
    }

    /// Finds the Newton step and those of the multipliers, and how far they may go.
    fn newton(&mut self, problem: &Problem, mu: f64) -> StepLength {
        self.build.run(AssembleNewton {
            problem,
            x: &self.x,
            state: &mut self.state,
            mu,
            matrix: &mut self.matrix,
            step: &mut self.step,
        });
        if problem.moving {
            self.matrix[0] = [1.0, 0.0, 0.0];
            self.matrix[1] = [1.0, 0.0, 0.0];
            self.step[0] = 0.0;
            self.step[1] = 0.0;
        }
        let known = problem.cells() + 2;
        band::solve(&mut self.matrix[..known], &mut self.step[..known]);
        self.step[known..].fill(0.0);
        self.build.run(Measure {
            problem,
            x: &self.x,
            step: &self.step,
            state: &mut self.state,
            mu,
        })
    }

    /// Takes `factor` of the step, or less if a jerk row would be broken. `None` if no part of it
    /// is possible; the law is then unchanged.
    fn advance(&mut self, problem: &Problem, factor: f64) -> Option<f64> {
        self.before.copy_from_slice(&self.x);
        let mut factor = factor;
        for _ in 0..30 {
            for ((x, old), step) in self.x.iter_mut().zip(&self.before).zip(&self.step) {
                *x = old + factor * step;
            }
            self.evaluate(problem);
            if self.feasible() {
                return Some(factor);
            }
            factor *= 0.7;
        }
        self.x.copy_from_slice(&self.before);
        self.evaluate(problem);
        None
    }
}
