//! Speed limits of joints that fall towards the ends of their ranges.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::{Isometry3, SVector};
use planner::motion::{Direction, PlannedMove, Planner};
use planner::robot::{self, Robot};
use planner::task::{Move, Shape};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

type Joints = SVector<f64, 7>;

/// The maker's formula with the maker's numbers, written out once more: the largest speed upwards and
/// downwards of each joint of the FR3.
fn allowed(q: &Joints) -> [[f64; 2]; 7] {
    let row = |j: usize, [top, offset, twice]: [f64; 3], [low, high]: [f64; 2]| {
        let one = |room: f64| top.min(((twice * room).max(0.0).sqrt() - offset).max(0.0));
        [one(high - q[j]), one(q[j] - low)]
    };
    [
        row(0, [2.62, 0.30, 12.0], [-2.75010, 2.75010]),
        row(1, [2.62, 0.20, 5.17], [-1.79180, 1.79180]),
        row(2, [2.62, 0.20, 7.00], [-2.90650, 2.90650]),
        row(3, [2.62, 0.30, 8.00], [-3.04810, -0.14580]),
        row(4, [5.26, 0.35, 34.0], [-2.81010, 2.81010]),
        row(5, [4.18, 0.35, 11.0], [0.54092, 4.52050]),
        row(6, [5.26, 0.35, 34.0], [-3.01960, 3.01960]),
    ]
}

/// The largest ratio of a speed to nine tenths of what the maker allows where the arm may be, 3 mrad
/// ahead of its command, at 4000 times.
fn worst(planned: &PlannedMove<7>) -> f64 {
    let mut most = 0.0_f64;
    for i in 0..=4000 {
        let time = planned.trajectory.duration() * f64::from(i) / 4000.0;
        let s = planned.trajectory.sample(time);
        let ahead = s.velocity.map(|speed| 0.003 * speed.signum());
        let allowed = allowed(&(s.position + ahead));
        for j in 0..7 {
            let limit = allowed[j][usize::from(s.velocity[j] < 0.0)];
            if s.velocity[j].abs() > 1e-9 {
                most = most.max(s.velocity[j].abs() / (0.9 * limit));
            }
        }
    }
    most
}

/// Positions in the whole range, the ends more often.
fn joints() -> impl Strategy<Value = Joints> {
    prop::array::uniform7(-1.0..1.0_f64).prop_map(|shares| {
        let robot = robot::load("fr3").unwrap();
        SVector::from_fn(|j, _| {
            let (lower, upper) = (robot.joints.lower[j], robot.joints.upper[j]);
            let share = shares[j].signum() * shares[j].abs().sqrt();
            0.5 * (lower + upper) + 0.4999 * share * (upper - lower)
        })
    })
}

fn joint_move(planner: &Planner<7>, goal: &Joints) -> Move {
    Move {
        shape: Shape::Joint,
        poses: vec![planner.chain().forward(goal)],
        tolerance: 0.0,
        limits: trajectory::ToolLimits::UNLIMITED,
    }
}

/// The robot without the limits.
fn without(robot: &Robot) -> Planner<7> {
    let limits = trajectory::JointLimits {
        ends: None,
        ..robot.joint_limits::<7>()
    };
    let chain = robot.chain::<7>().unwrap();
    Planner::new(&chain, Isometry3::identity(), limits, robot.joint_names())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, rng_seed: RngSeed::Fixed(139), ..ProptestConfig::default() })]

    /// Motions in joint space of the FR3 keep nine tenths of what its maker allows at each position, and
    /// their certificates say so.
    #[test]
    fn the_fr3_is_slower_near_the_ends(start in joints(), goal in joints()) {
        let robot = robot::load("fr3").unwrap();
        let planner = robot.planner::<7>().unwrap();
        let planned = planner.plan(&joint_move(&planner, &goal), &start);
        let Ok(planned) = planned else {
            return Err(TestCaseError::fail(format!("{}", planned.unwrap_err())));
        };
        let most = worst(&planned);
        prop_assert!(most <= 1.0 + 1e-9, "{most}");
        let velocities = planned.certificate.limits.iter().filter(|limit| limit.limit.contains("velocity"));
        let certified = velocities.map(|limit| limit.ratio).fold(0.0, f64::max);
        prop_assert!(certified >= most - 1e-9 && certified <= 1.0 + 1e-9, "{certified} {most}");
    }
}

/// The way into a corner of the range breaks the maker's limit if it is planned without it, and is not
/// slower than it must be with it.
#[test]
fn a_motion_to_an_end_is_slower_only_where_it_must() {
    let robot = robot::load("fr3").unwrap();
    let start = Joints::from_column_slice(&robot.home);
    let mut goal = start;
    (goal[0], goal[1]) = (2.72, 1.2);
    let (with, free) = (robot.planner::<7>().unwrap(), without(&robot));
    let slow = with.actuate(&to(&goal), &start).unwrap();
    let fast = free.actuate(&to(&goal), &start).unwrap();
    let (before, after) = (worst(&fast), worst(&slow));
    let [slow, fast] = [slow, fast].map(|planned| planned.trajectory.duration());
    println!("{fast:.3} s with {before:.2} of the limit, {slow:.3} s with {after:.4}");
    assert!(before > 1.2 && after <= 1.0 + 1e-9, "{before} {after}");
    assert!(slow > fast && slow < 0.8 * fast * before, "{fast} {slow}");
}

fn to(goal: &Joints) -> planner::task::JointMove {
    let target = |(joint, position): (usize, &f64)| planner::task::JointGoal {
        joint,
        position: *position,
        speed: None,
        acceleration: None,
    };
    planner::task::JointMove {
        goals: goal.iter().enumerate().map(target).collect(),
        shares: (1.0, 1.0),
        limits: trajectory::ToolLimits::UNLIMITED,
    }
}

/// Each joint can be jogged to both ends of the range, and is slow enough there.
#[test]
fn jogs_reach_the_ends() {
    let robot = robot::load("fr3").unwrap();
    let (planner, start) = (
        robot.planner::<7>().unwrap(),
        Joints::from_column_slice(&robot.home),
    );
    for joint in 0..7 {
        for sign in [-1.0, 1.0] {
            let mut shares = Joints::zeros();
            shares[joint] = sign;
            let direction = Direction::Joints {
                shares,
                distance: f64::INFINITY,
            };
            let most = trajectory::ToolLimits::UNLIMITED;
            let planned = planner.jog(&direction, &start, &most).unwrap();
            let ratio = worst(&planned);
            let way = (planned.end - start)[joint] * sign;
            assert!(ratio <= 1.0 + 1e-9, "joint {}: {ratio}", joint + 1);
            assert!(way > 0.5, "joint {}: {way}", joint + 1);
        }
    }
}

/// The range that is planned with ends where a hundredth of the speed is allowed, 3 mrad nearer than the
/// maker's formula says.
#[test]
fn the_range_ends_where_hardly_any_speed_is_allowed() {
    let robot = robot::load("fr3").unwrap();
    for upper in [false, true] {
        let ends = if upper {
            &robot.joints.upper
        } else {
            &robot.joints.lower
        };
        let q = Joints::from_column_slice(ends);
        let maker = robot.joints.of_the_maker();
        let ahead = if upper { 0.003 } else { -0.003 };
        for (j, allowed) in allowed(&q.add_scalar(ahead)).iter().enumerate() {
            let found = allowed[usize::from(!upper)] / maker.velocity[j];
            assert!((found - 0.01).abs() < 1e-6, "joint {}: {found}", j + 1);
            let joint = &robot.model.joints[j];
            assert_eq!(if upper { joint.upper } else { joint.lower }, q[j]);
        }
    }
}

/// Errors of `[joints.near_ends]` name file, line, key and what was expected.
#[test]
fn what_is_wrong_is_named() {
    let fr3 = robot::load("fr3").unwrap();
    let offset = "offset_per_s = [0.3, 0.2, 0.2, 0.3, 0.35, 0.35, 0.35]";
    let deceleration = "deceleration_per_s2 = [6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0]";
    let upper = "upper_rad_or_m = [2.7501, ";
    let cases = [
        (
            offset,
            "offset_per_s = [0.3]",
            "expected 7 numbers, one per joint",
        ),
        (offset, "", "missing field `offset_per_s`"),
        (
            offset,
            "offset_per_s = [-0.3, 0, 0, 0, 0, 0, 0]",
            "finite numbers of at least 0",
        ),
        (
            deceleration,
            "deceleration_per_s2 = [0, 1, 1, 1, 1, 1, 1]",
            "positive finite numbers",
        ),
        (
            deceleration,
            "deceleration_per_s2 = [nan, 1, 1, 1, 1, 1, 1]",
            "positive finite numbers",
        ),
        (
            upper,
            "upper_rad_or_m = [-2.75, ",
            "ends that leave a range to joint \"joint_1\"",
        ),
        (upper, "upper_rad_or_m = [-0.1, ", "joint \"joint_1\" from"),
        (upper, "upper_rad_or_m = [inf, ", "finite numbers"),
        (
            "ahead_rad_or_m = 0.003",
            "ahead_rad_or_m = -0.003",
            "a finite number of at least 0",
        ),
    ];
    for (old, new, expected) in cases {
        let toml = fr3.toml.replace(old, new);
        assert_ne!(toml, fr3.toml);
        let error = robot::parse("fr3", &fr3.urdf, &toml)
            .unwrap_err()
            .to_string();
        assert!(error.contains("robot.toml:"), "{error}");
        assert!(
            error.contains(expected),
            "expected: {expected}\nfound:    {error}"
        );
    }
}
