//! Joint positions along a curve of the tool, on one branch, with derivatives.

use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use thiserror::Error;

use crate::ik::LENGTH;
use crate::{Chain, Solver, measure};

/// Pose of the tool at a curve parameter `u`, with three derivatives to `u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistPoint {
    /// Pose of the tool in the frame of the chain.
    pub pose: Isometry3<f64>,
    /// First to third derivative of the position, m/u^k.
    pub linear: [Vector3<f64>; 3],
    /// Angular velocity and its first two derivatives, rad/u^k, in the axes of the frame.
    pub angular: [Vector3<f64>; 3],
}

/// Joints at one parameter of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowPoint<const N: usize> {
    /// Curve parameter.
    pub u: f64,
    /// Joint positions (rad, m) and their first three derivatives to `u`.
    pub q: [SVector<f64, N>; 4],
}

/// How a curve is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowOptions {
    /// Largest step of a joint between two points of the grid, rad or m; a
    /// larger one means that the branch was left.
    pub longest_step: f64,
    /// Smallest singular value (lengths in units of 0.3 m) at which the arm
    /// still counts as able to move every way.
    pub singular: f64,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self { longest_step: 0.7, singular: 1e-5 }
    }
}

/// What stands in the way of following a curve.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Cause {
    /// The joints do not put the tool where the curve begins.
    #[error("the arm is {distance:.2e} m from where the curve begins")]
    Start {
        /// Distance of the tool from the beginning, m.
        distance: f64,
    },
    /// A joint would have to go beyond a limit.
    #[error("joint {} would have to go {beyond:.3} beyond its limit", joint + 1)]
    Limit {
        /// The joint, from 0.
        joint: usize,
        /// How far beyond, rad or m.
        beyond: f64,
    },
    /// The arm cannot move every way here.
    #[error("singular pose (smallest singular value {smallest:.1e})")]
    Singular {
        /// Smallest singular value, lengths in units of 0.3 m.
        smallest: f64,
    },
    /// No joint position near the last reaches the pose.
    #[error("out of reach: the tool stays {distance:.2e} m away")]
    Reach {
        /// Distance that remains, m.
        distance: f64,
    },
}

/// Where and why a curve cannot be followed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{cause}")]
pub struct FollowError {
    /// Curve parameter at which it happens.
    pub u: f64,
    /// What stands in the way.
    #[source]
    pub cause: Cause,
}

/// Follows a curve of the tool from `start` over an increasing grid of parameters.
///
/// The branch is that of `start`. An arm with more joints than six keeps the
/// surplus joints still: those whose stillness leaves the arm most able to
/// move at the start, and others where that meets an obstacle.
///
/// # Errors
/// [`FollowError`] with the first place that cannot be passed.
pub fn follow<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    grid: &[f64],
    start: &SVector<f64, N>,
    options: &FollowOptions,
) -> Result<Vec<FollowPoint<N>>, FollowError> {
    let chain = solver.chain();
    check_start(chain, tool, grid, start)?;
    let mut furthest: Option<FollowError> = None;
    for free in free_sets(chain, start) {
        match (Follower { chain, tool, free, options }).run(grid, start) {
            Ok(points) => return Ok(points),
            Err(error) if furthest.is_none_or(|f| f.u < error.u) => furthest = Some(error),
            Err(_) => {}
        }
    }
    let none = FollowError { u: 0.0, cause: Cause::Singular { smallest: 0.0 } };
    Err(furthest.unwrap_or(none))
}

fn check_start<const N: usize>(
    chain: &Chain<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    grid: &[f64],
    start: &SVector<f64, N>,
) -> Result<(), FollowError> {
    let u = grid.first().copied().unwrap_or(0.0);
    let gap = chain.forward(start).inv_mul(&tool(u).pose);
    let distance = gap.translation.vector.norm();
    // The negation refuses a distance that is not a number.
    if !(distance <= 1e-4) || !(gap.rotation.angle() <= 1e-3) {
        return Err(FollowError { u, cause: Cause::Start { distance } });
    }
    Ok(())
}

/// Which joints move: all of up to six, else each choice of six, the most able first.
fn free_sets<const N: usize>(chain: &Chain<N>, start: &SVector<f64, N>) -> Vec<Vec<usize>> {
    if N <= 6 {
        return vec![(0..N).collect()];
    }
    let (_, jacobian) = chain.jacobian(start);
    let mut sets: Vec<(f64, Vec<usize>)> = combinations(N, 6)
        .into_iter()
        .map(|set| (smallest_singular(&jacobian, &set), set))
        .collect();
    sets.sort_by(|a, b| b.0.total_cmp(&a.0));
    sets.into_iter().filter(|(ability, _)| *ability > 1e-4).map(|(_, set)| set).collect()
}

fn combinations(of: usize, count: usize) -> Vec<Vec<usize>> {
    (0_u32..1 << of)
        .filter(|bits| bits.count_ones() as usize == count)
        .map(|bits| (0..of).filter(|joint| bits >> joint & 1 == 1).collect())
        .collect()
}

/// Smallest singular value of the columns of the free joints, lengths in units of 0.3 m.
fn smallest_singular<const N: usize>(jacobian: &SMatrix<f64, 6, N>, free: &[usize]) -> f64 {
    let mut moving = SMatrix::<f64, 6, N>::zeros();
    for &joint in free {
        moving.set_column(joint, &jacobian.column(joint));
    }
    moving.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
    // In rising order; what is locked counts as zeros at the front.
    measure::singular_values(&moving)[6 - free.len().min(6)]
}

struct Follower<'a, const N: usize> {
    chain: &'a Chain<N>,
    tool: &'a dyn Fn(f64) -> TwistPoint,
    free: Vec<usize>,
    options: &'a FollowOptions,
}

impl<const N: usize> Follower<'_, N> {
    fn run(
        &self,
        grid: &[f64],
        start: &SVector<f64, N>,
    ) -> Result<Vec<FollowPoint<N>>, FollowError> {
        let mut points: Vec<FollowPoint<N>> = Vec::with_capacity(grid.len());
        let mut last = *start;
        for &u in grid {
            let target = (self.tool)(u);
            let guess = points.last().map_or(*start, |point| {
                let step = u - point.u;
                point.q[0] + point.q[1] * step + point.q[2] * (0.5 * step * step)
            });
            let place = |cause| FollowError { u, cause };
            let q = self
                .close_in(&target.pose, &guess)
                .or_else(|_| self.close_in(&target.pose, &last))
                .map_err(place)?;
            self.check(&q, &last).map_err(place)?;
            points.push(FollowPoint { u, q: self.derivatives(&target, &q).map_err(place)? });
            last = q;
        }
        Ok(points)
    }

    /// Newton's method on the pose error, from a guess nearby.
    fn close_in(
        &self,
        pose: &Isometry3<f64>,
        guess: &SVector<f64, N>,
    ) -> Result<SVector<f64, N>, Cause> {
        const STEPS: usize = 20;
        let mut q = *guess;
        let (mut best, mut at_best) = (f64::INFINITY, q);
        for _ in 0..STEPS {
            let (here, jacobian) = self.chain.jacobian(&q);
            let error = pose_error(pose, &here);
            let size = error.norm();
            // Converged, and the next step no longer helps: rounding is reached.
            if size >= 0.5 * best && best < 1e-9 {
                break;
            }
            if size < best {
                (best, at_best) = (size, q);
            }
            let step = self.solve(&jacobian, &error)?;
            let longest = step.amax();
            q += step * (0.3 / longest.max(0.3));
        }
        if best < 1e-8 { Ok(at_best) } else { Err(Cause::Reach { distance: best }) }
    }

    fn check(&self, q: &SVector<f64, N>, last: &SVector<f64, N>) -> Result<(), Cause> {
        let (lower, upper) = (self.chain.lower(), self.chain.upper());
        for joint in 0..N {
            let beyond = (lower[joint] - q[joint]).max(q[joint] - upper[joint]);
            if beyond > 1e-9 {
                return Err(Cause::Limit { joint, beyond });
            }
        }
        if (q - last).amax() > self.options.longest_step {
            let (_, jacobian) = self.chain.jacobian(last);
            return Err(Cause::Singular { smallest: smallest_singular(&jacobian, &self.free) });
        }
        Ok(())
    }

    /// Solves J q' = t for the free joints; the others stand still.
    fn solve(
        &self,
        jacobian: &SMatrix<f64, 6, N>,
        twist: &Vector6<f64>,
    ) -> Result<SVector<f64, N>, Cause> {
        let singular = || Cause::Singular { smallest: smallest_singular(jacobian, &self.free) };
        let mut step = SVector::zeros();
        if self.free.len() == 6 {
            let square = Matrix6::from_fn(|row, column| jacobian[(row, self.free[column])]);
            let solution = square.lu().solve(twist).ok_or_else(singular)?;
            for (value, &joint) in solution.iter().zip(&self.free) {
                step[joint] = *value;
            }
        } else {
            let square = jacobian.tr_mul(jacobian) + SMatrix::<f64, N, N>::identity() * 1e-14;
            let cholesky = square.cholesky().ok_or_else(singular)?;
            step = cholesky.solve(&jacobian.tr_mul(twist));
        }
        if step.iter().all(|value| value.is_finite()) { Ok(step) } else { Err(singular()) }
    }

    /// Joint derivatives from those of the tool: J q' = t, J q'' = t' - J' q',
    /// J q''' = t'' - 2 J' q'' - J'' q'.
    ///
    /// # Source
    /// B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, eq. 3.108, and its derivative.
    fn derivatives(
        &self,
        target: &TwistPoint,
        q: &SVector<f64, N>,
    ) -> Result<[SVector<f64, N>; 4], Cause> {
        let (_, jacobian) = self.chain.jacobian(q);
        let smallest = smallest_singular(&jacobian, &self.free);
        if self.free.len() == 6 && smallest < self.options.singular {
            return Err(Cause::Singular { smallest });
        }
        let twist = |order: usize| {
            let (v, w) = (target.linear[order], target.angular[order]);
            Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
        };
        let dq = self.solve(&jacobian, &twist(0))?;
        let change = self.chain.jacobian_derivative(q, &dq);
        let ddq = self.solve(&jacobian, &(twist(1) - change * dq))?;
        let second = self.second_change(q, &dq, &ddq);
        let dddq = self.solve(&jacobian, &(twist(2) - change * ddq * 2.0 - second * dq))?;
        Ok([*q, dq, ddq, dddq])
    }

    /// Second derivative of the Jacobian along the path, by central difference.
    fn second_change(
        &self,
        q: &SVector<f64, N>,
        dq: &SVector<f64, N>,
        ddq: &SVector<f64, N>,
    ) -> SMatrix<f64, 6, N> {
        let speed = dq.amax().max(ddq.amax().sqrt());
        if speed <= 0.0 {
            return SMatrix::zeros();
        }
        let h = 1e-4 / speed;
        let at = |h: f64| {
            self.chain.jacobian_derivative(&(q + dq * h + ddq * (0.5 * h * h)), &(dq + ddq * h))
        };
        (at(h) - at(-h)) / (2.0 * h)
    }
}

/// From `here` to `pose`: position difference above rotation vector, axes of the frame.
fn pose_error(pose: &Isometry3<f64>, here: &Isometry3<f64>) -> Vector6<f64> {
    let v = pose.translation.vector - here.translation.vector;
    let w = (pose.rotation * here.rotation.inverse()).scaled_axis();
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}
