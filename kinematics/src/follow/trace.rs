//! Follows a path by continuity, point after point.

use super::differential::{derivatives, task_rows};
use super::error::{FollowCause, FollowError};
use super::linear::solve_once;
use super::null_space::NullSpace;
use super::{FollowOptions, FollowPoint, TwistPoint};
use crate::ik::{Goal, Solver};
use crate::measure;
use crate::measure::LENGTH;
use nalgebra::{Isometry3, SVector};

/// A path to follow.
pub(super) struct Task<'a, const N: usize> {
    pub(super) solver: &'a Solver<N>,
    pub(super) tool: &'a dyn Fn(f64) -> TwistPoint,
    pub(super) grid: &'a [f64],
    pub(super) options: &'a FollowOptions,
}

/// Largest distance from the start of the path that counts as being there, m (rad times
/// [`LENGTH`]).
const START: f64 = 1e-6;
/// Distance at which a point counts as exactly reached.
const EXACT: f64 = 1e-12;
/// Largest distance of the tool (m) that Newton's step leaves, over the square of the step (rad): half the reach
/// of a large arm times the number of joints.
const BEND: f64 = 20.0;
/// Largest acceptable distance where rounding prevents a smaller one.
const ENOUGH: f64 = 1e-10;
/// Largest difference from the predicted joint positions, rad: more is another branch.
const OTHER_BRANCH: f64 = 0.1;
/// Shortest step as a fraction of the whole path.
const SHORTEST: f64 = 1e-9;
/// Tolerance of a joint limit for rounding.
const SLACK: f64 = 1e-9;

/// The largest excess of a joint beyond its limit along a path.
struct Overrun {
    u: f64,
    joint: usize,
    amount: f64,
}

/// Joint positions near which others are searched for, and how well.
pub(super) struct Guess<'a, const N: usize> {
    pub(super) q: &'a SVector<f64, N>,
    /// How far from it a joint of the solution may be (rad, m).
    pub(super) within: f64,
    /// Distance of the tool at which the search ends, m (rad times [`LENGTH`]).
    pub(super) exact: f64,
}

impl<const N: usize> Task<'_, N> {
    /// Checks that the grid rises.
    pub(super) fn check_grid(&self) -> Result<(), FollowError> {
        let grid = self.grid;
        let ascends = grid.len() >= 2
            && grid.iter().all(|u| u.is_finite())
            && grid.windows(2).all(|pair| pair[0] < pair[1]);
        if ascends {
            return Ok(());
        }
        Err(FollowError {
            u: grid.first().copied().unwrap_or(0.0),
            joint: None,
            cause: FollowCause::BadGrid,
            amount: grid.len() as f64,
        })
    }

    /// Checks that the arm is at the start of the path.
    pub(super) fn check_start(&self, start: &SVector<f64, N>) -> Result<(), FollowError> {
        let u = self.grid[0];
        let error = distance(&self.solver.chain().forward(start), &(self.tool)(u).pose);
        if error <= START {
            return Ok(());
        }
        Err(FollowError {
            u,
            joint: None,
            cause: FollowCause::Start,
            amount: error,
        })
    }

    /// The joint path from `start`, with the null-space motion given.
    pub(super) fn trace(
        &self,
        start: &SVector<f64, N>,
        null_space: &NullSpace<N>,
    ) -> Result<Vec<FollowPoint<N>>, FollowError> {
        let first = self.first(start, null_space);
        self.refine(&[first], null_space)
    }

    /// The joint path through the points that are known of it, the first of which is its start: those of the
    /// grid and others between them.
    pub(super) fn refine(
        &self,
        known: &[FollowPoint<N>],
        null_space: &NullSpace<N>,
    ) -> Result<Vec<FollowPoint<N>>, FollowError> {
        let Some((first, ahead)) = known.split_first() else {
            return Err(self.error(self.grid[0], FollowCause::BadGrid, 0.0));
        };
        let (mut last, mut ahead) = (*first, ahead.iter().peekable());
        // Whether nothing has come between the last point and the next one that is known.
        let mut joined = true;
        let mut points = Vec::with_capacity(self.grid.len().max(known.len()));
        points.push(last);
        let mut overrun = self.overrun(last.u, &last.q[0]);
        for &goal in &self.grid[1..] {
            while last.u < goal {
                if points.len() >= self.options.most_points {
                    let amount = points.len() as f64;
                    return Err(self.error(last.u, FollowCause::TooManyPoints, amount));
                }
                // What is known of a place that was reached otherwise is of no use.
                while ahead.next_if(|point| point.u <= last.u).is_some() {}
                let next = ahead
                    .next_if(|point| point.u <= goal && (joined || self.is_close(&last, point)));
                joined = next.is_some();
                last = match next {
                    Some(next) => *next,
                    None => self.advance(&last, goal, null_space)?,
                };
                points.push(last);
                let next = self.overrun(last.u, &last.q[0]);
                if next.amount > overrun.amount {
                    overrun = next;
                }
            }
        }
        if overrun.amount > SLACK {
            let Overrun { u, joint, amount } = overrun;
            let joint = Some(joint);
            return Err(FollowError {
                joint,
                ..self.error(u, FollowCause::Limit, amount)
            });
        }
        Ok(points)
    }

    fn error(&self, u: f64, cause: FollowCause, amount: f64) -> FollowError {
        FollowError {
            u,
            joint: None,
            cause,
            amount,
        }
    }

    fn first(&self, start: &SVector<f64, N>, null_space: &NullSpace<N>) -> FollowPoint<N> {
        let u = self.grid[0];
        let still = FollowPoint {
            u,
            q: [*start, SVector::zeros(), SVector::zeros(), SVector::zeros()],
            jump: SVector::zeros(),
        };
        let seen = (self.tool)(u);
        // The start may be off by rounding; the path continues from the exact point.
        let exact = self.settle(&still, (u, &seen), null_space);
        self.finish((u, &seen), &exact.unwrap_or(*start), &still, null_space)
    }

    /// The farthest point that one step reaches towards `goal`.
    fn advance(
        &self,
        last: &FollowPoint<N>,
        goal: f64,
        null_space: &NullSpace<N>,
    ) -> Result<FollowPoint<N>, FollowError> {
        let shortest = SHORTEST * (self.grid[self.grid.len() - 1] - self.grid[0]);
        let mut u = goal;
        loop {
            if let Some(point) = self.step(last, u, null_space) {
                return Ok(point);
            }
            let half = 0.5 * (last.u + u);
            if u - last.u < shortest || half <= last.u || half >= u {
                return Err(self.refusal(last, u));
            }
            u = half;
        }
    }

    /// One step, or `None` if it is too long to stay on the branch for certain.
    fn step(
        &self,
        last: &FollowPoint<N>,
        u: f64,
        null_space: &NullSpace<N>,
    ) -> Option<FollowPoint<N>> {
        let seen = (self.tool)(u);
        let q = self.settle(last, (u, &seen), null_space)?;
        let point = self.finish((u, &seen), &q, last, null_space);
        self.is_close(last, &point).then_some(point)
    }

    /// Whether the polynomial between two points is near enough to the path in the middle.
    fn is_close(&self, last: &FollowPoint<N>, point: &FollowPoint<N>) -> bool {
        let middle = midpoint(last, point);
        let pose = (self.tool)(0.5 * (last.u + point.u)).pose;
        distance(&self.solver.chain().forward(&middle), &pose) <= self.options.accuracy
    }

    /// Joint positions at `u`, near those predicted from the last point.
    fn settle(
        &self,
        last: &FollowPoint<N>,
        (u, seen): (f64, &TwistPoint),
        null_space: &NullSpace<N>,
    ) -> Option<SVector<f64, N>> {
        let guess = Guess {
            q: &predict(last, u),
            within: OTHER_BRANCH,
            exact: EXACT,
        };
        self.newton(&guess, &seen.pose, null_space, &null_space.at(u))
    }

    /// Joint positions at a pose of the tool near a guess, with given values of the spare functions.
    pub(super) fn newton(
        &self,
        guess: &Guess<'_, N>,
        pose: &Isometry3<f64>,
        null_space: &NullSpace<N>,
        at: &[f64; 2],
    ) -> Option<SVector<f64, N>> {
        let target = Goal::Pose(*pose).target();
        let mut q = *guess.q;
        let mut reached = f64::INFINITY;
        for _ in 0..12 {
            let (pose_error, jacobian) = self.solver.pose_error_of(&target, &q);
            let rows = task_rows(&jacobian, null_space);
            let mut b = [0.0; 8];
            b[..6].copy_from_slice(&pose_error.rows);
            for k in 0..N.saturating_sub(6) {
                b[6 + k] = at[k] - null_space.direction(k).dot(&q);
            }
            let error = b.iter().fold(0.0_f64, |most, value| most.max(value.abs())) * LENGTH;
            if error <= guess.exact || (error <= ENOUGH && error > 0.5 * reached) {
                return Some(q);
            }
            if !error.is_finite() || error > 4.0 * reached {
                return None;
            }
            reached = error;
            let x = solve_once::<N>(self.solver.chain().build(), &rows, &b);
            let step = SVector::from_fn(|i, _| x[i]);
            q += step;
            if (q - *guess.q).amax() > guess.within {
                return None;
            }
            // What is left then is of second order in the step, and need not be computed.
            if BEND * step.norm_squared() <= guess.exact {
                return Some(q);
            }
        }
        None
    }

    /// A point with its derivatives.
    fn finish(
        &self,
        (u, seen): (f64, &TwistPoint),
        q: &SVector<f64, N>,
        last: &FollowPoint<N>,
        null_space: &NullSpace<N>,
    ) -> FollowPoint<N> {
        let h = u - last.u;
        let prior = [
            last.q[1] + last.q[2] * h + last.q[3] * (0.5 * h * h),
            last.q[2] + last.q[3] * h,
            last.q[3],
        ];
        let (_, jacobian) = self.solver.chain().jacobian(q);
        let ([q1, q2, q3], jump) = derivatives(&jacobian, (u, seen), null_space, &prior);
        FollowPoint {
            u,
            q: [*q, q1, q2, q3],
            jump,
        }
    }

    /// The joints and their derivatives at a point of a path where the first spare function has another value: by so much more than the
    /// motion says, the same all along the path.
    pub(super) fn beside(
        &self,
        point: &FollowPoint<N>,
        null_space: &NullSpace<N>,
        by: f64,
    ) -> Option<[SVector<f64, N>; 4]> {
        let u = point.u;
        let seen = (self.tool)(u);
        let (_, jacobian) = self.solver.chain().jacobian(&point.q[0]);
        let rows = task_rows(&jacobian, null_space);
        let mut b = [0.0; 8];
        b[6] = by;
        let x = solve_once::<N>(self.solver.chain().build(), &rows, &b);
        let guess = Guess {
            q: &(point.q[0] + SVector::from_fn(|i, _| x[i])),
            within: OTHER_BRANCH,
            exact: EXACT,
        };
        let [first, second] = null_space.at(u);
        let q = self.newton(&guess, &seen.pose, null_space, &[first + by, second])?;
        Some(self.finish((u, &seen), &q, point, null_space).q)
    }

    fn overrun(&self, u: f64, q: &SVector<f64, N>) -> Overrun {
        let chain = self.solver.chain();
        let mut worst = Overrun {
            u,
            joint: 0,
            amount: f64::NEG_INFINITY,
        };
        for joint in 0..N {
            let amount = (q[joint] - chain.upper()[joint]).max(chain.lower()[joint] - q[joint]);
            if amount > worst.amount {
                worst = Overrun { u, joint, amount };
            }
        }
        worst
    }

    /// Why no step from a point is possible, however short.
    #[cold]
    fn refusal(&self, last: &FollowPoint<N>, u: f64) -> FollowError {
        let fastest = last.q[1].iamax();
        self.unreachable(u, &last.q[0]).unwrap_or(FollowError {
            u,
            joint: Some(fastest),
            cause: FollowCause::Singular,
            amount: measure::dexterity(self.solver.chain(), &last.q[0]).smallest,
        })
    }

    /// Why the arm does not reach the pose at a parameter, wherever it comes from; `None` where it does.
    #[cold]
    pub(super) fn unreachable(&self, u: f64, seed: &SVector<f64, N>) -> Option<FollowError> {
        let report = self.solver.nearest(&(self.tool)(u).pose, seed).err()?;
        let amount = report.position_error.max(report.rotation_error);
        Some(self.error(u, FollowCause::Unreachable(report.failure), amount))
    }
}

/// Distance of two poses, m, angles times [`LENGTH`].
fn distance(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let position = (a.translation.vector - b.translation.vector).norm();
    // Twice the vector part of the quaternion between them is the angle when it is small.
    let angle = 2.0 * (a.rotation.inverse() * b.rotation).imag().norm();
    let error = position.max(angle * LENGTH);
    if error.is_nan() { f64::INFINITY } else { error }
}

/// Joint positions at `u` from the derivatives at a point.
fn predict<const N: usize>(last: &FollowPoint<N>, u: f64) -> SVector<f64, N> {
    let h = u - last.u;
    last.q[0] + (last.q[1] + (last.q[2] + last.q[3] * (h / 3.0)) * (h / 2.0)) * h
}

/// Middle of the polynomial of degree seven through two points and their derivatives,
/// as its eight control points give it.
fn midpoint<const N: usize>(a: &FollowPoint<N>, b: &FollowPoint<N>) -> SVector<f64, N> {
    let h = b.u - a.u;
    let side = |[q, q1, q2, q3]: [SVector<f64, N>; 4], h: f64| {
        let one = q + q1 * (h / 7.0);
        let two = one * 2.0 - q + q2 * (h * h / 42.0);
        let three = two * 3.0 - one * 3.0 + q + q3 * (h * h * h / 210.0);
        q + one * 7.0 + two * 21.0 + three * 35.0
    };
    (side(a.q, h) + side(b.before(), -h)) / 128.0
}
