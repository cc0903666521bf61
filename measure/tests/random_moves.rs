//! Smooth moves through random poses, whose motions the joints rule: searches with the joints find the fast ones.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use measure::{Random, RandomMoves};
use nalgebra::{Isometry3, SVector};
use planner::motion::{MotionError, Planner};
use planner::robot::{self, Robot, vector};
use planner::task::{Move, Shape};

/// How far from home a walk of the joints goes, and one step of it, rad.
const REACH: f64 = 1.0;
const STEP: f64 = 0.25;
/// Radius of the ball round each intermediate pose, m.
const TOLERANCE: f64 = 0.01;

/// Poses that an arm passes whose joints walk at random from home.
fn walk<const N: usize>(
    planner: &Planner<N>,
    home: &SVector<f64, N>,
    (count, seed): (usize, u64),
) -> Vec<Isometry3<f64>> {
    let (mut random, mut joints) = (Random::scattered(seed), *home);
    let mut next = || {
        joints = SVector::from_fn(|j, _| {
            let step = random.between(-STEP, STEP);
            (joints[j] + step).clamp(home[j] - REACH, home[j] + REACH)
        });
        planner.chain().forward(&joints)
    };
    (0..count).map(|_| next()).collect()
}

/// A smooth move through poses.
fn smooth(robot: &Robot, poses: Vec<Isometry3<f64>>) -> Move {
    Move {
        shape: Shape::Smooth,
        poses,
        tolerance: TOLERANCE,
        limits: robot.motion_limits(),
    }
}

/// How long the motion through a walk takes, s.
fn through_walk<const N: usize>(robot: &Robot, size: (usize, u64)) -> Option<f64> {
    let (planner, home) = (robot.planner().unwrap(), vector::<N>(&robot.home));
    let motion = smooth(robot, walk(&planner, &home, size));
    let planned = planner.plan(&motion, &home).ok()?;
    Some(planned.trajectory.duration())
}

/// How long the last of so many random smooth moves takes, s.
fn through_random(robot: &Robot, (count, seed): (usize, u64)) -> f64 {
    let moves = RandomMoves {
        shape: Shape::Smooth,
        count,
        seed,
        clock: || 0.0,
    };
    let times = moves.measure(robot).unwrap();
    times[count - 1].motion.unwrap()
}

/// Walks of 28 poses, from curves of the tool that are found by short searches. From the fastest curve of the tool the first took 4.219 s,
/// and no motion was found through the second.
#[test]
fn many_poses_are_searched_from_rough_curves() {
    let panda = robot::load("panda").unwrap();
    for (seed, most) in [(4, 4.15), (5, 3.9)] {
        let time = through_walk::<7>(&panda, (28, seed)).unwrap();
        println!("{seed}: {time} s");
        assert!(time <= most, "{seed}: {time} s, not {most}");
    }
    let time = through_walk::<6>(&robot::load("ur5e").unwrap(), (28, 1)).unwrap();
    assert!(time <= 6.45, "{time} s");
}

/// Random moves of a Panda along which its spare joint turns far: one function of the joints tells where it is all along.
#[test]
fn the_spare_joint_is_known_along_the_whole_motion() {
    let time = through_random(&robot::load("panda").unwrap(), (5, 77));
    // Known in its middle only it takes 1.57 s.
    assert!(time <= 1.0, "{time} s");
}

/// A walk of 32 poses whose fast curves the joints of a Panda cannot follow, which was refused; and a random move of a UR5e that
/// took 3.45 s from curves alone.
#[test]
fn a_search_begins_at_straight_moves_too() {
    let time = through_walk::<7>(&robot::load("panda").unwrap(), (32, 5)).unwrap();
    assert!(time <= 4.5, "{time} s");
    let time = through_random(&robot::load("ur5e").unwrap(), (9, 12));
    assert!(time <= 2.8, "{time} s");
}

/// Walks of 12 poses from home: what is refused names the pose that cannot be reached, and what straight moves reach is not refused.
#[test]
fn many_poses_are_refused_for_their_reason() {
    let robot = robot::load("ur5e").unwrap();
    let (planner, home) = (robot.planner().unwrap(), vector::<6>(&robot.home));
    let is_straight = |motion: &Move| {
        let mut joints = home;
        motion.poses.iter().all(|pose| {
            let leg = Move {
                shape: Shape::Straight,
                ..smooth(&robot, vec![*pose])
            };
            let planned = planner.plan(&leg, &joints);
            planned.is_ok_and(|planned| {
                joints = planned.end;
                true
            })
        })
    };
    let mut straight = 0;
    for seed in 0..12 {
        let mut motion = smooth(&robot, walk(&planner, &home, (12, seed)));
        let planned = planner.plan(&motion, &home);
        if is_straight(&motion) {
            straight += 1;
            assert!(planned.is_ok(), "{seed}: {:?}", planned.err());
        }
        motion.poses[6].translation.vector.x += 3.0;
        let error = planner.plan(&motion, &home).unwrap_err();
        let named = matches!(error, MotionError::OutOfReach { pose: 7, .. });
        assert!(named, "{seed}: {error}");
    }
    assert!(straight > 6, "{straight} of 12");
}
