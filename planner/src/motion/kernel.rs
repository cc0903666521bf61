//! The code that plans, compiled once for each joint count.
//!
//! A generic function is compiled again in every crate that calls it. What plans a move is large:
//! the kernels of inverse kinematics, of path following and of timing. So [`super::Planner`] calls
//! it through a table of functions, and the tables for 1 to 8 joints are made here, in a function
//! that is not generic. Crates above this one compile the calls only.

use std::any::Any;
use std::borrow::Cow;

use kinematics::{Chain, Solver};
use nalgebra::{Isometry3, SVector};
use realtime::Sample;
use trajectory::ToolLimits;

use super::jog::Direction;
use super::{MotionError, MoveWindow, PlannedMove, Planner, WindowedMove};
use crate::task::{JointMove, LegsMove, Move, ScrewMove};
use crate::timed::TimedTrajectory;
use crate::with_dof;

type Planned<const N: usize> = Result<PlannedMove<N>, MotionError>;

/// Finds postures at a pose, the easiest near the given one first.
type Postures<const N: usize> =
    fn(&Planner<N>, &Isometry3<f64>, &SVector<f64, N>) -> Vec<SVector<f64, N>>;

/// Plans a trajectory whose times are given.
type Timed<const N: usize> =
    fn(&Planner<N>, &TimedTrajectory, &SVector<f64, N>, &ToolLimits) -> Planned<N>;

/// What a planner of `N` joints calls.
#[derive(Clone, Copy)]
pub(super) struct Kernel<const N: usize> {
    pub solver: fn(Chain<N>) -> Solver<N>,
    pub plan: fn(&Planner<N>, &Move, &SVector<f64, N>) -> Planned<N>,
    pub jog: fn(&Planner<N>, &Direction<N>, &SVector<f64, N>, &ToolLimits) -> Planned<N>,
    pub actuate: fn(&Planner<N>, &JointMove, &SVector<f64, N>) -> Planned<N>,
    pub legs: fn(&Planner<N>, &LegsMove, &SVector<f64, N>) -> Planned<N>,
    pub screw: fn(&Planner<N>, &ScrewMove, &SVector<f64, N>) -> Planned<N>,
    pub moving: fn(&Planner<N>, &Move, &Sample<N>) -> Planned<N>,
    pub timed: Timed<N>,
    pub postures: Postures<N>,
    pub windows:
        for<'a> fn(&Planner<N>, Cow<'a, Move>, &SVector<f64, N>) -> Option<WindowedMove<'a, N>>,
    pub window_of: fn(&Planner<N>, &mut WindowedMove<'_, N>) -> Result<MoveWindow<N>, MotionError>,
}

impl<const N: usize> std::fmt::Debug for Kernel<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kernel<{N}>")
    }
}

impl<const N: usize> Kernel<N> {
    /// The table for `N` joints, 1 to 8.
    pub(super) fn get() -> Self {
        const { assert!(N >= 1 && N <= 8, "an arm has 1 to 8 joints") };
        match table(N).downcast_ref::<Self>() {
            Some(kernel) => *kernel,
            None => unreachable!("the table of {N} joints is made for {N} joints"),
        }
    }
}

/// The table for a joint count, 1 to 8: a [`Kernel`] of that many joints.
fn table(dof: usize) -> &'static dyn Any {
    with_dof!(dof, N => {
        const KERNEL: Kernel<N> = Kernel {
            solver: Solver::new,
            plan: Planner::plan_move,
            jog: Planner::plan_jog,
            actuate: Planner::plan_joints,
            legs: Planner::plan_legs,
            screw: Planner::plan_screw,
            moving: Planner::plan_moving,
            timed: Planner::plan_timed,
            postures: Planner::find_postures,
            windows: Planner::begin_windows,
            window_of: Planner::next_window,
        };
        &KERNEL
    })
}
