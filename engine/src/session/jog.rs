//! A request to jog the arm.

use std::time::Duration;

use nalgebra::{SVector, Vector3};
use planner::motion::Direction;
use thiserror::Error;

/// What the shares of a jog are about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JogSpace {
    /// One fraction per joint, root first.
    Joint,
    /// Along and about the x, y and z axes of the controlled point.
    Tool,
}

/// A request to jog the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Jog {
    /// What the shares are about.
    pub space: JogSpace,
    /// Fractions of the largest speeds, -1..=1; all 0 stops.
    pub speeds: Vec<f64>,
    /// The arm stops when no further request comes for this long.
    pub timeout: Duration,
}

/// Why a jog is refused.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum JogError {
    /// The number of speeds is not the number of axes, or one is not within -1 to 1.
    #[error("a jog has {wanted} speeds from -1 to 1, got {got}")]
    Speeds {
        /// How many axes there are.
        wanted: usize,
        /// What was given.
        got: String,
    },
    /// A program is running or waiting.
    #[error("a program is running; canter abort ends it")]
    Program,
    /// A pause or stop is in force.
    #[error("the arm is held; canter resume releases it")]
    Held,
    /// A fault is latched.
    #[error("a fault is latched ({0}); canter recover clears it")]
    Fault(String),
    /// The arm cannot move in that direction.
    #[error("{0}")]
    Motion(String),
    /// The session is over.
    #[error("the session has ended")]
    Closed,
}

/// The direction of a request; `None` if it asks for rest.
pub(super) fn direction<const N: usize>(jog: &Jog) -> Result<Option<Direction<N>>, JogError> {
    let wanted = match jog.space {
        JogSpace::Joint => N,
        JogSpace::Tool => 6,
    };
    let speeds = &jog.speeds;
    if speeds.len() != wanted || !speeds.iter().all(|share| (-1.0..=1.0).contains(share)) {
        let got = format!("{speeds:?}");
        return Err(JogError::Speeds { wanted, got });
    }
    if speeds.iter().all(|share| *share == 0.0) {
        return Ok(None);
    }
    Ok(Some(match jog.space {
        JogSpace::Joint => Direction::Joints(SVector::from_fn(|joint, _| speeds[joint])),
        JogSpace::Tool => Direction::Tool {
            linear: Vector3::from_column_slice(&speeds[..3]),
            angular: Vector3::from_column_slice(&speeds[3..]),
        },
    }))
}
