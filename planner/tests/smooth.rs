//! Smooth moves beside straight moves to the same poses.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};
use planner::motion::{MotionError, Planner};
use planner::robot::load;
use planner::task::{Move, Shape};

/// Numbers from -1 to 1, the same each time.
///
/// # Source
/// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
fn random(state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    2.0 * (*state >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
}

/// Where straight moves reach all poses in turn, a smooth move is never refused, and never slower: not
/// even where the joints cannot follow the fastest curve of the tool.
#[test]
fn what_straight_moves_reach_is_never_refused() {
    let robot = load("ur5e").unwrap();
    let planner = Planner::new(
        &robot.chain::<6>().unwrap(),
        Isometry3::identity(),
        robot.joint_limits::<6>(),
        robot.joint_names(),
    );
    let (mut state, mut both) = (3, 0);
    for round in 0..ROUNDS {
        let start = SVector::<f64, 6>::from_fn(|_, _| 3.0 * random(&mut state));
        let mut pose = planner.chain().forward(&start);
        let mut next = || {
            let mut vector = || Vector3::from_fn(|_, _| random(&mut state));
            pose.translation.vector += vector() * 0.15;
            pose.rotation *= UnitQuaternion::from_scaled_axis(vector() * 0.4);
            pose
        };
        let poses = vec![next(), next(), next()];
        let smooth = Move {
            shape: Shape::Smooth,
            poses,
            tolerance: 0.01,
            limits: robot.motion_limits(),
        };
        let straight = || -> Result<f64, MotionError> {
            let (mut joints, mut time) = (start, 0.0);
            for pose in &smooth.poses {
                let leg = Move {
                    shape: Shape::Straight,
                    poses: vec![*pose],
                    ..smooth.clone()
                };
                let leg = planner.plan(&leg, &joints)?;
                (joints, time) = (leg.end, time + leg.trajectory.duration());
            }
            Ok(time)
        };
        let Ok(time) = straight() else { continue };
        both += 1;
        let planned = planner.plan(&smooth, &start);
        let planned = planned.unwrap_or_else(|error| panic!("round {round}: {error}"));
        let smooth = planned.trajectory.duration();
        assert!(
            smooth <= time * (1.0 + 1e-6),
            "round {round}: {smooth} s, straight {time} s"
        );
    }
    assert!(both > ROUNDS / 4, "{both}");
}

/// Moves that are tried.
const ROUNDS: usize = 60;
