//! A request to jog the arm.

use std::time::Duration;

use nalgebra::{SVector, UnitQuaternion, Vector3};
use planner::motion::Direction;
use thiserror::Error;

/// What the shares of a jog are about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JogSpace {
    /// One fraction per joint, root first.
    Joint,
    /// Along and about the x, y and z axes of the controlled point.
    Tool,
    /// Along x, y, z and about x, y, z of the workstation, in the controlled point.
    Workstation,
    /// Along x, y, z and about x, y, z of the robot's base, in the controlled point.
    Base,
    /// All joints together towards [`Jog::goal`]: the one fraction is of their largest speeds.
    Goal,
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
    /// How far at most: m of the tool, or rad or m of the joint that moves most. The jog then ends
    /// by itself. None: as far as the arm can go.
    pub distance: Option<f64>,
    /// Where a jog in [`JogSpace::Goal`] ends (rad, m, one per joint).
    pub goal: Vec<f64>,
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
    /// The goal has not one position per joint, or one that is no number.
    #[error("the goal of a jog has {wanted} positions, got {got}")]
    Goal {
        /// How many joints there are.
        wanted: usize,
        /// What was given.
        got: String,
    },
    /// The distance of a step is not a length.
    #[error("a step is longer than 0, got {0}")]
    Distance(f64),
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

/// Orientations in the workstation, for jogs along axes that are not those of the tool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turns {
    /// Of the tool, now.
    pub(super) tool: UnitQuaternion<f64>,
    /// Of the robot's base.
    pub(super) base: UnitQuaternion<f64>,
}

/// The direction of a request; `None` if it asks for rest. A jog along axes of the workstation or of
/// the base is one along the tool's axes, rotated back.
pub(super) fn direction<const N: usize>(
    jog: &Jog,
    turns: &Turns,
) -> Result<Option<Direction<N>>, JogError> {
    let wanted = match jog.space {
        JogSpace::Joint => N,
        JogSpace::Tool | JogSpace::Workstation | JogSpace::Base => 6,
        JogSpace::Goal => 1,
    };
    let speeds = &jog.speeds;
    if speeds.len() != wanted || !speeds.iter().all(|share| (-1.0..=1.0).contains(share)) {
        let got = format!("{speeds:?}");
        return Err(JogError::Speeds { wanted, got });
    }
    if speeds.iter().all(|share| *share == 0.0) {
        return Ok(None);
    }
    let distance = jog.distance.unwrap_or(f64::INFINITY);
    if distance.is_nan() || distance <= 0.0 {
        return Err(JogError::Distance(distance));
    }
    let back = match jog.space {
        JogSpace::Workstation => turns.tool.inverse(),
        JogSpace::Base => turns.tool.inverse() * turns.base,
        _ => UnitQuaternion::identity(),
    };
    Ok(Some(match jog.space {
        JogSpace::Joint => Direction::Joints {
            shares: SVector::from_fn(|joint, _| speeds[joint]),
            distance,
        },
        JogSpace::Tool | JogSpace::Workstation | JogSpace::Base => Direction::Tool {
            linear: back * Vector3::from_column_slice(&speeds[..3]),
            angular: back * Vector3::from_column_slice(&speeds[3..]),
            distance,
        },
        JogSpace::Goal => towards(&jog.goal, speeds[0].abs())?,
    }))
}

fn towards<const N: usize>(goal: &[f64], share: f64) -> Result<Direction<N>, JogError> {
    if goal.len() != N || !goal.iter().all(|position| position.is_finite()) {
        let got = format!("{goal:?}");
        return Err(JogError::Goal { wanted: N, got });
    }
    let joints = SVector::from_column_slice(goal);
    Ok(Direction::Goal { joints, share })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turns() -> Turns {
        Turns {
            tool: UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0),
            base: UnitQuaternion::from_euler_angles(0.0, 0.0, 0.7),
        }
    }

    /// A jog along an axis of the workstation, or of a base that is mounted turned, goes there,
    /// however the tool is turned.
    #[test]
    fn axes_of_workstation_and_base_are_turned_into_the_tool() {
        let turns = turns();
        let still = UnitQuaternion::identity();
        for (space, turn) in [(JogSpace::Workstation, still), (JogSpace::Base, turns.base)] {
            let jog = Jog {
                space,
                speeds: vec![0.0, 0.4, -0.5, 0.1, 0.0, 0.0],
                timeout: Duration::from_millis(100),
                distance: None,
                goal: Vec::new(),
            };
            let Some(Direction::<6>::Tool {
                linear, angular, ..
            }) = direction(&jog, &turns).unwrap()
            else {
                panic!("no direction");
            };
            let (along, about) = (Vector3::new(0.0, 0.4, -0.5), Vector3::new(0.1, 0.0, 0.0));
            assert!((turns.tool * linear - turn * along).norm() < 1e-12);
            assert!((turns.tool * angular - turn * about).norm() < 1e-12);
        }
    }

    #[test]
    fn a_goal_has_a_position_for_each_joint() {
        let jog = |goal: Vec<f64>| Jog {
            space: JogSpace::Goal,
            speeds: vec![0.2],
            timeout: Duration::from_millis(100),
            distance: None,
            goal,
        };
        let turn = turns();
        assert!(direction::<2>(&jog(vec![0.1, 0.2]), &turn).is_ok());
        for wrong in [vec![], vec![0.1], vec![0.1, f64::NAN]] {
            let refused = direction::<2>(&jog(wrong), &turn);
            assert!(matches!(refused, Err(JogError::Goal { wanted: 2, .. })));
        }
        let backwards = Jog {
            distance: Some(-1.0),
            ..jog(vec![0.1, 0.2])
        };
        assert_eq!(
            direction::<2>(&backwards, &turn),
            Err(JogError::Distance(-1.0))
        );
    }
}
