//! Shares of the tolerances of single poses.

/// The shares of the balls of inner poses that a search uses; all where none are narrowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    /// Of the balls of place and orientation, by inner pose.
    balls: Vec<[f64; 2]>,
}

impl Shares {
    /// Share of the ball of the place (0) or the orientation (1) of an inner pose.
    pub(crate) fn ball(&self, inner: usize, part: usize) -> f64 {
        self.balls.get(inner).map_or(1.0, |shares| shares[part])
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
