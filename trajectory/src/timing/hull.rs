//! Hulls of the derivatives of a piece, all joints at once.

use nalgebra::SVector;
use realtime::Piece;

use super::lanes::{LANE, Wave};
use crate::wide::{Four, Op};

/// Of one derivative of each joint over a piece: the largest magnitude of its Bernstein points,
/// which bounds it all along, and that of its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hull<const N: usize> {
    pub most: [f64; N],
    pub ends: [f64; N],
}

/// The hulls of velocity, acceleration and jerk over a piece.
///
/// # Source
/// Convex hull property of the Bernstein form (Farin, Curves and Surfaces for CAGD, 2002,
/// chapter 5).
pub(super) struct Hulls<'a, const N: usize>(pub &'a Piece<N>);

impl<const N: usize> Op for Hulls<'_, N> {
    type Output = [Hull<N>; 3];

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> [Hull<N>; 3] {
        let mut hulls = [Hull {
            most: [0.0; N],
            ends: [0.0; N],
        }; 3];
        let [_, c1, c2, c3, c4, c5] = &self.0.coefficients;
        let t = Wave::splat(simd, self.0.duration);
        let (t2, t3, t4) = (t * t, t * t * t, t * t * t * t);
        let mut start = 0;
        while start < N {
            // The last joints once more where they do not fill a register.
            let at = start.min(N.saturating_sub(LANE));
            let (c1, c2) = (joints(simd, c1, at), joints(simd, c2, at));
            let (c3, c4, c5) = (
                joints(simd, c3, at),
                joints(simd, c4, at),
                joints(simd, c5, at),
            );
            let (a, b, c) = (c2 * t, c3 * t2, c4 * t3);
            let near = c1 + a + b * 0.5;
            let far = c1 + (a + b) * 1.5 + c;
            let last = c1 + a * 2.0 + b * 3.0 + c * 4.0 + c5 * t4 * 5.0;
            hulls[0].take(at, [c1, c1 + a * 0.5, near, far, last]);
            let (a, b, c) = (c2 * 2.0, c3 * t * 2.0, c4 * t2 * 4.0);
            let last = a + b * 3.0 + c * 3.0 + c5 * t3 * 20.0;
            hulls[1].take(at, [a, a + b, a + b * 2.0 + c, last]);
            let (a, b) = (c3 * 6.0, c4 * t * 12.0);
            hulls[2].take(at, [a, a + b, a + b * 2.0 + c5 * t2 * 60.0]);
            start += LANE;
        }
        hulls
    }
}

impl<const N: usize> Hull<N> {
    /// Takes in the Bernstein points of the joints from `at` on.
    #[inline(always)]
    fn take<S: Four, const M: usize>(&mut self, at: usize, points: [Wave<S>; M]) {
        let ends = points[0].abs().max(points[M - 1].abs());
        let mut most = ends;
        for point in &points[1..M - 1] {
            most = point.abs().max(most);
        }
        for (to, from) in [(&mut self.most, most), (&mut self.ends, ends)] {
            let lane = from.lane();
            let count = LANE.min(N);
            to[at..at + count].copy_from_slice(&lane[..count]);
        }
    }
}

/// The numbers of four joints, or of all where there are fewer.
#[inline(always)]
fn joints<S: Four, const N: usize>(simd: S, all: &SVector<f64, N>, at: usize) -> Wave<S> {
    let all = all.as_slice();
    if N >= LANE {
        return Wave::load(simd, &all[at..at + LANE]);
    }
    let mut lane = [0.0; LANE];
    lane[..N].copy_from_slice(all);
    Wave::load(simd, &lane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::Wide;

    /// Against sums over the derivatives at many places: bounded everywhere, met at the ends; the
    /// same in both builds, for more and fewer joints than a register holds.
    fn bounds<const N: usize>() {
        let coefficients = [0.3, -2.0, 1.0, 4.0, -3.0, 1.5].map(|c| {
            SVector::<f64, N>::from_fn(|j, _| c * (1.0 + 0.3 * j as f64).sin())
        });
        let piece = Piece {
            duration: 0.7,
            coefficients,
        };
        let hulls = Wide::detect().run(Hulls(&piece));
        let plain = Wide::plain().run(Hulls(&piece));
        let samples = (0..=1000).map(|i| piece.sample(0.7 * f64::from(i) / 1000.0));
        let samples: Vec<_> = samples.map(|s| [s.velocity, s.acceleration, s.jerk]).collect();
        for order in 0..3 {
            let (hull, plain) = (&hulls[order], &plain[order]);
            assert_eq!((hull.most, hull.ends), (plain.most, plain.ends));
            for j in 0..N {
                let values = samples.iter().map(|s| s[order][j].abs());
                let most = values.fold(0.0, f64::max);
                let ends = samples[0][order][j].abs().max(samples[1000][order][j].abs());
                assert!(most <= hull.most[j] * (1.0 + 1e-12));
                assert!((hull.ends[j] - ends).abs() < 1e-9 * (1.0 + ends));
            }
        }
    }

    #[test]
    fn hulls_bound_every_joint() {
        bounds::<1>();
        bounds::<3>();
        bounds::<4>();
        bounds::<7>();
        bounds::<9>();
    }
}
