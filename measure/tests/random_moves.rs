//! Smooth moves through random poses, whose motions the joints rule: searches with the joints find the fast ones.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use measure::{Random, RandomMoves};
use nalgebra::{Isometry3, SVector};
use planner::motion::Planner;
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

/// How long the motion through a walk takes, s.
fn through_walk<const N: usize>(robot: &Robot, size: (usize, u64)) -> Option<f64> {
    let planner = Planner::new(
        &robot.chain::<N>().unwrap(),
        Isometry3::identity(),
        robot.joint_limits::<N>(),
        robot.joint_names(),
    );
    let home = vector::<N>(&robot.home);
    let motion = Move {
        shape: Shape::Smooth,
        poses: walk(&planner, &home, size),
        tolerance: TOLERANCE,
        limits: robot.motion_limits(),
    };
    let planned = planner.plan(&motion, &home).ok()?;
    Some(planned.trajectory.duration())
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
    let moves = RandomMoves {
        shape: Shape::Smooth,
        count: 5,
        seed: 77,
        clock: || 0.0,
    };
    let times = moves.measure(&robot::load("panda").unwrap()).unwrap();
    let time = times[4].motion.unwrap();
    // Known in its middle only it takes 1.57 s.
    assert!(time <= 1.0, "{time} s");
}
