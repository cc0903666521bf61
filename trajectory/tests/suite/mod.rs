//! The motion suite, for the tests of this crate and others, and for the benchmark.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

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
pub(crate) type Case = (&'static str, Vec<Isometry3<f64>>, f64, f64);

/// The cases of the motion suite.
pub(crate) fn cases() -> Vec<Case> {
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
