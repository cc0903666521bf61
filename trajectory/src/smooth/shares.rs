//! Shares of the tolerances of single poses, and of the corridor of single legs.

/// The shares of the balls of inner poses and of the corridor that a search uses; all where none are narrowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    /// Of the balls of place and orientation, by inner pose.
    balls: Vec<[f64; 2]>,
    /// Of the half width of the corridor, by the index of the pose at the end of the leg.
    legs: Vec<f64>,
}

impl Shares {
    /// Share of the ball of the place (0) or the orientation (1) of an inner pose.
    pub(crate) fn ball(&self, inner: usize, part: usize) -> f64 {
        self.balls.get(inner).map_or(1.0, |shares| shares[part])
    }

    /// Share of the half width of the corridor along the leg to a pose.
    pub(crate) fn leg(&self, to: usize) -> f64 {
        self.legs.get(to).copied().unwrap_or(1.0)
    }

    /// Narrows the corridor along the leg to a pose to a share of what it is.
    pub(super) fn narrow_leg(&mut self, to: usize, share: f64) {
        if self.legs.len() <= to {
            self.legs.resize(to + 1, 1.0);
        }
        self.legs[to] *= share;
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
