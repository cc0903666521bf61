#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]
//! Laws of the motion suite.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, plan};

fn circle(count: usize) -> Vec<[f64; 3]> {
    (0..=count)
        .map(|i| TAU * i as f64 / count as f64)
        .map(|a| [100.0 * a.cos(), 100.0 * a.sin(), 0.0])
        .collect()
}

fn placed(points: &[[f64; 3]]) -> Vec<Isometry3<f64>> {
    let places = points.iter().map(|p| Vector3::from(*p) * 1e-3);
    places
        .map(|p| Isometry3::translation(p.x, p.y, p.z))
        .collect()
}

/// Three turns outwards, rising, the tool tilted by 30 degrees.
fn spiral() -> Vec<Isometry3<f64>> {
    let pose = |i| {
        let share = f64::from(i) / 199.0;
        let (angle, radius) = (3.0 * TAU * share, 0.02 + 0.08 * share);
        let place = Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0003 * angle);
        let tilt = Vector3::new(-angle.sin(), angle.cos(), 0.0) * (TAU / 12.0);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(tilt))
    };
    (0..200).map(pose).collect()
}

/// Name, poses, tolerance in m, minimum time in a tube of the tolerance as
/// found by IPOPT for piecewise constant jerk, s.
type Case = (&'static str, Vec<Isometry3<f64>>, f64, f64);

/// The cases of the motion suite.
fn cases() -> Vec<Case> {
    let zigzag: Vec<[f64; 3]> = (0..20_i32)
        .map(|i| {
            let up = f64::from(i % 4 / 2) * 6.0;
            [15.0 * f64::from(i), f64::from(i % 2) * 25.0, up]
        })
        .collect();
    let raster: Vec<[f64; 3]> = (0..40_i32)
        .map(|i| {
            let x = if matches!(i % 4, 1 | 2) { 200.0 } else { 0.0 };
            [x, f64::from(i / 2) * 5.0, 0.0]
        })
        .collect();
    let square = [[0., 0.], [100., 0.], [100., 100.], [0., 100.], [0., 0.]];
    let square = square.map(|[x, y]| [x, y, 0.0]);
    let arch = [[0., 0.], [0., 100.], [300., 100.], [300., 0.]].map(|[x, z]| [x, 0.0, z]);
    vec![
        ("L", placed(&square[..3]), 1e-3, 0.622),
        ("square", placed(&square), 1e-3, 1.165),
        ("zigzag20", placed(&zigzag), 1e-3, 2.872),
        ("circle5", placed(&circle(5)), 1e-3, 1.561),
        ("circle50", placed(&circle(50)), 0.5e-3, 1.402),
        ("arch4", placed(&arch), 20e-3, 1.07),
        ("raster40", placed(&raster), 0.5e-3, 10.78),
        ("spiral200", spiral(), 0.2e-3, 2.499),
    ]
}

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
    for (name, poses, tolerance, reference) in cases() {
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
