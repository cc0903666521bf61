//! Dense lists: those of the suite by their formulas, and others.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};
use trajectory::ToolLimits;

/// Limits of the suite.
pub(crate) fn limits() -> ToolLimits {
    ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    }
}

/// The same, and limits of rotation.
pub(crate) fn turning_limits() -> ToolLimits {
    ToolLimits {
        angular_speed: 3.0,
        angular_acceleration: 30.0,
        angular_jerk: 600.0,
        ..limits()
    }
}

/// One list: tolerance in m, least time along the exact curve in s, found by an interior-point
/// solver.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) poses: Vec<Isometry3<f64>>,
    pub(crate) tolerance: f64,
    pub(crate) reference: f64,
}

/// Poses on a curve of the angle (places in mm), `count` legs in one turn of the angle.
pub(crate) fn along(count: usize, curve: impl Fn(f64) -> [f64; 3]) -> Vec<Isometry3<f64>> {
    let angle = |i| TAU * i as f64 / count as f64;
    let place = |i| Vector3::from(curve(angle(i))) * 1e-3;
    let pose = |i| Isometry3::from_parts(place(i).into(), nalgebra::UnitQuaternion::identity());
    (0..=count).map(pose).collect()
}

/// The six lists of the suite.
pub(crate) fn suite() -> Vec<Case> {
    let circle = along(360, |a| [60.0 * a.cos(), 60.0 * a.sin(), 0.0]);
    let helix = along(1500, |a| {
        let b = 3.0 * a;
        [40.0 * b.cos(), 40.0 * b.sin(), 2.5 * b]
    });
    let clover = along(2400, |a| {
        let radius = 70.0 + 25.0 * (3.0 * a).cos();
        [radius * a.cos(), radius * a.sin(), 6.0 * (2.0 * a).sin()]
    });
    let eight = along(900, |a| [120.0 * a.sin(), 60.0 * (2.0 * a).sin(), 0.0]);
    let wave = along(3000, |a| {
        [100.0 * a, 15.0 * (4.0 * a).sin(), 5.0 * (2.0 * a).sin()]
    });
    let pocket = along(2000, |a| {
        let b = 4.0 * a;
        [24.0 * a - 12.0 * b.sin(), 12.0 * b.cos(), 0.0]
    });
    let case = |name, poses, tolerance, reference| Case {
        name,
        poses,
        tolerance,
        reference,
    };
    vec![
        case("circle360", circle, 1e-4, 0.9086),
        case("helix1500", helix, 5e-5, 1.8366),
        case("clover2400", clover, 5e-5, 1.5),
        case("eight900", eight, 1e-4, 1.7267),
        case("wave3000", wave, 5e-5, 1.5606),
        case("pocket2000", pocket, 5e-5, 1.3402),
    ]
}

/// A straight leg, a quarter of a circle of a radius (m) with `count` legs, a straight leg.
pub(crate) fn straight_bend_straight(
    length: f64,
    radius: f64,
    count: usize,
) -> Vec<Isometry3<f64>> {
    let mut poses = vec![Isometry3::translation(0.0, 0.0, 0.0)];
    for i in 0..=count {
        let (sine, cosine) = (TAU / 4.0 * i as f64 / count as f64).sin_cos();
        poses.push(Isometry3::translation(
            length + radius * sine,
            radius * (1.0 - cosine),
            0.0,
        ));
    }
    poses.push(Isometry3::translation(
        length + radius,
        radius + length,
        0.0,
    ));
    poses
}

/// Numbers from 0 to 1, the same for each seed.
///
/// # Source
/// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(seed + 1) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        self.next() < share
    }

    pub(crate) fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-size, size))
    }
}

/// A random dense list, and its tolerance.
pub(crate) fn random(seed: u64, most: f64) -> (Vec<Isometry3<f64>>, f64) {
    let mut random = Random::new(seed);
    for _ in 0..8 {
        random.next();
    }
    let tolerance = 1e-5 * 100.0_f64.powf(random.next());
    let count = random.between(100.0, most) as usize;
    // A sum of waves: closed or open, with cusps where a wave stands still.
    let kind = (random.next() * 4.0) as usize;
    let waves: Vec<(f64, Vector3<f64>, f64)> = (0..4)
        .map(|k| {
            let rate = f64::from(k + 1)
                * if kind == 1 {
                    random.between(0.6, 1.4)
                } else {
                    1.0
                };
            let size = 0.08 / f64::from((k + 1) * (k + 1));
            (rate, random.vector(size), random.between(0.0, TAU))
        })
        .collect();
    let drift = if kind == 2 {
        random.vector(0.3)
    } else {
        Vector3::zeros()
    };
    let place = |share: f64| {
        let wave = |w: &(f64, Vector3<f64>, f64)| w.1 * (w.0 * TAU * share + w.2).sin();
        drift * share + waves.iter().map(wave).sum::<Vector3<f64>>()
    };
    let uneven = random.chance(0.3).then(|| random.between(0.2, 0.9));
    let noise = if random.chance(0.4) {
        tolerance * random.between(0.0, 0.1)
    } else {
        0.0
    };
    let turning = random.chance(0.4).then(|| random.vector(1.0));
    let (doubled, sparse) = (random.chance(0.2), random.chance(0.2));
    let mut poses = Vec::with_capacity(count + 1);
    for i in 0..=count {
        let mut share = i as f64 / count as f64;
        if let Some(uneven) = uneven {
            share += uneven * (TAU * 3.0 * share).sin() / (3.0 * TAU);
        }
        if kind == 3 {
            // There and back on the same way: a cusp in the middle.
            share = 0.5 - (share - 0.5).abs();
        }
        if sparse && (0.3..0.5).contains(&share) && i % 40 != 0 {
            continue;
        }
        let point = place(share) + random.vector(noise);
        let turn = turning.map_or_else(Vector3::zeros, |axis| axis * (TAU * share).sin());
        let pose = Isometry3::new(point, turn);
        poses.push(pose);
        if doubled && random.chance(0.05) {
            poses.push(pose);
        }
    }
    (poses, tolerance)
}
