//! Where the way of a list turns back on itself.

use nalgebra::{Isometry3, Vector3};

use crate::line::body_turn;

/// Distance from a pose at which the way to it and from it are compared, in tolerances: what is nearer a
/// motion may cut off.
const AWAY: f64 = 4.0;
/// Cosine of the turn from one to the other from which on the way turns back. At 120 degrees the widest arc
/// that passes the pose within the tolerance has the tolerance as its radius; at this angle 0.6 of it.
const BACK: f64 = -0.7;

/// Whether the way turns back at pose `at` or beside it, seen at a few tolerances (m, rad): the place does,
/// or, where the place stays within them, the orientation.
pub(super) fn turns_back(poses: &[Isometry3<f64>], at: usize, tolerances: [f64; 2]) -> bool {
    let near = |k: &usize| distance(&poses[*k], &poses[at], tolerances) < AWAY;
    let first = (0..at).rev().take_while(near).last().unwrap_or(at);
    let last = (at + 1..poses.len()).take_while(near).last().unwrap_or(at);
    (first.saturating_sub(1)..=(last + 1).min(poses.len() - 1))
        .any(|k| cosine(poses, k, tolerances).is_some_and(|cosine| cosine < BACK))
}

/// Distance of two poses in tolerances, the larger of place and orientation.
fn distance(one: &Isometry3<f64>, other: &Isometry3<f64>, tolerances: [f64; 2]) -> f64 {
    let way = (one.translation.vector - other.translation.vector).norm();
    let turn = body_turn(&one.rotation, &other.rotation).norm();
    (way / tolerances[0]).max(turn / tolerances[1])
}

/// Cosine of the turn from the way to a pose to that from it; `None` near an end of the list.
fn cosine(poses: &[Isometry3<f64>], at: usize, [place, turn]: [f64; 2]) -> Option<f64> {
    let pose = &poses[at];
    let way = |other: &Isometry3<f64>| other.translation.vector - pose.translation.vector;
    let turned = |other: &Isometry3<f64>| body_turn(&pose.rotation, &other.rotation);
    let both = |offset: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>, radius: f64| {
        let before = leaves(poses[..at].iter().rev().map(offset), radius)?;
        let after = leaves(poses[at + 1..].iter().map(offset), radius)?;
        Some(-before.dot(&after) / (before.norm() * after.norm()))
    };
    both(&way, AWAY * place).or_else(|| both(&turned, AWAY * turn))
}

/// Where a polyline that begins in a place leaves the ball of a radius around it; offsets from the place.
fn leaves(offsets: impl Iterator<Item = Vector3<f64>>, radius: f64) -> Option<Vector3<f64>> {
    let mut from = Vector3::zeros();
    for to in offsets {
        if to.norm() >= radius {
            // On the leg from inside to outside.
            let way = to - from;
            let (a, b) = (way.norm_squared(), from.dot(&way));
            let c = radius * radius - from.norm_squared();
            let share = ((b * b + a * c).sqrt() - b) / a;
            return Some(from + way * share);
        }
        from = to;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(places: &[[f64; 2]]) -> Vec<Isometry3<f64>> {
        let pose = |p: &[f64; 2]| Isometry3::translation(p[0], p[1], 0.0);
        places.iter().map(pose).collect()
    }

    /// A spike turns back, a right angle does not, and noise within the tolerance is not seen.
    #[test]
    fn spikes_turn_back_and_corners_do_not() {
        let tolerances = [1e-3, 0.02];
        let spike = list(&[[0.0, 0.0], [0.1, 0.0], [0.0, 0.01]]);
        let corner = list(&[[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]]);
        assert!(turns_back(&spike, 1, tolerances));
        assert!(!turns_back(&corner, 1, tolerances));
        let noisy: Vec<_> = (0..100)
            .map(|i| [1e-4 * f64::from(i), 2e-4 * f64::from(i % 2)])
            .collect();
        assert!(!(1..99).any(|at| turns_back(&list(&noisy), at, tolerances)));
        // Dense, and found from a pose beside the tip.
        let dense: Vec<_> = (0..=400)
            .map(|i| 0.2 - (0.2 - 1e-3 * f64::from(i)).abs())
            .map(|x| [x, 0.0])
            .collect();
        assert!(turns_back(&list(&dense), 202, tolerances));
        assert!(!turns_back(&list(&dense), 150, tolerances));
    }

    /// Where the place rests the orientation counts.
    #[test]
    fn orientations_turn_back_on_the_spot() {
        let turned = |angle: f64| Isometry3::new(Vector3::zeros(), Vector3::z() * angle);
        let there = [turned(0.0), turned(0.5), turned(1.0)];
        let back = [turned(0.0), turned(0.5), turned(0.1)];
        assert!(!turns_back(&there, 1, [1e-3, 0.02]));
        assert!(turns_back(&back, 1, [1e-3, 0.02]));
    }
}
