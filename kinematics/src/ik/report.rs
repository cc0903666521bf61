//! Results of the solver: solutions, or why there is none.

use arrayvec::ArrayVec;
use nalgebra::{Isometry3, SVector};
use std::fmt;

/// Largest number of solutions of one pose.
pub const MOST_BRANCHES: usize = 16;

/// One joint position that reaches a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<const N: usize> {
    /// Joint positions, rad or m, inside the limits.
    pub q: SVector<f64, N>,
    /// The branch of the solution (bits: shoulder or base, elbow, wrist); `None` if the arm has no
    /// closed form.
    pub branch: Option<u8>,
}

/// The solutions of one pose, on the stack.
#[derive(Clone, Debug)]
pub struct Branches<const N: usize>(ArrayVec<Solution<N>, MOST_BRANCHES>);

impl<const N: usize> Branches<N> {
    pub(crate) fn new() -> Self {
        Self(ArrayVec::new_const())
    }

    /// Adds a solution while there is room.
    #[inline]
    pub(crate) fn push(&mut self, solution: Solution<N>) {
        let _full = self.0.try_push(solution);
    }
}

impl<const N: usize> std::ops::Deref for Branches<N> {
    type Target = [Solution<N>];

    fn deref(&self) -> &[Solution<N>] {
        &self.0
    }
}

impl<'a, const N: usize> IntoIterator for &'a Branches<N> {
    type Item = &'a Solution<N>;
    type IntoIter = std::slice::Iter<'a, Solution<N>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Why the arm does not reach a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum IkFailure {
    /// The goal holds a value that is not a finite number.
    NotFinite,
    /// Even the position alone is too far, or too near the base.
    OutOfReach {
        /// How far the nearest position is from the goal's, m.
        distance: f64,
    },
    /// The position can be reached, but not with this orientation.
    Orientation {
        /// How far the nearest orientation at that position is from the goal's, rad.
        angle: f64,
    },
    /// The pose could be reached if a joint could go beyond its limit.
    AtLimit {
        /// The joint, counted from 0.
        joint: usize,
        /// How far beyond its limit it would have to go, rad or m.
        beyond: f64,
    },
    /// The search ended near the goal where the arm cannot move on: a singular pose.
    Singular {
        /// Smallest singular value of the Jacobian there (lengths in units of 0.3 m).
        smallest: f64,
    },
}

/// Why a goal is not reached, with the nearest pose that is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkReport<const N: usize> {
    /// The reason.
    pub failure: IkFailure,
    /// Joint positions whose tool pose is the nearest found.
    pub nearest: SVector<f64, N>,
    /// That tool pose.
    pub nearest_pose: Isometry3<f64>,
    /// Its distance from the goal, m.
    pub position_error: f64,
    /// Its angle from the goal, rad.
    pub rotation_error: f64,
}

impl fmt::Display for IkFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "the pose is not finite"),
            Self::OutOfReach { distance } => {
                write!(f, "out of reach by {}", millimetres(*distance))
            }
            Self::Orientation { angle } => {
                write!(
                    f,
                    "in reach, but turned {:.1} degrees too far",
                    angle.to_degrees()
                )
            }
            Self::AtLimit { joint, beyond } => {
                write!(
                    f,
                    "joint {} would have to go {beyond:.3} beyond its limit",
                    joint + 1
                )
            }
            Self::Singular { smallest } => {
                write!(f, "singular pose (smallest singular value {smallest:.1e})")
            }
        }
    }
}

impl<const N: usize> fmt::Display for IkReport<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}; the nearest pose found is off by {} and {:.2} degrees",
            self.failure,
            millimetres(self.position_error),
            self.rotation_error.to_degrees(),
        )
    }
}

impl<const N: usize> std::error::Error for IkReport<N> {}

fn millimetres(length: f64) -> String {
    let mm = length * 1e3;
    if mm < 1.0 {
        format!("{mm:.3} mm")
    } else {
        format!("{mm:.0} mm")
    }
}
