//! The continuous joint path for a whole path of the tool.
//!
//! The joints start at the arm's position and change continuously, so the path stays on one branch.
//! At each point the three derivatives of the joints with respect to the path parameter are exact
//! solutions of the differentiated kinematics. Between two points the polynomial of degree seven
//! through both keeps the tool within
//! [`FollowOptions::accuracy`]: points are added where the given grid is too coarse,
//! for example near a singular pose, where joints turn fast over a short distance.

mod differential;
mod error;
mod linear;
mod null_space;
mod null_space_path;
mod redundancy;
mod trace;

pub use error::{FollowCause, FollowError};

use crate::ik::Solver;
use nalgebra::{Isometry3, SVector, Vector3};

/// The tool at one path parameter `u`, in the frame of the chain's poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistPoint {
    /// Pose of the tool.
    pub pose: Isometry3<f64>,
    /// First to third derivative of its position, m/u, m/u2, m/u3.
    pub linear: [Vector3<f64>; 3],
    /// Its angular velocity and the first two derivatives of that, rad/u, rad/u2, rad/u3.
    pub angular: [Vector3<f64>; 3],
}

/// The joints at one path parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowPoint<const N: usize> {
    /// Path parameter.
    pub u: f64,
    /// Joint positions (rad, m) and their first three derivatives to `u`.
    pub q: [SVector<f64, N>; 4],
    /// Smallest singular value of the Jacobian (lengths in units of 0.3 m): zero
    /// where the arm is singular.
    pub smallest: f64,
}

/// How closely to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowOptions {
    /// Largest distance (m, and rad times 0.3 m) of the tool from its path between two points.
    pub accuracy: f64,
    /// Most points, those that are added included.
    pub most_points: usize,
    /// Whether the null-space motion of an arm with more than six joints is at rest at both ends.
    /// Set it if the parameter is time and the tool is at rest there.
    pub still_ends: bool,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self {
            accuracy: 1e-7,
            most_points: 50_000,
            still_ends: false,
        }
    }
}

/// Follows a path with a null-space motion.
type Resolve<const N: usize> =
    fn(&trace::Task<'_, N>, &SVector<f64, N>) -> Result<Vec<FollowPoint<N>>, FollowError>;

/// Joint path of a tool path.
///
/// `tool` is the path of the tool. `grid` has the parameters, in rising order, at which points are
/// wanted: the first and last are the ends; knots of the path must be among them. `start` is the
/// joint position of the arm; `tool(grid[0])` must be its pose there. Returns the points of the
/// grid and those added between them.
///
/// For arms with more than six joints, the null-space motion is chosen over the whole path: none if
/// that stays well inside the limits, otherwise the smooth polynomial that stays farthest from
/// limits and singular poses.
///
/// # Errors
/// [`FollowError`]: where, which joint, why, and by how much.
pub fn follow<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    grid: &[f64],
    start: &SVector<f64, N>,
    options: &FollowOptions,
) -> Result<Vec<FollowPoint<N>>, FollowError> {
    let ascends = grid.len() >= 2
        && grid.iter().all(|u| u.is_finite())
        && grid.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascends {
        let u = grid.first().copied().unwrap_or(0.0);
        return Err(FollowError {
            u,
            joint: None,
            cause: FollowCause::BadGrid,
            amount: grid.len() as f64,
        });
    }
    let task = trace::Task {
        solver,
        tool,
        grid,
        options,
    };
    task.check_start(start)?;
    // A constant: only arms with a null space carry the code of the search in it.
    let resolve: Option<Resolve<N>> = const {
        if N > 6 {
            Some(redundancy::resolve::<N>)
        } else {
            None
        }
    };
    match resolve {
        Some(resolve) => resolve(&task, start),
        None => task.trace(start, &null_space::NullSpace::none()),
    }
}
