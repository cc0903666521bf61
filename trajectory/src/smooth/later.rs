//! Poses that a search passes later than its motion does.

use nalgebra::Isometry3;

use super::crossing::{Crossing, crossings_since};
use super::options::SmoothOptions;
use super::span::Span;

/// The inner poses that a search passes on a later approach than its motion does, and for which a pose is missed: they themselves, or
/// the one that is passed next. The search has the passes at the times `searched`, in knots of a spacing (s); the motion passes the
/// poses as they are `made`.
pub(super) fn later(
    spans: &[Span],
    (poses, backwards): (&[Isometry3<f64>], bool),
    options: &SmoothOptions,
    (searched, spacing): (&[f64], f64),
    made: &[Crossing],
) -> Vec<usize> {
    if made.iter().all(Crossing::holds) {
        return Vec::new();
    }
    let times: Vec<f64> = searched.iter().map(|time| time * spacing).collect();
    let single = crossings_since(spans, (poses, backwards), options, &times);
    let apart = |i: &usize| {
        let both = single.get(*i).zip(searched.get(*i));
        both.is_some_and(|(pass, searched)| pass.is_apart(*searched, spacing))
    };
    let before = |i: usize| {
        if backwards {
            Some(i + 1)
        } else {
            i.checked_sub(1)
        }
    };
    let cause = |i: usize| {
        if single[i].holds() {
            before(i)
        } else {
            Some(i)
        }
    };
    let missed = (0..made.len()).filter(|i| !made[*i].holds());
    let mut later: Vec<usize> = missed.filter_map(cause).filter(apart).collect();
    later.sort_unstable();
    later.dedup();
    later
}

#[cfg(test)]
mod tests {
    use super::super::crossing::crossings_made;
    use super::super::span::reversed;
    use super::*;
    use crate::ToolLimits;
    use nalgebra::{UnitQuaternion, Vector3};

    /// One second on a straight line.
    fn straight([from, to]: [[f64; 2]; 2], start: f64) -> Span {
        let mut point = [Vector3::zeros(); 5];
        point[0] = Vector3::new(from[0], from[1], 0.0);
        point[1] = Vector3::new(to[0] - from[0], to[1] - from[1], 0.0);
        Span {
            start,
            duration: 1.0,
            point,
            base: UnitQuaternion::identity(),
            turns: Vec::new(),
        }
    }

    /// There, back, and on to the second inner pose, beside which it goes on the way there.
    fn motion() -> (Vec<Span>, Vec<Isometry3<f64>>) {
        let places = [[0.0, 0.0], [1.0, 0.0], [0.4, 0.0], [0.6, 0.05], [0.7, 0.05]];
        let legs = places.windows(2).enumerate();
        let spans = legs
            .map(|(i, leg)| straight([leg[0], leg[1]], i as f64))
            .collect();
        let poses = [places[0], [0.5, 0.0], places[3], places[4]];
        let poses = poses.map(|[x, y]| Isometry3::translation(x, y, 0.0));
        (spans, poses.to_vec())
    }

    /// The poses that are named for a search with passes at these times, in tenths of a second.
    fn named(spans: &[Span], poses: (&[Isometry3<f64>], bool), searched: &[f64]) -> Vec<usize> {
        let options = SmoothOptions::new(0.01, ToolLimits::UNLIMITED);
        let made = crossings_made(spans, poses, &options);
        later(spans, poses, &options, (searched, 0.1), &made)
    }

    /// A search has the first pose on the way back, the motion passes it on the way there: so it is beside the second pose before it is
    /// there, and misses that. The first is named, from either end; and none where the search has it as it is passed.
    #[test]
    fn a_pose_that_is_passed_early_moves_the_next_pass() {
        let (spans, poses) = motion();
        let (back, there) = (10.0 + 5.0 / 0.6, 30.0);
        let forth = |first: f64| named(&spans, (&poses, false), &[first, there]);
        assert_eq!(forth(back), [0]);
        assert_eq!(forth(5.0), [1]);
        let (turned, mut ends) = (reversed(&spans), poses.clone());
        ends.reverse();
        let searched = [40.0 - there, 40.0 - back];
        assert_eq!(named(&turned, (&ends, true), &searched), [1]);
    }

    /// A pose that is missed where its search has it is not passed later.
    #[test]
    fn a_pose_that_is_missed_where_it_is_searched_is_not_named() {
        let (spans, mut poses) = motion();
        poses[1].translation.vector.z = 0.02;
        assert_eq!(named(&spans[..1], (&poses[..3], false), &[5.0]), []);
    }
}
