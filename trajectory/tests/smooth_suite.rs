//! Properties of the motions of the motion suite.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod suite;

use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, plan};

/// More tolerance never costs time, and at the tolerance of the case the motion
/// is about as fast as the optimum.
#[test]
fn more_tolerance_is_never_slower() {
    let limits = ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    };
    let (mut bad, mut sum, mut count) = (Vec::new(), 0.0, 0.0);
    for (name, poses, tolerance, reference) in suite::cases() {
        let mut before = f64::INFINITY;
        for k in -4..4 {
            let tolerance = tolerance * 2_f64.powi(k);
            let plan = plan(&poses, &SmoothOptions::new(tolerance, limits)).unwrap();
            let certificate = plan.certificate();
            assert!(certificate.holds(), "{name} {tolerance}");
            assert!(!certificate.active.is_empty());
            let (time, least) = (plan.duration(), certificate.optimality());
            println!(
                "{name} {:8.4} mm {time:.5} s, over bound {least:.3}",
                tolerance * 1e3
            );
            assert!(least >= 1.0, "{name} {tolerance} {least}");
            if time > before {
                bad.push(format!("{name} {tolerance}: {time} after {before}"));
            }
            before = time;
            if k == 0 {
                let ratio: f64 = time / reference;
                assert!(ratio < 1.05, "{name} {ratio}");
                (sum, count) = (sum + ratio.ln(), count + 1.0);
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
    assert!((sum / count).exp() < 1.02);
}
