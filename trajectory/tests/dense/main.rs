//! Smooth motions through lists that are dense in poses.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod invariance;
mod lists;
mod random;

#[path = "../suite/mod.rs"]
mod sparse;

use lists::suite;
use nalgebra::{Isometry3, Vector3};
use trajectory::smooth::{Method, SmoothOptions, plan};

/// On each list of the suite the motion is certified, without a fallback, and about as fast as the
/// least time along the exact curve.
#[test]
fn the_suite_is_as_fast_as_the_exact_curves() {
    for case in suite() {
        let options = SmoothOptions::new(case.tolerance, lists::limits());
        let plan = plan(&case.poses, &options).unwrap();
        let ratio = plan.duration() / case.reference;
        println!("{} {ratio:.4}", case.name);
        assert!(plan.certificate().holds(), "{}", case.name);
        assert_eq!((plan.method(), plan.fallbacks()), (Method::Fit, 0));
        assert!(ratio < 1.02, "{} {ratio}", case.name);
        assert!(plan.duration() >= plan.certificate().lower_bound);
    }
}

/// A long leg down to a dense curve and one up from it, at right angles: each corner is passed in motion, and takes little
/// more time than the curve and the legs by themselves. One curve fitted through all took 2.65 s.
#[test]
fn a_corner_before_a_dense_curve_is_a_seam() {
    let cases = suite();
    let helix = cases.iter().find(|case| case.name == "helix1500").unwrap();
    let above = |pose: &Isometry3<f64>| Isometry3::translation(0.0, 0.0, 0.05) * pose;
    let ends = [&helix.poses[0], &helix.poses[1500]].map(above);
    let list = [&ends[..1], &helix.poses, &ends[1..]].concat();
    let options = SmoothOptions::new(helix.tolerance, lists::limits());
    let plan = plan(&list, &options).unwrap();
    assert!(plan.certificate().holds() && plan.rests().is_empty());
    assert!(plan.duration() < 2.31, "{}", plan.duration());
}

/// A long straight, a dense bend, a long straight: faster than with a rest at both seams.
#[test]
fn mixed_density_is_faster_than_with_rests() {
    let poses = lists::straight_bend_straight(0.2, 0.03, 400);
    let options = SmoothOptions::new(1e-4, lists::limits());
    let plan = plan(&poses, &options).unwrap();
    assert!(plan.certificate().holds() && plan.fallbacks() == 0);
    // The straights take 0.55 s each from rest to rest, the bend 0.27 s.
    assert!(plan.duration() < 1.33, "{}", plan.duration());
}

/// A straight leg, a dense fillet that turns the tool, a straight leg: the legs of the fillet are shorter than the tolerance,
/// and each pose is seen turned where the tool is nearest to it. One search finds the motion; planned in parts, one of these rested.
#[test]
fn a_dense_fillet_that_turns_is_planned_as_a_whole() {
    for (radius, tolerance, most) in [(0.01, 6e-4, 0.73), (0.006, 2e-4, 0.80), (0.02, 4e-4, 0.735)]
    {
        let mut poses = lists::straight_bend_straight(0.08, radius, 56);
        let count = poses.len();
        for (i, pose) in poses.iter_mut().enumerate() {
            let turn = 0.47 * ((i as f64 - 1.0) / (count - 3) as f64).clamp(0.0, 1.0);
            *pose = Isometry3::new(pose.translation.vector, Vector3::z() * turn);
        }
        let options = SmoothOptions::new(tolerance, lists::turning_limits());
        let plan = plan(&poses, &options).unwrap();
        assert!(plan.certificate().holds() && plan.rests().is_empty());
        assert!(plan.duration() < most, "{radius} m: {} s", plan.duration());
    }
}
