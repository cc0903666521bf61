//! Whole turns of joints: other joint positions with the same pose.

use crate::chain::Chain;
use nalgebra::SVector;
use simd::{F4, Four, Mask};
use std::f64::consts::TAU;

/// `q` with every turning joint moved by whole turns to be nearest to `seed`
/// within its limits. A joint that no turn brings inside its limits stays near `seed`.
#[inline]
pub(crate) fn nearest<const N: usize>(
    chain: &Chain<N>,
    q: &SVector<f64, N>,
    seed: &SVector<f64, N>,
) -> SVector<f64, N> {
    SVector::from_fn(|i, _| {
        if chain.prismatic()[i] {
            return q[i];
        }
        let near = q[i] + TAU * ((seed[i] - q[i]) / TAU).round();
        let (low, high) = (chain.lower()[i] - SLACK, chain.upper()[i] + SLACK);
        let moved = if near > high {
            near - TAU * ((near - high) / TAU).ceil()
        } else if near < low {
            near + TAU * ((low - near) / TAU).ceil()
        } else {
            near
        };
        if moved < low || moved > high {
            near
        } else {
            moved.clamp(chain.lower()[i], chain.upper()[i])
        }
    })
}

/// The range of a turning joint, ready for [`Range::nearest`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    low: f64,
    high: f64,
    /// The same in turns, with what rounding is forgiven.
    turns: [f64; 2],
}

impl Range {
    /// From limits, rad.
    pub(crate) fn new(low: f64, high: f64) -> Self {
        let turns = [(low - SLACK) / TAU, (high + SLACK) / TAU];
        Self { low, high, turns }
    }

    /// Four angles moved by whole turns to be nearest to `seed` inside the range; beside
    /// them whether they are.
    #[inline(always)]
    pub(crate) fn nearest<A: Four>(&self, q: F4<A>, seed: f64) -> (F4<A>, Mask<A>) {
        let number = |x: f64| F4::splat(q.build(), x);
        let at = q * (1.0 / TAU);
        let near = (number(seed * (1.0 / TAU) + 0.5) - at).floor();
        let most = (number(self.turns[1]) - at).floor();
        let least = -(at - number(self.turns[0])).floor();
        let moved = near.min(most).max(least).fma(number(TAU), q);
        let held = moved.max(number(self.low)).min(number(self.high));
        (held, least.le(most))
    }
}

/// Rounding that a limit forgives, rad.
pub(crate) const SLACK: f64 = 1e-9;

/// Largest difference of two joint positions, whole turns not counted.
pub(crate) fn distance<const N: usize>(
    chain: &Chain<N>,
    a: &SVector<f64, N>,
    b: &SVector<f64, N>,
) -> f64 {
    (0..N).fold(0.0_f64, |most, i| {
        let d = a[i] - b[i];
        let d = if chain.prismatic()[i] {
            d
        } else {
            d - TAU * (d / TAU).round()
        };
        most.max(d.abs())
    })
}
