//! Smooth motion through pose lists: motion time beside exact stop and beside
//! an IPOPT optimum. Budget: 2 ms for 3 poses, 5 ms for 5, 2.5 ms per pose in
//! windows, 2 % of the motion time.
//!
//! The reference is the minimum time found by IPOPT for piecewise constant
//! jerk in a tube of the tolerance, same limits (500 mm/s, 5000 mm/s2,
//! 1e5 mm/s3), computed once outside of this repository.
#![allow(missing_docs, clippy::print_stdout, reason = "a benchmark prints")]

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, Windows, measure};

struct Case {
    name: &'static str,
    poses: Vec<Isometry3<f64>>,
    tolerance: f64,
    /// Minimum time by IPOPT, s.
    reference: f64,
}

fn case(name: &'static str, points: &[[f64; 3]], tolerance_mm: f64, reference: f64) -> Case {
    let poses = points
        .iter()
        .map(|p| Isometry3::translation(p[0] * 1e-3, p[1] * 1e-3, p[2] * 1e-3));
    Case {
        name,
        poses: poses.collect(),
        tolerance: tolerance_mm * 1e-3,
        reference,
    }
}

fn circle(count: usize) -> Vec<[f64; 3]> {
    (0..=count)
        .map(|i| TAU * i as f64 / count as f64)
        .map(|a| [100.0 * a.cos(), 100.0 * a.sin(), 0.0])
        .collect()
}

/// Three turns outwards, rising, the tool tilted by 30 degrees.
fn spiral() -> Case {
    let poses = (0..200).map(|i| {
        let share = f64::from(i) / 199.0;
        let (angle, radius) = (3.0 * TAU * share, 0.02 + 0.08 * share);
        let place = Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0003 * angle);
        let tilt = Vector3::new(-angle.sin(), angle.cos(), 0.0) * (TAU / 12.0);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(tilt))
    });
    Case {
        name: "spiral200",
        poses: poses.collect(),
        tolerance: 0.2e-3,
        reference: 2.499,
    }
}

fn cases() -> Vec<Case> {
    let zigzag: Vec<[f64; 3]> = (0..20_i32)
        .map(|i| {
            [
                15.0 * f64::from(i),
                f64::from(i % 2) * 25.0,
                f64::from(i % 4 / 2) * 6.0,
            ]
        })
        .collect();
    let raster: Vec<[f64; 3]> = (0..40_i32)
        .map(|i| {
            [
                if matches!(i % 4, 1 | 2) { 200.0 } else { 0.0 },
                f64::from(i / 2) * 5.0,
                0.0,
            ]
        })
        .collect();
    let square = [
        [0., 0., 0.],
        [100., 0., 0.],
        [100., 100., 0.],
        [0., 100., 0.],
        [0., 0., 0.],
    ];
    let arch = [
        [0., 0., 0.],
        [0., 0., 100.],
        [300., 0., 100.],
        [300., 0., 0.],
    ];
    vec![
        case("L", &square[..3], 1.0, 0.622),
        case("square", &square, 1.0, 1.165),
        case("zigzag20", &zigzag, 1.0, 2.872),
        case("circle5", &circle(5), 1.0, 1.561),
        case("circle50", &circle(50), 0.5, 1.402),
        case("arch4", &arch, 20.0, 1.070),
        case("raster40", &raster, 0.5, 10.78),
        spiral(),
    ]
}

fn main() {
    let limits = ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    };
    println!(
        "case        poses motion_s exact_s plan_ms first_ms deviat corrid veloc  accel  jerk   ok fallbacks"
    );
    let (mut sum, mut lines, mut worst) = (0.0, Vec::new(), 0.0_f64);
    let cases = cases();
    for case in &cases {
        let options = SmoothOptions::new(case.tolerance, limits);
        let rows: Vec<_> = (0..5).map(|_| measure(&case.poses, &options)).collect();
        let planning = rows
            .iter()
            .map(|row| row.planning)
            .fold(f64::INFINITY, f64::min);
        let row = &rows[0];
        let (motion, stop) = (
            row.motion.unwrap_or(f64::NAN),
            row.exact_stop.unwrap_or(f64::NAN),
        );
        println!(
            "{:<11} {:>5} {motion:>8.4} {stop:>7.3} {:>7.2} {:>8.2} {:.4} {:.4} {:.4} {:.4} {:.4} {} {}",
            case.name,
            row.poses,
            planning * 1e3,
            row.first * 1e3,
            row.deviation_ratio,
            row.corridor_ratio,
            row.velocity_ratio,
            row.acceleration_ratio,
            row.jerk_ratio,
            row.certified,
            row.fallbacks,
        );
        lines.push(format!(
            "ratio motion-exact-stop-{} {:.4}",
            case.name,
            motion / stop
        ));
        lines.push(format!(
            "ratio motion-reference-{} {:.4}",
            case.name,
            motion / case.reference
        ));
        sum += (motion / case.reference).ln();
        worst = worst.max(motion / case.reference);
    }
    lines.extend(long_lists(limits));
    for line in lines {
        println!("{line}");
    }
    println!("ratio motion-worst {worst:.4}");
    println!(
        "ratio motion-geomean {:.4}",
        (sum / cases.len() as f64).exp()
    );
}

/// A zigzag of 1000 and of 10 000 poses in windows: time until motion can
/// start, and cost per pose. Budget: first motion within 50 ms, linear cost.
fn long_lists(limits: ToolLimits) -> Vec<String> {
    let [short, long] = [1_000, 10_000].map(|count| {
        let poses: Vec<_> = (0..count)
            .map(|i| Isometry3::translation(0.005 * f64::from(i), 0.004 * f64::from(i % 2), 0.0))
            .collect();
        let clock = std::time::Instant::now();
        let mut windows = match Windows::new(&poses, &SmoothOptions::new(0.5e-3, limits)) {
            Ok(windows) => windows,
            Err(error) => return Err(error.to_string()),
        };
        windows.advance();
        let first = clock.elapsed().as_secs_f64();
        let plan = windows.finish();
        let each = clock.elapsed().as_secs_f64() / f64::from(count);
        println!(
            "{count} poses: first {:.2} ms, {:.3} ms a pose, motion {:.2} s of {:.2} s with stops",
            first * 1e3,
            each * 1e3,
            plan.duration(),
            plan.exact_stop()
        );
        Ok((first, each))
    });
    match (short, long) {
        (Ok(short), Ok(long)) => vec![
            format!("ratio motion-first-10000-to-50ms {:.4}", long.0 / 0.05),
            format!("ratio motion-cost-10000-to-1000 {:.4}", long.1 / short.1),
        ],
        (Err(error), _) | (_, Err(error)) => vec![error],
    }
}
