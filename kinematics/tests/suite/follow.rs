//! Following a tool path: exact, continuous, with correct derivatives, or a clear refusal.

use crate::arms::{self, SEVEN, SIX};
use crate::ik::error;
use kinematics::follow::{
    Cost, NullMotion, SpareSearch, cheaper, cheaper_near, follow_choosing, follow_with, refine,
    spare_direction,
};
use kinematics::{FollowCause, FollowOptions, FollowPoint, IkFailure, Solver, TwistPoint, follow};
use nalgebra::{Isometry3, SVector, Translation3, Unit, UnitQuaternion, Vector3};

/// Positions in which the shipped arms stand well.
fn ready<const N: usize>(name: &str) -> SVector<f64, N> {
    let q: &[f64] = match name {
        "ur5e" | "ur10e" => &[0.1, -1.6, 1.5, -1.5, -1.6, 0.2],
        "xarm6" => &[0.1, -0.5, -0.8, 0.1, 1.3, 0.0],
        "lrmate200id" => &[0.1, 0.2, 0.0, 0.1, -1.3, 0.0],
        "tx2_60" => &[0.1, 0.5, 1.3, 0.1, 1.3, 0.0],
        "gantry" => &[1.0, 1.0, 0.75, 0.1, 0.2, 0.1],
        "panda" | "fr3" => &[0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8],
        "iiwa7" | "iiwa14" => &[0.1, 0.5, 0.1, -1.4, 0.1, 1.2, 0.1],
        "xarm7" => &[0.1, -0.4, 0.1, 0.9, 0.1, 1.3, 0.1],
        _ => &[0.1, 0.3, 0.2, 0.1, 1.0, 0.1],
    };
    SVector::from_column_slice(q)
}

/// A curve with a turn: `u` from 0 to 1, about 0.2 m and 0.5 rad long.
fn curve(start: &Isometry3<f64>, scale: f64) -> impl Fn(f64) -> TwistPoint + use<> {
    let (p, r) = (start.translation.vector, start.rotation);
    let axis = Unit::new_normalize(Vector3::new(0.3, 1.0, -0.4));
    move |u| {
        let (s, c) = (3.0 * u).sin_cos();
        let angle = 0.5 * scale * u * u;
        let wave = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) * scale;
        TwistPoint {
            pose: Isometry3::from_parts(
                Translation3::from(p + wave(0.1 * u, 0.05 * s, 0.04 * (c - 1.0))),
                UnitQuaternion::from_axis_angle(&axis, angle) * r,
            ),
            linear: [
                wave(0.1, 0.15 * c, -0.12 * s),
                wave(0.0, -0.45 * s, -0.36 * c),
                wave(0.0, -1.35 * c, 1.08 * s),
            ],
            angular: [
                axis.into_inner() * scale * u,
                axis.into_inner() * scale,
                Vector3::zeros(),
            ],
            jump: [Vector3::zeros(); 2],
        }
    }
}

fn follows<const N: usize>(name: &str) {
    let solver = Solver::new(arms::chain::<N>(name));
    let start = ready::<N>(name);
    let tool = curve(&solver.chain().forward(&start), 1.0);
    let grid: Vec<f64> = (0..=1000).map(|i| f64::from(i) / 1000.0).collect();
    let points = follow(&solver, &tool, &grid, &start, &FollowOptions::default())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(
        grid.iter()
            .all(|u| points.iter().any(|point| point.u == *u)),
        "{name}"
    );
    for pair in points.windows(2) {
        let [a, b] = pair else { unreachable!() };
        let (position, rotation) = error(&solver.chain().forward(&b.q[0]), &tool(b.u).pose);
        assert!(
            position < 1e-10 && rotation < 1e-9,
            "{name}: off by {position} m, {rotation} rad"
        );
        // Each derivative is that of the one before: compared over a step, by trapezoids.
        let h = b.u - a.u;
        for k in 0..3 {
            let change = (b.q[k] - a.q[k]) / h;
            let mean = (a.q[k + 1] + b.q[k + 1]) / 2.0;
            let bound = 1e-6 * (1.0 + mean.amax()) + h * h * 2e3;
            assert!(
                (change - mean).amax() < bound,
                "{name}: derivative {} at {}: {change} against {mean}",
                k + 1,
                a.u
            );
        }
    }
}

#[test]
fn joint_paths_are_exact_and_continuous() {
    SIX.iter().for_each(|name| follows::<6>(name));
    SEVEN.iter().for_each(|name| follows::<7>(name));
}

/// A tool from rest whose jerk (m/u3, rad/u3) changes its sign at `u` 0.5, and whether it says by how much.
fn jerked(start: &Isometry3<f64>, told: bool) -> impl Fn(f64) -> TwistPoint + use<> {
    let start = *start;
    let (along, about) = (Vector3::new(-0.3, 0.3, -0.2), Vector3::new(0.4, 0.6, -0.5));
    move |u| {
        // The jerk is 1, then -1.
        let late = (u - 0.5).max(0.0);
        let jerk = if u < 0.5 { 1.0 } else { -1.0 };
        let way = [
            u.powi(3) / 6.0 - late.powi(3) / 3.0,
            u * u / 2.0 - late * late,
            u - 2.0 * late,
            jerk,
        ];
        let jump = if told && u == 0.5 { -2.0 } else { 0.0 };
        TwistPoint {
            pose: Isometry3::from_parts(
                Translation3::from(start.translation.vector + along * way[0]),
                UnitQuaternion::from_scaled_axis(about * way[0]) * start.rotation,
            ),
            linear: [1, 2, 3].map(|k| along * way[k]),
            angular: [1, 2, 3].map(|k| about * way[k]),
            jump: [along * jump, about * jump],
        }
    }
}

fn jumps<const N: usize>(name: &str) {
    let solver = Solver::new(arms::chain::<N>(name));
    let start = ready::<N>(name);
    let followed = |told: bool| {
        let tool = jerked(&solver.chain().forward(&start), told);
        let grid = [0.0, 0.5, 1.0];
        follow(&solver, &tool, &grid, &start, &FollowOptions::default()).unwrap()
    };
    let (points, more) = (followed(true), followed(false));
    assert!(points.len() < more.len(), "{name}: {}", points.len());
    let knot = points.iter().position(|point| point.u == 0.5).unwrap();
    // What the third derivative is on either side is what the second one changes by there.
    let tool = jerked(&solver.chain().forward(&start), true);
    let fine: Vec<f64> = (0..=2000).map(|i| f64::from(i) / 2000.0).collect();
    let fine = follow(&solver, &tool, &fine, &start, &FollowOptions::default()).unwrap();
    let middle = fine.iter().position(|point| point.u == 0.5).unwrap();
    let change = |i: usize| (fine[i + 1].q[2] - fine[i].q[2]) / (fine[i + 1].u - fine[i].u);
    let point = &points[knot];
    let size = 1.0 + point.q[3].amax();
    assert!((point.jump).amax() > 0.5, "{name}: {}", point.jump);
    assert!(
        (point.before()[3] - change(middle - 1)).amax() < 0.02 * size,
        "{name}"
    );
    assert!((point.q[3] - change(middle)).amax() < 0.02 * size, "{name}");
    let others = points.iter().filter(|point| point.u != 0.5);
    assert!(
        others
            .into_iter()
            .all(|point| point.jump == SVector::<f64, N>::zeros()),
        "{name}"
    );
}

/// Where the tool's jerk jumps, that of the joints does, and is known on both sides: fewer points are needed.
#[test]
fn the_jerk_of_the_joints_jumps_with_that_of_the_tool() {
    SIX.iter().for_each(|name| jumps::<6>(name));
    SEVEN.iter().for_each(|name| jumps::<7>(name));
}

/// Between the places of a path, the sum of the fastest joint's ways (rad).
fn fastest<const N: usize>(points: &[FollowPoint<N>]) -> f64 {
    points
        .windows(2)
        .map(|pair| (pair[1].q[0] - pair[0].q[0]).amax())
        .sum()
}

/// What it costs that the spare joint does not follow a function of the path parameter (rad): the mean difference, and a little more.
fn not_following<'a>(
    (solver, start): (&Solver<7>, &'a SVector<f64, 7>),
    wanted: impl Fn(f64) -> f64 + 'a,
) -> impl Fn(&[FollowPoint<7>]) -> f64 + 'a {
    let direction = spare_direction(solver.chain(), start).unwrap();
    let off = move |point: &FollowPoint<7>| {
        (direction.dot(&(point.q[0] - start)) - wanted(point.u)).abs()
    };
    move |points| 0.01 + points.iter().map(&off).sum::<f64>() / points.len() as f64
}

/// Where the spare joint should move along a part of the path only, it does, and hardly along the rest.
#[test]
fn the_spare_joint_moves_along_a_part() {
    for name in SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let start = ready::<7>(name);
        let tool = curve(&solver.chain().forward(&start), 1.0);
        let grid: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
        let wanted = |u: f64| {
            let within = ((u - 0.5) / 0.3).clamp(0.0, 1.0);
            0.2 * (std::f64::consts::PI * within).sin().powi(2)
        };
        let cost = not_following((&solver, &start), wanted);
        let at = (&grid[..], &start);
        let options = FollowOptions::default();
        let still = follow(&solver, &tool, &grid, &start, &options).unwrap();
        let motion = cheaper(&solver, &tool, at, &options, &[&cost]).unwrap();
        let points = follow_with(&solver, &tool, at, &options, &motion).unwrap();
        let (before, after) = (cost(&still), cost(&points));
        println!("{name}: {before} without, {after} with");
        assert!(after < 0.6 * before, "{name}: {after}, {before} without");
    }
}

/// A null-space motion that costs less is found, costs less on the fine grid too, and is on the path, inside the
/// ranges of the joints.
#[test]
fn the_spare_joint_takes_what_costs_less() {
    let mut found = 0;
    for name in SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let start = ready::<7>(name);
        let tool = curve(&solver.chain().forward(&start), 1.0);
        let grid: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
        let options = FollowOptions {
            still_ends: true,
            ..FollowOptions::default()
        };
        let at = (&grid[..], &start);
        let Some(motion) = cheaper(&solver, &tool, at, &options, &[&fastest]) else {
            continue;
        };
        found += 1;
        let ease = follow(&solver, &tool, &grid, &start, &options).unwrap();
        let points = follow_with(&solver, &tool, at, &options, &motion).unwrap();
        assert!(fastest(&points) < 0.995 * fastest(&ease), "{name}");
        let chain = solver.chain();
        for point in &points {
            let (position, rotation) = error(&chain.forward(&point.q[0]), &tool(point.u).pose);
            assert!(position < 1e-10 && rotation < 1e-9, "{name}");
            let inside = |j: usize| (chain.lower()[j]..=chain.upper()[j]).contains(&point.q[0][j]);
            assert!((0..7).all(inside), "{name}");
        }
    }
    assert!(found >= 3, "{found}");
}

/// What is searched with one cost is changed to save some of the next: of two functions that the spare joint is to follow, it follows the last
/// one more closely, and begins near the first.
#[test]
fn the_last_cost_decides() {
    for name in SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let start = ready::<7>(name);
        let tool = curve(&solver.chain().forward(&start), 1.0);
        let grid: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
        let cost = |size: f64| {
            let wanted = move |u: f64| size * (std::f64::consts::PI * u).sin().powi(2);
            not_following((&solver, &start), wanted)
        };
        let (first, last) = (cost(0.2), cost(0.15));
        let (at, options) = ((&grid[..], &start), FollowOptions::default());
        let found = |costs: &[&Cost<'_, 7>]| {
            let motion = cheaper(&solver, &tool, at, &options, costs).unwrap();
            let points = follow_with(&solver, &tool, at, &options, &motion).unwrap();
            [first(&points), last(&points)]
        };
        let (one, both) = (found(&[&first]), found(&[&first, &last]));
        assert!(one[0] < one[1], "{name}: {one:?}");
        assert!(
            both[1] < both[0] && both[1] < 0.7 * one[1],
            "{name}: {both:?}, {one:?}"
        );
    }
}

/// Sum over a path of the speed of the fastest joint, to the path parameter (rad).
fn swiftest<const N: usize>(points: &[FollowPoint<N>]) -> f64 {
    let speed = |point: &FollowPoint<N>| point.q[1].amax();
    let mean = |pair: &[FollowPoint<N>]| 0.5 * (speed(&pair[0]) + speed(&pair[1]));
    points
        .windows(2)
        .map(|pair| mean(pair) * (pair[1].u - pair[0].u))
        .sum()
}

/// Near a known null-space motion one is found that costs less, also on the fine grid; not beside one that is given, nor with six
/// joints.
#[test]
fn a_motion_near_a_known_one_costs_less() {
    let options = FollowOptions::default();
    let grid: Vec<f64> = (0..=80).map(|i| f64::from(i) / 80.0).collect();
    let mut found = 0;
    for name in SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let start = ready::<7>(name);
        let tool = curve(&solver.chain().forward(&start), 1.0);
        let at = (&grid[..], &start);
        let (points, known) = follow_choosing(&solver, &tool, at, &options).unwrap();
        let search = |known: &NullMotion<7>, trials: usize| {
            let search = SpareSearch {
                known,
                cost: &swiftest,
                trials,
            };
            cheaper_near(&solver, &tool, at, &options, &search)
        };
        assert!(search(&known, 0).is_none(), "{name}");
        let given = NullMotion::given(SVector::repeat(1.0), |_| [0.0; 4]);
        assert!(search(&given, 30).is_none(), "{name}");
        let Some(motion) = search(&known, 30) else {
            continue;
        };
        found += 1;
        let other = follow_with(&solver, &tool, at, &options, &motion).unwrap();
        assert!(swiftest(&other) < 0.995 * swiftest(&points), "{name}");
        let end = solver.chain().forward(&other.last().unwrap().q[0]);
        let (position, rotation) = error(&end, &tool(1.0).pose);
        assert!(position < 1e-10 && rotation < 1e-9, "{name}");
    }
    assert!(found >= 3, "{found}");
    let solver = Solver::new(arms::chain::<6>("ur5e"));
    let start = ready::<6>("ur5e");
    let tool = curve(&solver.chain().forward(&start), 1.0);
    let at = (&grid[..], &start);
    let (_, known) = follow_choosing(&solver, &tool, at, &options).unwrap();
    let search = SpareSearch {
        known: &known,
        cost: &swiftest,
        trials: 30,
    };
    assert!(cheaper_near(&solver, &tool, at, &options, &search).is_none());
}

/// A line that ends out of reach says so, and not that the arm is singular where it can go no farther.
#[test]
fn an_end_out_of_reach_is_named() {
    for name in SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let start = ready::<7>(name);
        let pose = solver.chain().forward(&start);
        let (middle, radius) = solver.chain().reach_ball();
        let way = pose.translation.vector - middle.coords;
        let far = way.normalize() * (radius + 0.005 - way.norm());
        let line = |u: f64| TwistPoint {
            pose: Isometry3::from_parts((pose.translation.vector + far * u).into(), pose.rotation),
            linear: [far, Vector3::zeros(), Vector3::zeros()],
            angular: [Vector3::zeros(); 3],
            jump: [Vector3::zeros(); 2],
        };
        let grid: Vec<f64> = (0..=80).map(|i| f64::from(i) / 80.0).collect();
        let refused = follow(&solver, &line, &grid, &start, &FollowOptions::default()).unwrap_err();
        let out = matches!(
            refused.cause,
            FollowCause::Unreachable(IkFailure::OutOfReach { distance }) if distance > 0.004
        );
        assert!(out, "{name}: {refused}");
    }
}

/// On a finer grid, the joints that are known stay as they are, and those between them are those that are found when all
/// are computed anew.
fn refines<const N: usize>(name: &str) {
    let solver = Solver::new(arms::chain::<N>(name));
    let start = ready::<N>(name);
    let tool = curve(&solver.chain().forward(&start), 1.0);
    let coarse: Vec<f64> = (0..=100).map(|i| f64::from(i) / 100.0).collect();
    let options = FollowOptions::default();
    let at = (&coarse[..], &start);
    let (points, motion) = follow_choosing(&solver, &tool, at, &options).unwrap();
    let mut grid = Vec::new();
    for (i, pair) in points.windows(2).enumerate() {
        grid.push(pair[0].u);
        if i % 3 != 1 {
            grid.push(0.5 * (pair[0].u + pair[1].u));
        }
    }
    grid.push(1.0);
    let finer = refine(&solver, &tool, (&grid, &points), &options, &motion).unwrap();
    let anew = follow_with(&solver, &tool, (&grid, &start), &options, &motion).unwrap();
    assert!(points.iter().all(|point| finer.contains(point)), "{name}");
    assert!(finer.windows(2).all(|pair| pair[0].u < pair[1].u), "{name}");
    for u in grid {
        let at = |points: &[FollowPoint<N>]| *points.iter().find(|point| point.u == u).unwrap();
        let (a, b) = (at(&finer), at(&anew));
        for k in 0..4 {
            let off = (a.q[k] - b.q[k]).amax();
            assert!(off < 1e-8 * (1.0 + b.q[k].amax()), "{name} {u}: {off}");
        }
    }
    // Of nothing nothing is made, and a grid has to rise.
    let none = refine(&solver, &tool, (&coarse, &[]), &options, &motion);
    assert_eq!(none.unwrap_err().cause, FollowCause::BadGrid);
    let falling = refine(&solver, &tool, (&[1.0, 0.0], &points), &options, &motion);
    assert_eq!(falling.unwrap_err().cause, FollowCause::BadGrid);
}

#[test]
fn finer_grids_keep_what_is_known() {
    SIX.iter().for_each(|name| refines::<6>(name));
    SEVEN.iter().for_each(|name| refines::<7>(name));
}

/// Six joints have no null-space motion to choose.
#[test]
fn six_joints_have_nothing_to_choose() {
    let solver = Solver::new(arms::chain::<6>("ur5e"));
    let start = ready::<6>("ur5e");
    let tool = curve(&solver.chain().forward(&start), 1.0);
    let at = (&[0.0, 0.5, 1.0][..], &start);
    assert!(cheaper(&solver, &tool, at, &FollowOptions::default(), &[&fastest]).is_none());
}

/// The answer does not depend on anything but the question.
#[test]
fn two_runs_are_identical() {
    let solver = Solver::new(arms::chain::<7>("iiwa7"));
    let start = ready::<7>("iiwa7");
    let tool = curve(&solver.chain().forward(&start), 1.0);
    let run = || {
        follow(
            &solver,
            &tool,
            &[0.0, 0.5, 1.0],
            &start,
            &FollowOptions::default(),
        )
    };
    assert_eq!(run().unwrap(), run().unwrap());
}

#[test]
fn refusals_name_place_and_cause() {
    let solver = Solver::new(arms::chain::<6>("irb120"));
    let start = ready::<6>("irb120");
    let options = FollowOptions::default();
    let pose = solver.chain().forward(&start);
    let grid = [0.0, 0.25, 0.5, 0.75, 1.0];
    // Ten times too far.
    let refused = follow(&solver, &curve(&pose, 10.0), &grid, &start, &options).unwrap_err();
    assert!(
        matches!(
            refused.cause,
            FollowCause::Unreachable(_) | FollowCause::Limit | FollowCause::Singular
        ),
        "{refused}"
    );
    assert!(refused.u > 0.0 && refused.amount > 0.0, "{refused}");
    // From somewhere else.
    let elsewhere = start.add_scalar(0.01);
    let refused = follow(&solver, &curve(&pose, 1.0), &grid, &elsewhere, &options).unwrap_err();
    assert_eq!(refused.cause, FollowCause::Start);
    // Turning the flange on the spot until joint 6 is at its end.
    let axis = Unit::new_normalize(pose.rotation * Vector3::z());
    let spin = |u: f64| TwistPoint {
        pose: Isometry3::from_parts(
            pose.translation,
            UnitQuaternion::from_axis_angle(&axis, 9.0 * u) * pose.rotation,
        ),
        linear: [Vector3::zeros(); 3],
        angular: [axis.into_inner() * 9.0, Vector3::zeros(), Vector3::zeros()],
        jump: [Vector3::zeros(); 2],
    };
    let refused = follow(&solver, &spin, &grid, &start, &options).unwrap_err();
    assert_eq!(
        (refused.joint, refused.cause),
        (Some(5), FollowCause::Limit),
        "{refused}"
    );
    let beyond = 9.0 + 0.1 - solver.chain().upper()[5];
    assert!((refused.amount - beyond).abs() < 1e-6, "{refused}");
    let refused = follow(&solver, &spin, &[0.0, 0.0], &start, &options).unwrap_err();
    assert_eq!(refused.cause, FollowCause::BadGrid);
}

/// The wrist's singular pose lies on the line: passed exactly, joint 5 changing sign.
#[test]
fn a_wrist_singularity_is_passed() {
    let solver = Solver::new(arms::chain::<6>("irb120"));
    let start = SVector::from([0.0, 0.3, -0.4, 0.0, 0.1, 0.0]);
    let pose = solver.chain().forward(&start);
    // Pitching the flange in the plane of the arm moves only joints 2, 3 and 5.
    let tilt = |u: f64| TwistPoint {
        pose: Isometry3::from_parts(
            pose.translation,
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -0.4 * u) * pose.rotation,
        ),
        linear: [Vector3::zeros(); 3],
        angular: [Vector3::y() * -0.4, Vector3::zeros(), Vector3::zeros()],
        jump: [Vector3::zeros(); 2],
    };
    let grid: Vec<f64> = (0..=40).map(|i| f64::from(i) / 40.0).collect();
    let points = follow(&solver, &tilt, &grid, &start, &FollowOptions::default()).unwrap();
    let last = points.last().unwrap();
    assert!(
        points[0].q[0][4] > 0.0 && last.q[0][4] < -0.05,
        "joint 5 ends at {}",
        last.q[0][4]
    );
    assert!(
        points
            .iter()
            .all(|point| point.q[0][3].abs() < 1e-6 && point.q[1].amax() < 2.0)
    );
}

/// A straight line of the tool, `u` from -1 to 1, `way` long to either side of a pose.
fn line(pose: &Isometry3<f64>, way: Vector3<f64>) -> impl Fn(f64) -> TwistPoint + use<> {
    steady(pose, way, Vector3::zeros())
}

/// A steady motion of the tool, that is at a pose at `u` 0, and moves by `way` and turns by `turn` in a unit of `u`.
fn steady(
    pose: &Isometry3<f64>,
    way: Vector3<f64>,
    turn: Vector3<f64>,
) -> impl Fn(f64) -> TwistPoint + use<> {
    let pose = *pose;
    move |u| TwistPoint {
        pose: Isometry3::from_parts(
            Translation3::from(pose.translation.vector + way * u),
            UnitQuaternion::from_scaled_axis(turn * u) * pose.rotation,
        ),
        linear: [way, Vector3::zeros(), Vector3::zeros()],
        angular: [turn, Vector3::zeros(), Vector3::zeros()],
        jump: [Vector3::zeros(); 2],
    }
}

/// Straight lines in any direction through the pole of the wrist: passed exactly with joint
/// 5 changing sign, and no joint fast about the pole.
#[test]
fn lines_through_the_wrist_pole_are_passed() {
    for name in ["irb120", "irb1200_7_70", "lrmate200id", "tx2_60"] {
        let solver = Solver::new(arms::chain::<6>(name));
        let mut random = arms::Random(71);
        let (mut passed, mut refused) = (0, Vec::new());
        for _ in 0..50 {
            let mut pole = ready::<6>(name);
            pole[0] += random.between(-0.5, 0.5);
            pole[3] = random.between(-1.2, 1.2);
            pole[4] = 0.0;
            let way = Vector3::from_fn(|_, _| random.between(-0.04, 0.04));
            let tool = line(&solver.chain().forward(&pole), way);
            let mut start = pole;
            start[4] = 0.05;
            let Ok(start) = solver.nearest(&tool(-1.0).pose, &start) else {
                continue;
            };
            let grid: Vec<f64> = (-20..=20).map(|i| f64::from(i) / 20.0).collect();
            let options = FollowOptions::default();
            let points = match follow(&solver, &tool, &grid, &start.q, &options) {
                Ok(points) => points,
                Err(error) => {
                    refused.push(error);
                    continue;
                }
            };
            passed += 1;
            for point in &points {
                let found = solver.chain().forward(&point.q[0]);
                let (position, rotation) = error(&found, &tool(point.u).pose);
                assert!(position < 1e-9 && rotation < 1e-9, "{name} at {}", point.u);
            }
            let (first, last) = (points[0].q[0][4], points[points.len() - 1].q[0][4]);
            assert!(first * last < 0.0, "{name}: joint 5 from {first} to {last}");
            let near = points.iter().filter(|point| point.u.abs() <= 0.1);
            let fastest = near.map(|p| p.q[1].amax()).fold(0.0, f64::max);
            assert!(fastest < 2.0, "{name}: {fastest} rad for 0.04 m");
        }
        assert!(passed >= 40, "{name}: {passed} passed, refused {refused:?}");
    }
}

/// Smallest distance of a joint path from the limits.
fn room<const N: usize>(solver: &Solver<N>, points: &[kinematics::FollowPoint<N>]) -> f64 {
    let chain = solver.chain();
    points
        .iter()
        .flat_map(|p| (0..N).map(|i| chain.room(i, p.q[0][i])))
        .fold(f64::INFINITY, f64::min)
}

/// A turn of the flange that the last joints alone cannot make: the spare joint helps.
#[test]
fn spare_motion_keeps_inside_the_limits() {
    let solver = Solver::new(arms::chain::<7>("panda"));
    let start = SVector::from([0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 2.2]);
    let pose = solver.chain().forward(&start);
    // Joint 7 has 0.69 rad left, the flange turns by more about its own axis.
    let axis = Unit::new_normalize(pose.rotation * Vector3::z());
    let spin = steady(&pose, Vector3::zeros(), axis.into_inner() * 0.85);
    let grid: Vec<f64> = (0..=50).map(|i| f64::from(i) / 50.0).collect();
    let points = follow(&solver, &spin, &grid, &start, &FollowOptions::default()).unwrap();
    assert!(
        room(&solver, &points) > 0.0,
        "room {}",
        room(&solver, &points)
    );
    for point in &points {
        let (position, rotation) = error(&solver.chain().forward(&point.q[0]), &spin(point.u).pose);
        assert!(position < 1e-10 && rotation < 1e-9);
    }
    let moved = points.last().unwrap().q[0] - start;
    assert!(
        moved.fixed_rows::<6>(0).amax() > 0.05,
        "the arm had to move: {moved}"
    );
}

/// A straight line of the tool between two poses, `u` from 0 to 1.
fn line_between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> impl Fn(f64) -> TwistPoint + use<> {
    let way = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    steady(from, way, turn)
}

/// Straight lines that take a long self-motion, or one that no single measure of it can follow: from joints, to the pose of
/// others.
#[test]
fn long_self_motions_are_found() {
    let solver = Solver::new(arms::chain::<7>("panda"));
    let lines = [
        (
            [2.1652, -1.6233, 0.0415, -2.9150, 1.3215, 2.8727, -2.6115],
            [0.5578, -1.7275, 0.7504, -2.5534, 2.7723, 2.1474, -2.8627],
        ),
        (
            [0.4609, -0.1162, 0.6617, -1.3636, 2.5698, 3.0182, -2.4814],
            [-1.0867, -1.0144, 1.3631, -1.1772, 1.6961, 3.0089, -0.6632],
        ),
        (
            [-0.3064, 0.0989, -0.8512, -2.6332, 1.9286, 2.8665, -1.6424],
            [-0.6160, -0.9103, -0.9656, -2.9215, 2.0530, 3.4874, -2.5180],
        ),
        (
            [-2.7309, -0.7632, 0.5499, -0.8998, -1.0824, 2.7244, 2.3033],
            [-0.1091, 0.2293, -0.3610, -0.5285, -2.7370, 1.8243, 2.3575],
        ),
    ];
    for (start, end) in lines {
        let (start, end) = (SVector::from(start), SVector::from(end));
        let chain = solver.chain();
        let tool = line_between(&chain.forward(&start), &chain.forward(&end));
        let grid: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
        let points = follow(&solver, &tool, &grid, &start, &FollowOptions::default())
            .unwrap_or_else(|error| panic!("{start}: {error}"));
        assert!(room(&solver, &points) > 0.0, "{start}");
        for point in &points {
            let (position, rotation) = error(&chain.forward(&point.q[0]), &tool(point.u).pose);
            assert!(position < 1e-10 && rotation < 1e-9, "{start}");
        }
    }
}
