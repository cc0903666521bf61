//! The motion suite planned for shipped arms, under their joint limits.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

#[path = "../../trajectory/tests/suite/mod.rs"]
mod suite;

use measure::Trial;
use planner::robot;
use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, plan};

/// Every case is planned with its certificate on every arm, never slower than
/// with stops on the same arm; the time that the joints cost is printed.
#[test]
fn suite_on_arms() {
    let limits = ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    };
    for (case, poses, tolerance, _) in suite::cases() {
        let options = SmoothOptions::new(tolerance, limits);
        let tool = plan(&poses, &options).unwrap();
        let (free, least) = (tool.duration(), tool.certificate().lower_bound);
        for name in ["ur5e", "panda", "iiwa7"] {
            let trial = Trial {
                poses: poses.clone(),
                tolerance,
                limits,
            };
            let row = trial.measure(&robot::load(name).unwrap()).unwrap();
            let motion = row
                .motion
                .unwrap_or_else(|| panic!("{case} on {name}: {row:?}"));
            let lost = 100.0 * (motion / free - 1.0);
            println!("{case} on {name}: {motion:.3} s, lost to the joints {lost:.1} %");
            assert!(
                row.certified && row.deviation_ratio <= 1.0 + 1e-9,
                "{row:?}"
            );
            // A search with the joints may find a curve that is a little faster for the tool, too.
            assert!(
                motion >= least,
                "{case} on {name}: {motion} s, bound {least} s"
            );
            if let Some(stops) = row.exact_stop {
                assert!(motion <= stops * (1.0 + 1e-9), "{case} on {name}: {stops}");
            }
        }
    }
}
