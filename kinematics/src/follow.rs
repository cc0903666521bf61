//! The continuous joint path for a whole path of the tool.
//!
//! The joints start at the arm's position and change continuously, so the path stays on one branch.
//! At each point the three derivatives of the joints with respect to the path parameter are exact
//! solutions of the differentiated kinematics. Between two points the polynomial of degree seven
//! through both keeps the tool within
//! [`FollowOptions::accuracy`]: points are added where the given grid is too coarse,
//! for example near a singular pose, where joints turn fast over a short distance.

mod differential;
mod ease;
mod error;
mod linear;
mod nearby;
mod null_space;
mod null_space_grid;
mod null_space_path;
mod null_space_spline;
mod price;
mod redundancy;
mod spare;
mod spare_model;
mod trace;

pub use error::{FollowCause, FollowError};
pub use spare::{joint_changes, spare_direction, spare_direction_along};

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
    /// How much the last derivatives of both jump at `u`, m/u3 and rad/u3; given above is what they are after it.
    pub jump: [Vector3<f64>; 2],
}

/// The joints at one path parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowPoint<const N: usize> {
    /// Path parameter.
    pub u: f64,
    /// Joint positions (rad, m) and their first three derivatives to `u`.
    pub q: [SVector<f64, N>; 4],
    /// How much the third derivative jumps at `u`, as that of the tool does; given above is what it is after it.
    pub jump: SVector<f64, N>,
}

impl<const N: usize> FollowPoint<N> {
    /// The joints and their derivatives as they are before `u`.
    pub fn before(&self) -> [SVector<f64, N>; 4] {
        let [q, q1, q2, q3] = self.q;
        [q, q1, q2, q3 - self.jump]
    }
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
    fn(&trace::Task<'_, N>, &SVector<f64, N>) -> Result<redundancy::Resolved<N>, FollowError>;

/// Joint path of a tool path.
///
/// `tool` is the path of the tool. `grid` has the parameters, in rising order, at which points are
/// wanted: the first and last are the ends; knots of the path must be among them. `start` is the
/// joint position of the arm; `tool(grid[0])` must be its pose there. Returns the points of the
/// grid and those added between them.
///
/// For arms with more than six joints, the null-space motion is chosen over the whole path: none if
/// that stays well inside the limits and away from singular poses, otherwise a smooth polynomial that
/// does so where it can, and moves the joints little.
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
    follow_choosing(solver, tool, (grid, start), options).map(|(points, _)| points)
}

/// As [`follow`], with the null-space motion that was chosen, for [`follow_with`] on a finer grid.
///
/// # Errors
/// As [`follow`].
pub fn follow_choosing<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    (grid, start): (&[f64], &SVector<f64, N>),
    options: &FollowOptions,
) -> Result<(Vec<FollowPoint<N>>, NullMotion<N>), FollowError> {
    let task = task(solver, tool, (grid, start), options)?;
    // A constant: only arms with a null space carry the code of the search in it.
    let resolve: Option<Resolve<N>> = const {
        if N > 6 {
            Some(redundancy::resolve::<N>)
        } else {
            None
        }
    };
    let none = null_space::NullSpace::none();
    let resolved = match resolve {
        Some(resolve) => resolve(&task, start),
        None => task
            .trace(start, &none)
            .map(|points| (points, none.clone())),
    };
    resolved.map(|(points, motion)| (points, NullMotion(motion)))
}

/// A null-space motion along a path of the tool that was found by [`follow_choosing`], [`cheaper`] or [`cheaper_near`], or is
/// [given](NullMotion::given).
#[derive(Clone)]
pub struct NullMotion<const N: usize>(null_space::NullSpace<N>);

impl<const N: usize> std::fmt::Debug for NullMotion<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let motion = &self.0;
        let mut shown = f.debug_struct("NullMotion");
        shown.field("directions", &motion.directions);
        shown.field("polynomials", &motion.polynomials);
        shown.field("spline", &motion.spline);
        shown.field("given", &motion.course.is_some()).finish()
    }
}

/// What a joint path costs that is known at a few places, in the unit of the caller: for example about the time that the joints need.
pub type Cost<'a, const N: usize> = dyn Fn(&[FollowPoint<N>]) -> f64 + 'a;

/// A null-space motion along a path that costs less than none, and stays as far inside the limits and
/// away from singular poses. The motion is searched with the first of `costs`,
/// which should be known in little time, then changed to save some of the next. The other arguments are those of [`follow`]; `None`
/// where nothing is found that saves one percent of the last cost, which is always so with six joints or fewer.
///
/// ```
/// use kinematics::follow::{FollowOptions, FollowPoint, TwistPoint, cheaper, follow_with};
/// use kinematics::{Solver, urdf};
/// use nalgebra::{SVector, Vector3};
/// # let text = include_str!("../../robots/panda/robot.urdf");
/// let solver = Solver::new(urdf::read(text, None)?.chain::<7>()?);
/// let q = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
/// let start = solver.chain().forward(&q);
/// let tool = |u: f64| {
///     let mut pose = start;
///     pose.translation.vector.z += 0.1 * u;
///     let linear = [Vector3::z() * 0.1, Vector3::zeros(), Vector3::zeros()];
///     TwistPoint { pose, linear, angular: [Vector3::zeros(); 3], jump: [Vector3::zeros(); 2] }
/// };
/// let options = FollowOptions::default();
/// // The fastest joint should be slow.
/// let cost = |points: &[FollowPoint<7>]| {
///     points.iter().map(|point| point.q[1].amax()).fold(0.0, f64::max)
/// };
/// let at = (&[0.0, 0.5, 1.0][..], &q);
/// if let Some(motion) = cheaper(&solver, &tool, at, &options, &[&cost]) {
///     let points = follow_with(&solver, &tool, at, &options, &motion)?;
///     assert!(points.len() >= 3);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn cheaper<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    (grid, start): (&[f64], &SVector<f64, N>),
    options: &FollowOptions,
    costs: &[&Cost<'_, N>],
) -> Option<NullMotion<N>> {
    let task = task(solver, tool, (grid, start), options).ok()?;
    // A constant: only arms with a null space carry the code of the search in it.
    let search: Option<Search<N>> = const {
        if N > 6 {
            Some(redundancy::cheapest::<N>)
        } else {
            None
        }
    };
    search
        .and_then(|search| search(&task, start, costs))
        .map(NullMotion)
}

/// A search of a null-space motion near a known one, for [`cheaper_near`].
pub struct SpareSearch<'a, const N: usize> {
    /// The motion from which it begins, of the same path.
    pub known: &'a NullMotion<N>,
    /// What a joint path costs, known at a few places, in the unit of the caller.
    pub cost: &'a Cost<'a, N>,
    /// Most motions that are tried.
    pub trials: usize,
}

/// A null-space motion that costs less than a known one, and stays nearly as far inside the limits and away from singular poses: less
/// work than [`cheaper`], as the function of the joints stays and only its values change. The other arguments are those of
/// [`follow`]; `None` where nothing is found that saves one percent, for a motion that is [given](NullMotion::given), and
/// always with six joints or fewer.
///
/// ```
/// use kinematics::follow::{
///     FollowOptions, FollowPoint, SpareSearch, TwistPoint, cheaper_near, follow_choosing, follow_with,
/// };
/// use kinematics::{Solver, urdf};
/// use nalgebra::{SVector, Vector3};
/// # let text = include_str!("../../robots/panda/robot.urdf");
/// let solver = Solver::new(urdf::read(text, None)?.chain::<7>()?);
/// let q = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
/// let start = solver.chain().forward(&q);
/// let tool = |u: f64| {
///     let mut pose = start;
///     pose.translation.vector.z += 0.1 * u;
///     let linear = [Vector3::z() * 0.1, Vector3::zeros(), Vector3::zeros()];
///     TwistPoint { pose, linear, angular: [Vector3::zeros(); 3], jump: [Vector3::zeros(); 2] }
/// };
/// let (at, options) = ((&[0.0, 0.5, 1.0][..], &q), FollowOptions::default());
/// let (points, known) = follow_choosing(&solver, &tool, at, &options)?;
/// // The first joint should end near the middle of its range.
/// let cost = |points: &[FollowPoint<7>]| points[points.len() - 1].q[0][0].abs();
/// let search = SpareSearch { known: &known, cost: &cost, trials: 16 };
/// let motion = cheaper_near(&solver, &tool, at, &options, &search).unwrap();
/// let other = follow_with(&solver, &tool, at, &options, &motion)?;
/// assert!(cost(&other) < cost(&points));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn cheaper_near<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    (grid, start): (&[f64], &SVector<f64, N>),
    options: &FollowOptions,
    search: &SpareSearch<'_, N>,
) -> Option<NullMotion<N>> {
    let SpareSearch {
        known: NullMotion(known),
        cost,
        trials,
    } = *search;
    let task = task(solver, tool, (grid, start), options).ok()?;
    // A constant: only arms with a null space carry the code of the search in it.
    let cheapest: Option<Nearby<N>> = const {
        if N > 6 {
            Some(nearby::cheapest::<N>)
        } else {
            None
        }
    };
    let cheapest = cheapest.filter(|_| known.course.is_none())?;
    cheapest(&task, (start, known), cost, trials).map(NullMotion)
}

/// Searches a null-space motion of less cost than a known one.
type Nearby<const N: usize> = fn(
    &trace::Task<'_, N>,
    (&SVector<f64, N>, &null_space::NullSpace<N>),
    &Cost<'_, N>,
    usize,
) -> Option<null_space::NullSpace<N>>;

/// Searches a null-space motion of least cost.
type Search<const N: usize> =
    fn(&trace::Task<'_, N>, &SVector<f64, N>, &[&Cost<'_, N>]) -> Option<null_space::NullSpace<N>>;

/// The joint path of a tool path with a null-space motion that was found for the same path from the same
/// start, perhaps on another grid.
///
/// # Errors
/// As [`follow`].
pub fn follow_with<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    (grid, start): (&[f64], &SVector<f64, N>),
    options: &FollowOptions,
    motion: &NullMotion<N>,
) -> Result<Vec<FollowPoint<N>>, FollowError> {
    let task = task(solver, tool, (grid, start), options)?;
    task.trace(start, &motion.0)
}

/// A joint path with further points: `grid` has the parameters of all `points`, which were followed with the same
/// null-space motion, and more between them. What is known is not computed again.
///
/// # Errors
/// As [`follow`].
pub fn refine<const N: usize>(
    solver: &Solver<N>,
    tool: &dyn Fn(f64) -> TwistPoint,
    (grid, points): (&[f64], &[FollowPoint<N>]),
    options: &FollowOptions,
    motion: &NullMotion<N>,
) -> Result<Vec<FollowPoint<N>>, FollowError> {
    let task = trace::Task {
        solver,
        tool,
        grid,
        options,
    };
    task.check_grid()?;
    task.refine(points, &motion.0)
}

/// A path to follow, whose grid rises, and at whose start the arm is.
fn task<'a, const N: usize>(
    solver: &'a Solver<N>,
    tool: &'a dyn Fn(f64) -> TwistPoint,
    (grid, start): (&'a [f64], &SVector<f64, N>),
    options: &'a FollowOptions,
) -> Result<trace::Task<'a, N>, FollowError> {
    let task = trace::Task {
        solver,
        tool,
        grid,
        options,
    };
    task.check_grid()?;
    task.check_start(start)?;
    Ok(task)
}
