//! Random dense lists: closed and open curves, noise, uneven spacing, cusps, doubled poses, mixed
//! density, changing orientation.

use trajectory::smooth::{RestCause, SmoothOptions, plan};

use crate::lists;

/// Plans so many lists: each is certified and never slower than exact stops; the seeds of those that
/// rest elsewhere than where the way turns back. The rests of these are named.
fn judged(seeds: std::ops::Range<u64>, most: f64) -> Vec<u64> {
    let mut fallbacks = Vec::new();
    for seed in seeds {
        let (poses, tolerance) = lists::random(seed, most);
        let plan = plan(
            &poses,
            &SmoothOptions::new(tolerance, lists::turning_limits()),
        )
        .unwrap();
        assert!(plan.certificate().holds(), "{seed}");
        assert!(
            plan.duration() <= plan.exact_stop() * (1.0 + 1e-12),
            "{seed}"
        );
        let rests = plan.rests().iter();
        let causes: Vec<_> = rests.map(|rest| rest.cause).collect();
        if causes.iter().any(|cause| *cause != RestCause::TurnsBack) {
            println!("list {seed}: {causes:?}");
            fallbacks.push(seed);
        }
    }
    fallbacks
}

#[test]
fn random_lists_are_certified() {
    // A sharp corner between long legs in a dense list may need a stop.
    assert!(judged(0..24, 400.0).len() <= 1);
}

/// Lists that were slow or rested on their way, with the time that they may take (s): a list that is
/// not quite dense, whose windows of splines do not join, is fitted all the same; one whose tolerance
/// shows every corner is planned as a spline, too; one that turns back need not rest there; and sharp corners
/// between sparse and dense parts are passed in motion.
#[test]
fn the_way_of_planning_suits_the_list() {
    for (seed, most) in [(95, 2.9), (195, 1.6), (52, 1.05), (48, 1.92)] {
        let (poses, tolerance) = lists::random(seed, 400.0);
        let plan = plan(
            &poses,
            &SmoothOptions::new(tolerance, lists::turning_limits()),
        )
        .unwrap();
        assert!(plan.certificate().holds(), "{seed}");
        let causes: Vec<_> = plan.rests().iter().map(|rest| rest.cause).collect();
        assert!(
            causes.is_empty() && plan.duration() < most,
            "{seed}: {} s, {causes:?}",
            plan.duration()
        );
    }
}

/// As above, 10 000 lists: `cargo test --release -p trajectory --test dense -- --ignored`. The goal
/// is one such list in a thousand; one in twenty is asked here.
#[test]
#[ignore = "takes minutes"]
fn ten_thousand_random_lists_are_certified() {
    let fallbacks = judged(0..10_000, 1500.0);
    assert!(fallbacks.len() <= 600, "{fallbacks:?}");
}
