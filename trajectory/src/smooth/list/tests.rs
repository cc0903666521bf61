//! Lists at the edges of what is planned, and the rests of motions.

use super::*;
use crate::{ToolCurve, ToolLimits};
use nalgebra::{UnitQuaternion, Vector3};

fn limits() -> ToolLimits {
    ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        angular_speed: 2.0,
        angular_acceleration: 20.0,
        angular_jerk: 400.0,
    }
}

fn check(poses: &[Isometry3<f64>], tolerance: f64) -> SmoothPlan {
    let plan = plan(poses, &SmoothOptions::new(tolerance, limits())).unwrap();
    assert!(
        plan.certificate().holds(),
        "{:?} {:?}",
        plan.certificate(),
        plan.crossings()
    );
    assert!(plan.duration() <= plan.exact_stop());
    plan
}

#[test]
fn degenerate_lists() {
    let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
    let turned =
        |x: f64, angle: f64| Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * angle);
    for tolerance in [0.0, 1e-5, 1e-3, 10.0] {
        check(&[at(0.0, 0.0)], tolerance);
        check(&[at(0.1, 0.0); 4], tolerance);
        check(&[at(0.0, 0.0), at(0.1, 0.0)], tolerance);
        check(
            &[at(0.0, 0.0), at(0.1, 0.0), at(0.1, 0.0), at(0.2, 0.0)],
            tolerance,
        );
        check(&[at(0.0, 0.0), at(0.1, 0.0), at(0.0, 0.0)], tolerance);
        check(&[at(0.0, 0.0), at(0.1, 0.0), at(0.0, 1e-4)], tolerance);
        check(
            &[at(0.0, 0.0), at(1e-6, 0.0), at(0.0, 1e-6), at(1e-6, 1e-6)],
            tolerance,
        );
        check(
            &[turned(0.0, 0.0), turned(0.0, 0.5), turned(0.0, 1.0)],
            tolerance,
        );
        check(
            &[turned(0.0, 0.0), turned(0.0, 0.5), turned(0.0, 0.0)],
            tolerance,
        );
        check(
            &[
                turned(0.0, 0.0),
                turned(0.1, 0.5),
                turned(0.1, 1.0),
                turned(0.2, 0.0),
            ],
            tolerance,
        );
    }
}

#[test]
fn bad_input_is_named() {
    let options = SmoothOptions::new(0.001, limits());
    assert_eq!(plan(&[], &options).unwrap_err(), SmoothError::NoPose);
    let bad = [
        Isometry3::identity(),
        Isometry3::translation(f64::NAN, 0.0, 0.0),
    ];
    assert!(matches!(
        plan(&bad, &options),
        Err(SmoothError::BadPose { index: 1, .. })
    ));
    let negative = SmoothOptions::new(-1.0, limits());
    assert!(matches!(
        plan(&bad[..1], &negative),
        Err(SmoothError::BadTolerance { .. })
    ));
}

/// Points of a circle of a radius (m), in another place.
fn circle(radius: f64, count: u32) -> Vec<Isometry3<f64>> {
    let frame = Isometry3::new(Vector3::new(0.49, 0.13, 0.37), Vector3::new(3.1, 0.2, 0.1));
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(count);
    let place = |i: u32| Vector3::new(angle(i).cos() - 1.0, angle(i).sin(), 0.0) * radius;
    let pose = |i| frame * Isometry3::from_parts(place(i).into(), UnitQuaternion::identity());
    (0..=count).map(pose).collect()
}

/// A list that can be passed without a rest has none inside, however many windows it takes.
#[test]
fn a_circle_is_passed_without_a_rest() {
    let at = |i: u32| std::f64::consts::TAU * f64::from(i) / 200.0;
    let place = |a: f64| Vector3::new(0.05 * a.cos() + 0.44, 0.05 * a.sin() + 0.13, 0.37);
    let rotation = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.3);
    let pose = |i| Isometry3::from_parts(place(at(i)).into(), rotation);
    let poses: Vec<_> = (0..=200).map(pose).collect();
    for (speed, acceleration) in [(0.1, 0.3), (0.1, 1.0), (0.1, 5.0), (0.35, 0.3), (0.35, 5.0)] {
        for tolerance in [1e-4, 2e-3] {
            let limits = ToolLimits {
                speed,
                acceleration,
                ..limits()
            };
            let plan = plan(&poses, &SmoothOptions::new(tolerance, limits)).unwrap();
            assert!(plan.certificate().holds());
            let rests = plan.rests();
            assert!(
                rests.is_empty(),
                "{speed} {acceleration} {tolerance} {rests:?}"
            );
        }
    }
}

/// Two hundred poses of a circle at a tenth of the speed of an arm: the second window starts
/// as close to the speed limit as the first one may be.
#[test]
fn windows_of_a_slow_circle_join_without_a_rest() {
    let limits = ToolLimits {
        speed: 0.1,
        acceleration: 0.5,
        jerk: 100.0,
        ..limits()
    };
    let plan = plan(&circle(0.05, 200), &SmoothOptions::new(2e-3, limits)).unwrap();
    assert!(
        plan.certificate().holds() && plan.rests().is_empty(),
        "{:?}",
        plan.rests()
    );
    // The exact circle is 0.314 m long: 3.34 s at 0.1 m/s, 0.2 s to start and to stop among them.
    // Windows lose up to 1 % of that; with a rest it was 3.42 s.
    assert!(plan.duration() < 3.38, "{}", plan.duration());
}

/// Rests are named, and the motion rests at no other time.
#[test]
fn rests_are_named() {
    let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
    let corner = [at(0.0, 0.0), at(0.1, 0.0), at(0.1, 0.1)];
    let stops = check(&corner, 0.0);
    assert_eq!(stops.fallbacks(), 1);
    let rest = stops.rests()[0];
    assert_eq!((rest.cause, rest.pose), (RestCause::Stop, 1));
    assert!((rest.time - stops.crossings()[0].time).abs() < 1e-6);
    assert!(check(&corner, 1e-3).rests().is_empty());
    // There and back on the same way, dense: it rests where it turns back at most.
    let back: Vec<_> = (0..=400)
        .map(|i| f64::from(200_i32 - (i - 200_i32).abs()) * 1e-3)
        .map(|x| at(x, 4.0 * x * x))
        .collect();
    let back = check(&back, 1e-4);
    assert!(back.rests().len() <= 1, "{:?}", back.rests());
    for rest in back.rests() {
        assert_eq!(rest.cause, RestCause::TurnsBack);
        assert!((195..=205).contains(&rest.pose), "{rest:?}");
        let speed = back.at(rest.time).linear[0].norm();
        assert!(speed < 1e-9, "{speed}");
    }
}

/// Three legs and more, then a turn on the spot at the last point: a part of a leg without
/// motion must not limit the speed at which the leg begins.
#[test]
fn a_turn_on_the_spot_at_the_end() {
    let at =
        |y: f64, z: f64, angle: f64| Isometry3::new(Vector3::new(0.45, y, z), Vector3::x() * angle);
    let way = [
        at(-0.15, 0.3, 0.0),
        at(-0.07, 0.3, 0.0),
        at(0.01, 0.35, 0.0),
        at(0.09, 0.3, 0.0),
        at(0.09, 0.3, 0.1),
    ];
    for first in 0..4 {
        for tolerance in [1e-5, 5e-4, 1e-3, 2e-2] {
            check(&way[first..], tolerance);
            let back: Vec<_> = way[first..].iter().rev().copied().collect();
            check(&back, tolerance);
        }
    }
    // The same turn between legs, and each pose twice.
    check(&[way[1], way[2], way[3], way[4], at(0.2, 0.3, 0.1)], 1e-3);
    let twice: Vec<_> = way.iter().flat_map(|pose| [*pose; 2]).collect();
    check(&twice, 5e-4);
}

/// A rough curve is one of many that a move may try: it is planned once, where another one as cheap is planned again
/// within half of the tolerance.
#[test]
fn a_rough_curve_is_planned_once() {
    let poses = circle(0.05, 24);
    let usual = SmoothOptions::new(1e-3, limits()).finite();
    for (gap, again) in [(usual.gap, true), (1.0, false)] {
        let options = SmoothOptions {
            gap,
            ..usual.clone()
        };
        let list = List::new(&poses, &poses, &options);
        let form = NormalForm::new(&poses, &options).unwrap();
        let found = list.by_windows(&form, &form.options).unwrap();
        assert_eq!(list.is_planned_again(&found.plan), again, "gap {gap}");
    }
}
