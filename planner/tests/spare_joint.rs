//! Straight moves of arms with seven joints: the spare joint makes them fast.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use kinematics::follow::{FollowOptions, TwistPoint, follow_choosing};
use kinematics::{Chain, Solver};
use nalgebra::{SVector, UnitQuaternion, Vector3};
use planner::motion::{BlockedCause, MotionError, Planner};
use planner::robot::{Robot, load};
use planner::task::{Move, Shape};
use trajectory::{
    HermitePath, HermitePoint, JointPoint, Line, TimingOptions, ToolCurve, ToolLimits, ToolPoint,
    time_path,
};

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

/// Joints well inside their range.
fn somewhere(chain: &Chain<7>, state: &mut u64) -> SVector<f64, 7> {
    SVector::from_fn(|i, _| {
        let (low, high) = (chain.lower()[i], chain.upper()[i]);
        0.5 * (low + high) + 0.4 * (high - low) * random(state)
    })
}

/// A short straight move from somewhere.
fn random_move(robot: &Robot, planner: &Planner<7>, state: &mut u64) -> (SVector<f64, 7>, Move) {
    let start = somewhere(planner.chain(), state);
    let mut goal = planner.chain().forward(&start);
    let mut vector = |size: f64| Vector3::from_fn(|_, _| size * random(state));
    goal.translation.vector += vector(0.15);
    goal.rotation *= UnitQuaternion::from_scaled_axis(vector(0.4));
    let motion = Move {
        shape: Shape::Straight,
        poses: vec![goal],
        tolerance: 0.01,
        limits: robot.motion_limits(),
    };
    (start, motion)
}

/// How long a line takes with the null-space motion that is chosen for ease alone, s.
fn with_ease(
    solver: &Solver<7>,
    line: &Line,
    start: &SVector<f64, 7>,
    (robot, limits): (&Robot, &ToolLimits),
) -> Option<f64> {
    let tool = |u: f64| {
        let ToolPoint {
            pose,
            linear,
            angular,
        } = line.at(u);
        TwistPoint {
            pose,
            linear,
            angular,
            jump: [Vector3::zeros(); 2],
        }
    };
    let grid: Vec<f64> = (0..=80).map(|i| line.end() * f64::from(i) / 80.0).collect();
    let at = (&grid[..], start);
    let (points, _) = follow_choosing(solver, &tool, at, &FollowOptions::default()).ok()?;
    let points = points.iter().map(|point| HermitePoint {
        u: point.u,
        joint: JointPoint { q: point.q },
        jump: point.jump,
    });
    let path = HermitePath::new(points.collect(), line as &dyn ToolCurve)?;
    let joint = robot.joint_limits::<7>();
    let timed = time_path(&path, &joint, limits, &TimingOptions::default()).ok()?;
    Some(timed.trajectory.duration())
}

/// Random straight moves are never slower than with the null-space motion of ease, and faster in the mean: that motion does not look
/// at time.
#[test]
fn the_spare_joint_makes_straight_moves_fast() {
    for (name, expected) in [("panda", 0.97), ("iiwa7", 0.99)] {
        let robot = load(name).unwrap();
        let (planner, limits) = (robot.planner::<7>().unwrap(), robot.motion_limits());
        let solver = Solver::new(*planner.chain());
        let (mut state, mut logs) = (2026, Vec::new());
        while logs.len() < 40 {
            let (start, motion) = random_move(&robot, &planner, &mut state);
            let line = Line::new(planner.chain().forward(&start), motion.poses[0]);
            let Some(ease) = with_ease(&solver, &line, &start, (&robot, &limits)) else {
                continue;
            };
            let planned = planner.plan(&motion, &start).unwrap();
            let ratio = planned.trajectory.duration() / ease;
            assert!(ratio < 1.005, "{name} {}: {ratio}", logs.len());
            assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9, "{name}");
            logs.push(ratio.ln());
        }
        let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        assert!(mean < expected, "{name}: {mean}");
    }
}

/// A straight move whose goal no joint position reaches says so, also where it is out of reach by less than the tolerance of
/// intermediate poses: that the arm comes to a singular pose on the way is not the reason.
#[test]
fn a_goal_out_of_reach_is_named() {
    let robot = load("panda").unwrap();
    let planner = robot.planner::<7>().unwrap();
    let (mut state, mut named) = (2026, 0);
    for i in 0..400 {
        let (start, motion) = random_move(&robot, &planner, &mut state);
        let Err(error) = planner.plan(&motion, &start) else {
            continue;
        };
        if !planner.postures(&motion.poses[0], &start).is_empty() {
            continue;
        }
        let singular = matches!(
            &error,
            MotionError::Blocked {
                cause: BlockedCause::Singular { .. },
                ..
            }
        );
        assert!(!singular, "{i}: {error}");
        named += usize::from(matches!(error, MotionError::OutOfReach { .. }));
    }
    assert!(named > 10, "{named}");
}
