//! How far an arm reaches, as a surface around it.

use planner::robot::Robot;
use serde_json::{Value, json};

use crate::forward::Forward;

/// Directions of the surface: about the vertical axis, and from below to above.
const AROUND: usize = 36;
const UPWARDS: usize = 18;

/// How many postures are looked at.
const POSTURES: usize = 60_000;

/// The largest distance of the controlled point in each direction from the middle of what it
/// reaches (m), from postures spread evenly over the ranges of the joints: a little inside the true
/// limit. Directions without any posture have 0.
pub(crate) fn reach(robot: &Robot, point: &Forward) -> Value {
    let points = points(robot, point);
    let mut middle = [0.0; 3];
    for point in &points {
        for (sum, value) in middle.iter_mut().zip(point) {
            *sum += value / points.len() as f64;
        }
    }
    let mut radii = vec![0.0_f64; AROUND * UPWARDS];
    for point in &points {
        let [x, y, z] = std::array::from_fn(|axis| point[axis] - middle[axis]);
        let distance = f64::hypot(f64::hypot(x, y), z);
        let around = (y.atan2(x) / std::f64::consts::TAU + 0.5) * AROUND as f64;
        let upwards =
            ((z / distance.max(1e-9)).asin() / std::f64::consts::PI + 0.5) * UPWARDS as f64;
        let cell = (upwards as usize).min(UPWARDS - 1) * AROUND + (around as usize).min(AROUND - 1);
        if let Some(radius) = radii.get_mut(cell) {
            *radius = radius.max(distance);
        }
    }
    let rounded: Vec<f64> = radii
        .iter()
        .map(|radius| (radius * 1e3).round() * 1e-3)
        .collect();
    json!({"middle": middle, "around": AROUND, "upwards": UPWARDS, "radii": rounded})
}

/// Where the controlled point is in many postures.
///
/// # Source
/// J. H. Halton, On the efficiency of certain quasi-random sequences of points in evaluating
/// multi-dimensional integrals, Numerische Mathematik 2, 1960.
fn points(robot: &Robot, point: &Forward) -> Vec<[f64; 3]> {
    const PRIMES: [usize; 8] = [2, 3, 5, 7, 11, 13, 17, 19];
    let limits = &robot.joints;
    let bound = |value: f64, otherwise: f64| if value.is_finite() { value } else { otherwise };
    let posture = |number: usize| -> Vec<f64> {
        let ranges = limits.lower.iter().zip(&limits.upper).zip(PRIMES);
        let joint = |((lower, upper), prime): ((&f64, &f64), usize)| {
            let lower = bound(*lower, -std::f64::consts::PI);
            let upper = bound(*upper, std::f64::consts::PI);
            lower + (upper - lower) * halton(number, prime)
        };
        ranges.map(joint).collect()
    };
    let place = |number: usize| -> [f64; 3] { point(&posture(number)).translation.vector.into() };
    (1..=POSTURES).map(place).collect()
}

/// Element `number` of the sequence of a prime, in 0..1.
fn halton(mut number: usize, prime: usize) -> f64 {
    let (mut share, mut value) = (1.0, 0.0);
    while number > 0 {
        share /= prime as f64;
        value += share * (number % prime) as f64;
        number /= prime;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::forward;

    /// No posture is outside, and the surface is not much larger than the arm is long.
    #[test]
    fn the_surface_holds_the_home_position() {
        let robot = planner::robot::load("ur5e").unwrap();
        let point = forward(&robot).unwrap();
        let surface = reach(&robot, &point);
        let number = |value: &Value| value.as_f64().unwrap();
        let radii: Vec<f64> = surface["radii"]
            .as_array()
            .unwrap()
            .iter()
            .map(number)
            .collect();
        assert_eq!(radii.len(), AROUND * UPWARDS);
        let most = radii.iter().copied().fold(0.0, f64::max);
        assert!((0.9..1.5).contains(&most), "{most} m");
        let home = point(&robot.home).translation.vector;
        let away: f64 = (0..3)
            .map(|axis| (home[axis] - number(&surface["middle"][axis])).powi(2))
            .sum();
        assert!(away.sqrt() < most);
        let empty = radii.iter().filter(|radius| **radius == 0.0).count();
        assert!(
            empty * 20 < radii.len(),
            "{empty} directions without a posture"
        );
    }
}
