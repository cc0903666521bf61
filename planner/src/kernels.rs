//! Numeric kernels, compiled once for each joint count.
//!
//! A generic function is compiled again in every crate that calls it. The planner compiles these
//! for 1 to 8 joints anyway; a crate that calls them through [`Kernels`] does not compile them
//! again.

use std::any::Any;

use kinematics::{Branches, Chain, IkReport, Solution, Solver};
use nalgebra::{Isometry3, SVector};
use trajectory::otg::{self, Motion, Otg, OtgError};
use trajectory::{JointLimits, Path, Timed, TimingError, TimingOptions, ToolLimits};

use crate::with_dof;

/// One solution of the inverse kinematics, or why there is none.
type Solved<const N: usize> = Result<Solution<N>, IkReport<N>>;

/// The kernels for `N` joints.
#[derive(Clone, Copy)]
pub struct Kernels<const N: usize> {
    /// [`Solver::new`].
    pub solver: fn(Chain<N>) -> Solver<N>,
    /// [`Solver::nearest`].
    pub nearest: fn(&Solver<N>, &Isometry3<f64>, &SVector<f64, N>) -> Solved<N>,
    /// [`Solver::solve_all`].
    pub branches: fn(&Solver<N>, &Isometry3<f64>) -> Branches<N>,
    /// [`Solver::solve_all_at`].
    pub branches_at: fn(&Solver<N>, &Isometry3<f64>, f64, &SVector<f64, N>) -> Branches<N>,
    /// [`trajectory::time_path`].
    pub time_path: fn(
        &dyn Path<N>,
        &JointLimits<N>,
        &ToolLimits,
        &TimingOptions,
    ) -> Result<Timed<N>, TimingError>,
    /// [`Otg::plan`].
    pub otg: fn(
        &otg::State<N>,
        &otg::State<N>,
        &otg::Limits<N>,
        &otg::Options<N>,
    ) -> Result<Motion<N>, OtgError>,
}

impl<const N: usize> std::fmt::Debug for Kernels<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kernels<{N}>")
    }
}

impl<const N: usize> Kernels<N> {
    /// The kernels for `N` joints, 1 to 8.
    ///
    /// ```
    /// let chain = planner::robot::load("ur5e")?.chain::<6>()?;
    /// let kernels = planner::kernels::Kernels::<6>::get();
    /// assert_eq!((kernels.solver)(chain).family(), kinematics::Solver::new(chain).family());
    /// # Ok::<(), planner::robot::RobotError>(())
    /// ```
    #[must_use]
    pub fn get() -> Self {
        const { assert!(N >= 1 && N <= 8, "an arm has 1 to 8 joints") };
        match table(N).downcast_ref::<Self>() {
            Some(kernels) => *kernels,
            None => unreachable!("the table of {N} joints is made for {N} joints"),
        }
    }
}

/// The table for a joint count, 1 to 8: [`Kernels`] of that many joints.
fn table(dof: usize) -> &'static dyn Any {
    with_dof!(dof, N => {
        const KERNELS: Kernels<N> = Kernels {
            solver: Solver::new,
            nearest: Solver::nearest,
            branches: Solver::solve_all,
            branches_at: Solver::solve_all_at,
            time_path: trajectory::time_path,
            otg: Otg::plan,
        };
        &KERNELS
    })
}
