//! Shares of the tolerances of single poses, and of the corridor of single legs.

use nalgebra::Isometry3;

/// The shares of the balls of inner poses and of the corridor that a search uses; all where none are narrowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    /// Of the balls of place and orientation, by inner pose.
    balls: Vec<[f64; 2]>,
    /// Of the half widths of the corridors of place and orientation, by the index of the pose at the end of the leg.
    legs: Vec<[f64; 2]>,
}

/// Half width of the corridor of a place that is kept beside a leg, over the length of the leg.
const BESIDE: f64 = 0.1;

impl Shares {
    /// Share of the ball of the place (0) or the orientation (1) of an inner pose.
    pub(crate) fn ball(&self, inner: usize, part: usize) -> f64 {
        self.balls.get(inner).map_or(1.0, |shares| shares[part])
    }

    /// Share of the half width of the corridor of the place (0) or the orientation (1) along the leg to a pose.
    pub(crate) fn leg(&self, to: usize, part: usize) -> f64 {
        self.legs.get(to).map_or(1.0, |shares| shares[part])
    }

    /// Narrows the corridors along the leg to a pose to a share of what they are.
    pub(super) fn narrow_leg(&mut self, to: usize, share: f64) {
        for part in self.leg_mut(to) {
            *part *= share;
        }
    }

    /// Keeps the place beside the leg to one of the poses, much nearer than the leg is long, in a corridor of such a half width (m): it
    /// has no room to go away from that pose before it is there.
    pub(crate) fn keep_beside(&mut self, to: usize, poses: &[Isometry3<f64>], width: f64) {
        let ends = to.checked_sub(1).and_then(|from| poses.get(from..=to));
        let Some([from, goal]) = ends else {
            return;
        };
        let way = (goal.translation.vector - from.translation.vector).norm();
        if way > 0.0 {
            let [place, _] = self.leg_mut(to);
            *place = place.min(BESIDE * way / width);
        }
    }

    /// The shares of the corridors along the leg to a pose.
    fn leg_mut(&mut self, to: usize) -> &mut [f64; 2] {
        if self.legs.len() <= to {
            self.legs.resize(to + 1, [1.0; 2]);
        }
        &mut self.legs[to]
    }

    /// Narrows both balls of an inner pose to shares of what they are.
    pub(super) fn narrow(&mut self, inner: usize, shares: [f64; 2]) {
        if self.balls.len() <= inner {
            self.balls.resize(inner + 1, [1.0; 2]);
        }
        for (ball, share) in self.balls[inner].iter_mut().zip(shares) {
            *ball *= share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place is kept beside a leg by its length, its orientation and other legs are not; a leg without length is left as it is.
    #[test]
    fn a_place_is_kept_beside_its_leg() {
        let poses = [0.0, 0.002, 0.002, 0.5].map(|x| Isometry3::translation(x, 0.0, 0.0));
        let mut shares = Shares::default();
        for to in 0..5 {
            shares.keep_beside(to, &poses, 0.02);
        }
        assert!((shares.leg(1, 0) - BESIDE * 0.1).abs() < 1e-12);
        let all = [shares.leg(1, 1), shares.leg(2, 0), shares.leg(3, 0)];
        assert_eq!(all, [1.0; 3]);
        let before = shares.clone();
        shares.keep_beside(1, &poses, 0.02);
        assert_eq!(shares, before);
    }
}
