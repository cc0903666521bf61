//! Joint trajectories with times of others: passed as they are within all limits, or refused.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::SVector;
use planner::controller::Controller;
use planner::motion::{MotionError, Peaks, PlannedMove, Planner, TimedRefusal};
use planner::robot::{load, vector};
use planner::timed::{TimedPoint, TimedTrajectory};
use trajectory::ToolLimits;

type Joints = SVector<f64, 6>;
/// A change that makes a trajectory one that is refused.
type Change<'a> = &'a dyn Fn(&mut TimedTrajectory);

fn ur5e() -> (Planner<6>, Joints, ToolLimits) {
    let robot = load("ur5e").unwrap();
    let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
    let home = vector(&robot.home);
    (controller.planner().clone(), home, robot.motion_limits())
}

/// How far each joint goes in the motion of these tests (rad).
const STEP: [f64; 6] = [0.5, -0.3, 0.4, 0.2, -0.1, 0.6];

/// Position, velocity and acceleration of a motion from rest to rest in `t` s, of length 1.
fn profile(t: f64, time: f64) -> [f64; 3] {
    let x = time / t;
    [
        x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x),
        x * x * (30.0 - 60.0 * x + 30.0 * x * x) / t,
        x * (60.0 - 180.0 * x + 120.0 * x * x) / (t * t),
    ]
}

/// A trajectory of `parts` pieces in `t` s from `start`, all orders given.
fn smooth(start: &Joints, t: f64, parts: usize) -> TimedTrajectory {
    let point = |part: usize| {
        let time = t * part as f64 / parts as f64;
        let [s, v, a] = profile(t, time);
        let list = |factor: f64| STEP.iter().map(|step| step * factor).collect();
        TimedPoint {
            time,
            positions: (0..6).map(|joint| start[joint] + STEP[joint] * s).collect(),
            velocities: list(v),
            accelerations: list(a),
        }
    };
    let robot = load("ur5e").unwrap();
    TimedTrajectory {
        joints: robot.joint_names(),
        points: (0..=parts).map(point).collect(),
        retime: false,
    }
}

fn refusal(result: Result<PlannedMove<6>, MotionError>) -> TimedRefusal {
    match result {
        Err(MotionError::Timed(refusal)) => refusal,
        Err(other) => panic!("{other}"),
        Ok(planned) => panic!("planned, {} s", planned.trajectory.duration()),
    }
}

fn at_points(planned: &PlannedMove<6>, timed: &TimedTrajectory) -> f64 {
    let off = timed.points.iter().map(|point| {
        let at = planned.trajectory.sample(point.time).position;
        (at - Joints::from_column_slice(&point.positions)).amax()
    });
    off.fold(0.0, f64::max)
}

/// Every point is passed at its time, with its velocity, and every limit holds; the same without
/// accelerations.
#[test]
fn points_are_passed_at_their_times() {
    let (planner, home, most) = ur5e();
    let mut timed = smooth(&home, 2.0, 20);
    for with_accelerations in [true, false] {
        if !with_accelerations {
            timed
                .points
                .iter_mut()
                .for_each(|p| p.accelerations.clear());
        }
        let planned = planner.timed(&timed, &home, &most).unwrap();
        assert!((planned.trajectory.duration() - 2.0).abs() < 1e-12);
        assert!(at_points(&planned, &timed) < 1e-12);
        for point in &timed.points {
            let at = planned.trajectory.sample(point.time).velocity;
            assert!((at - Joints::from_column_slice(&point.velocities)).amax() < 1e-9);
        }
        assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
        let accelerations = planned.trajectory.pieces().windows(2).map(|pair| {
            let (end, begin) = (pair[0].sample(pair[0].duration), pair[1].sample(0.0));
            (end.acceleration - begin.acceleration).amax()
        });
        assert!(accelerations.fold(0.0, f64::max) < 1e-9);
    }
}

/// The order of the joints is that of the names.
#[test]
fn joints_go_by_their_names() {
    let (planner, home, most) = ur5e();
    let timed = smooth(&home, 2.0, 10);
    let planned = planner.timed(&timed, &home, &most).unwrap();
    let mut turned = timed.clone();
    turned.joints.rotate_left(2);
    for point in &mut turned.points {
        point.positions.rotate_left(2);
        point.velocities.rotate_left(2);
        point.accelerations.rotate_left(2);
    }
    let again = planner.timed(&turned, &home, &most).unwrap();
    assert_eq!(planned.trajectory, again.trajectory);
}

/// A trajectory that is too fast is refused with joint, limit and points; with twice the time it is
/// executed as it is.
#[test]
fn a_limit_is_named() {
    let (planner, home, most) = ur5e();
    let refused = refusal(planner.timed(&smooth(&home, 0.5, 10), &home, &most));
    let TimedRefusal::Limit {
        limit,
        ratio,
        time,
        place,
    } = &refused
    else {
        panic!("{refused}");
    };
    assert!(limit.contains("of joint_6"), "{limit}");
    assert!(*ratio > 1.0 && (0.0..=0.5).contains(time));
    assert!(place.starts_with("between points"), "{place}");
    assert!(refused.help().contains("time"));
    assert!(planner.timed(&smooth(&home, 2.0, 10), &home, &most).is_ok());
}

/// The factor on time with which every limit is just kept.
fn slower(peaks: &Peaks) -> f64 {
    let most = |list: &[f64]| list.iter().copied().fold(0.0, f64::max);
    let first = [
        most(&peaks.joint_velocity),
        peaks.tool_speed,
        peaks.tool_angular_speed,
    ];
    let second = [
        most(&peaks.joint_acceleration),
        peaks.tool_acceleration,
        peaks.tool_angular_acceleration,
    ];
    let third = [
        most(&peaks.joint_jerk),
        peaks.tool_jerk,
        peaks.tool_angular_jerk,
    ];
    most(&first)
        .max(most(&second).sqrt())
        .max(most(&third).cbrt())
}

/// What is over a limit by less than rounding and bounds need is stretched by so much.
#[test]
fn a_trajectory_at_the_limit_is_stretched_by_less_than_a_percent() {
    let (planner, home, most) = ur5e();
    let slow = planner
        .timed(&smooth(&home, 4.0, 10), &home, &most)
        .unwrap();
    // In this time the motion is 0.6 % too fast.
    let t = 4.0 * slower(&slow.certificate.peaks) / 1.006;
    let planned = planner.timed(&smooth(&home, t, 10), &home, &most).unwrap();
    let longer = planned.trajectory.duration() / t;
    assert!((1.004..=1.01).contains(&longer), "{longer}");
    assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
}

/// The arm goes to a first point that is near by itself, and refuses one that is not.
#[test]
fn the_start_is_near_or_refused() {
    let (planner, home, most) = ur5e();
    let timed = smooth(&home, 2.0, 10);
    let mut off = home;
    off[2] += 0.009;
    let planned = planner.timed(&timed, &off, &most).unwrap();
    assert!(planned.trajectory.duration() > 2.0 && planned.trajectory.duration() < 2.3);
    assert!((planned.trajectory.sample(0.0).position - off).amax() < 1e-12);
    off[2] += 0.002;
    let refused = refusal(planner.timed(&timed, &off, &most));
    assert!(matches!(&refused, TimedRefusal::Start { joint, .. } if joint.contains("joint_3")));
    // Without a point at time 0 the motion begins where the arm is.
    let mut late = timed.clone();
    late.points.remove(0);
    let planned = planner.timed(&late, &home, &most).unwrap();
    assert!(at_points(&planned, &late) < 1e-9);
}

/// With positions only the pieces are straight: standing still passes, a corner is refused with its
/// point, and a time law of our own rests there.
#[test]
fn positions_only() {
    let (planner, home, most) = ur5e();
    let mut timed = smooth(&home, 4.0, 2);
    for point in &mut timed.points {
        point.velocities.clear();
        point.accelerations.clear();
    }
    let refused = refusal(planner.timed(&timed, &home, &most));
    assert!(
        matches!(refused, TimedRefusal::Corner { point: 1, .. }),
        "{refused}"
    );
    let mut still = timed.clone();
    let first = still.points[0].positions.clone();
    still
        .points
        .iter_mut()
        .for_each(|p| p.positions.clone_from(&first));
    let planned = planner.timed(&still, &home, &most).unwrap();
    assert_eq!(planned.trajectory.duration(), 4.0);

    timed.retime = true;
    timed.points[1].positions[0] += 0.3;
    let planned = planner.timed(&timed, &home, &most).unwrap();
    let corner = Joints::from_column_slice(&timed.points[1].positions);
    let rest = planned
        .trajectory
        .times()
        .iter()
        .map(|time| planned.trajectory.sample(*time));
    assert!(
        rest.into_iter()
            .any(|at| (at.position - corner).amax() < 1e-9 && at.velocity.amax() < 1e-9),
        "no rest in the corner"
    );
    assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
}

/// Retimed, the motion is faster than a slow one, keeps its way and every limit, and ends there.
#[test]
fn a_time_law_of_our_own_keeps_the_way() {
    let (planner, home, most) = ur5e();
    let mut timed = smooth(&home, 8.0, 20);
    // A curve, not a line.
    for point in &mut timed.points {
        let [_, v, a] = profile(8.0, point.time);
        let bend = [0.2 * v * 8.0, 0.2 * a * 8.0];
        point.positions[1] += bend[0];
        point.velocities[1] += bend[1];
        point.accelerations.clear();
    }
    let given = planner.timed(&timed, &home, &most).unwrap();
    timed.retime = true;
    let planned = planner.timed(&timed, &home, &most).unwrap();
    assert!(
        planned.trajectory.duration() < 3.0,
        "{} s",
        planned.trajectory.duration()
    );
    assert!((planned.end - given.end).amax() < 1e-9);
    assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
    let moments = (0..=400).map(|part| part as f64 / 400.0 * planned.trajectory.duration());
    let way: Vec<Joints> = moments
        .map(|t| planned.trajectory.sample(t).position)
        .collect();
    for part in 0..=100 {
        let at = given.trajectory.sample(8.0 * part as f64 / 100.0).position;
        let off = way
            .iter()
            .map(|other| (other - at).amax())
            .fold(f64::INFINITY, f64::min);
        assert!(off < 5e-3, "{off} rad off the way");
    }
}

/// Each fault of the form has a refusal of its own, which names point and joint.
#[test]
fn what_is_no_trajectory_is_refused() {
    let (planner, home, most) = ur5e();
    let whole = smooth(&home, 2.0, 10);
    let try_with = |change: Change<'_>| {
        let mut timed = whole.clone();
        change(&mut timed);
        refusal(planner.timed(&timed, &home, &most)).to_string()
    };
    let cases: [(&str, Change<'_>); 14] = [
        ("1 to 100000 points, got 0", &|t| t.points.clear()),
        ("no joint \"x\"", &|t| t.joints[1] = "x".to_owned()),
        ("joint_6 is missing", &|t| {
            t.joints.pop();
        }),
        ("joint_3 is named twice", &|t| {
            t.joints[5] = "joint_3".to_owned()
        }),
        ("point 3 has 5 positions for 6 joints", &|t| {
            t.points[2].positions.pop();
        }),
        ("point 4 has no velocities", &|t| {
            t.points[3].velocities.clear()
        }),
        ("point 4 has no accelerations", &|t| {
            t.points[3].accelerations.clear()
        }),
        ("velocity of joint_3 is NaN", &|t| {
            t.points[5].velocities[2] = f64::NAN
        }),
        ("point 6 is at 0.1 s", &|t| t.points[5].time = 0.1),
        ("point 6 is at NaN s", &|t| t.points[5].time = f64::NAN),
        ("point 1 is at -1 s", &|t| t.points[0].time = -1.0),
        ("point 11 has a velocity of 0.2000 for joint_1", &|t| {
            t.points[10].velocities[0] = 0.2;
        }),
        ("point 1 has a velocity", &|t| {
            t.points[0].velocities[0] = -0.2
        }),
        ("point 7 needs joint_3", &|t| t.points[6].positions[2] = 4.0),
    ];
    for (words, change) in cases {
        let said = try_with(change);
        assert!(said.contains(words), "{said:?} has no {words:?}");
    }
}

/// Whatever the numbers are, a trajectory is refused or keeps every limit.
#[test]
fn random_points_are_refused_or_kept() {
    let (planner, home, most) = ur5e();
    let mut state = 7_u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut kept = 0;
    for case in 0..60 {
        let mut timed = smooth(&home, 1.0 + 3.0 * random(), 2 + case % 7);
        timed.retime = case % 4 == 0;
        let wild = random().powi(6);
        for point in &mut timed.points {
            for list in [
                &mut point.positions,
                &mut point.velocities,
                &mut point.accelerations,
            ] {
                let joint = (random() * 6.0) as usize;
                list[joint] += (random() - 0.5) * wild;
            }
            if case % 3 == 0 {
                point.accelerations.clear();
            }
        }
        if let Ok(planned) = planner.timed(&timed, &home, &most) {
            assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
            kept += 1;
        }
    }
    assert!((5..60).contains(&kept), "{kept} of 60");
}
