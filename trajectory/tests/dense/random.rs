//! Random dense lists: closed and open curves, noise, uneven spacing, cusps, doubled poses, mixed
//! density, changing orientation.

use trajectory::ToolLimits;
use trajectory::smooth::{RestCause, SmoothOptions, plan};

use crate::lists;

/// Plans so many lists: each is certified and never slower than exact stops; the seeds of those that
/// rest elsewhere than where the way turns back. The rests of these are named.
fn judged(seeds: std::ops::Range<u64>, most: f64) -> Vec<u64> {
    let mut fallbacks = Vec::new();
    for seed in seeds {
        let (poses, tolerance) = lists::random(seed, most);
        let limits = ToolLimits {
            angular_speed: 3.0,
            angular_acceleration: 30.0,
            angular_jerk: 600.0,
            ..lists::limits()
        };
        let plan = plan(&poses, &SmoothOptions::new(tolerance, limits)).unwrap();
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
    assert!(judged(0..24, 400.0).len() <= 4);
}

/// As above, 10 000 lists: `cargo test --release -p trajectory --test dense -- --ignored`. The goal
/// is one such list in a thousand; one in twenty is asked here.
#[test]
#[ignore = "takes minutes"]
fn ten_thousand_random_lists_are_certified() {
    let fallbacks = judged(0..10_000, 1500.0);
    assert!(fallbacks.len() <= 600, "{fallbacks:?}");
}
