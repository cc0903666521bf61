//! Where the way of a list turns back on itself.

use nalgebra::{Isometry3, Vector3};

use crate::line::body_turn;

/// Distance from a place at which the way to it and from it are compared, in tolerances: what is nearer a motion may
/// cut off.
const AWAY: f64 = 4.0;
/// Cosine of the turn from one to the other from which on the way turns back. At 120 degrees the widest arc
/// that passes the pose within the tolerance has the tolerance as its radius; at this angle 0.6 of it.
const BACK: f64 = -0.7;

/// Whether the way turns back at a place on it, which lies before the pose with the number `after`, seen at a few
/// tolerances (m, rad) from the place: the controlled point does, or, where it stays within them to one side, the
/// orientation.
pub(super) fn turns_back(
    place: &Isometry3<f64>,
    poses: &[Isometry3<f64>],
    after: usize,
    [near, askew]: [f64; 2],
) -> bool {
    let way = |other: &Isometry3<f64>| other.translation.vector - place.translation.vector;
    let turned = |other: &Isometry3<f64>| body_turn(&place.rotation, &other.rotation);
    let cosine = |offset: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>, radius: f64| {
        let before = leaves(poses[..after].iter().rev().map(offset), radius)?;
        let after = leaves(poses[after..].iter().map(offset), radius)?;
        Some(-before.dot(&after) / (before.norm() * after.norm()))
    };
    let cosine = cosine(&way, AWAY * near).or_else(|| cosine(&turned, AWAY * askew));
    cosine.is_some_and(|cosine| cosine < BACK)
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
        let at = |list: &[Isometry3<f64>], k: usize| turns_back(&list[k], list, k + 1, tolerances);
        assert!(at(&spike, 1));
        assert!(!at(&corner, 1));
        let noisy: Vec<_> = (0..100)
            .map(|i| [1e-4 * f64::from(i), 2e-4 * f64::from(i % 2)])
            .collect();
        assert!(!(1..99).any(|k| at(&list(&noisy), k)));
        // Dense, at the tip and not farther from it than is seen.
        let dense: Vec<_> = (0..=400)
            .map(|i| 0.2 - (0.2 - 1e-3 * f64::from(i)).abs())
            .map(|x| [x, 0.0])
            .collect();
        assert!(at(&list(&dense), 200) && at(&list(&dense), 202));
        assert!(!at(&list(&dense), 150));
    }

    /// Where the place rests the orientation counts.
    #[test]
    fn orientations_turn_back_on_the_spot() {
        let turned = |angle: f64| Isometry3::new(Vector3::zeros(), Vector3::z() * angle);
        let there = [turned(0.0), turned(0.5), turned(1.0)];
        let back = [turned(0.0), turned(0.5), turned(0.1)];
        assert!(!turns_back(&there[1], &there, 2, [1e-3, 0.02]));
        assert!(turns_back(&back[1], &back, 2, [1e-3, 0.02]));
    }
}
