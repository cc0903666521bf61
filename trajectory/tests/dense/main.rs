//! Smooth motions through lists that are dense in poses.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod invariance;
mod lists;
mod random;

#[path = "../suite/mod.rs"]
mod sparse;

use lists::suite;
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
