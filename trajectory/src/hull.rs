//! Bernstein hulls of a piece and its derivatives, all joints at once.

use nalgebra::SVector;
use realtime::Piece;
use simd::{F4, Four, Op, groups};

/// Ratios below this need no better bound than the hull: they are far from the limit.
pub(crate) const FLOOR: f64 = 0.9;
/// Largest distance of a hull from a ratio that is reached.
pub(crate) const TOLERANCE: f64 = 1e-7;

/// Of one derivative of each joint over a piece, over its limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hull<const N: usize> {
    /// The largest magnitude of its Bernstein points, which bounds it over the piece.
    pub most: [f64; N],
    /// The larger of the values at both ends.
    pub ends: [f64; N],
    /// Whether for some joint the bound may be too high by more than the tolerance, above the
    /// floor.
    pub loose: bool,
}

/// The hulls of velocity, acceleration and jerk over a piece, times `narrow`: one over each limit.
///
/// # Source
/// Convex hull property of the Bernstein form (Farin, Curves and Surfaces for CAGD, 2002,
/// chapter 5).
pub(crate) struct Hulls<'a, const N: usize> {
    pub piece: &'a Piece<N>,
    pub narrow: &'a [SVector<f64, N>; 3],
}

impl<const N: usize> Op for Hulls<'_, N> {
    type Output = [Hull<N>; 3];

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> [Hull<N>; 3] {
        let mut hulls = [Hull {
            most: [0.0; N],
            ends: [0.0; N],
            loose: false,
        }; 3];
        let [velocity, acceleration, jerk] = &mut hulls;
        let [n1, n2, n3] = self.narrow;
        let [_, c1, c2, c3, c4, c5] = &self.piece.coefficients;
        let t = F4::splat(simd, self.piece.duration);
        let t2 = t * t;
        let (t3, t4) = (t2 * t, t2 * t2);
        for at in groups(N) {
            let (c1, c2) = (
                F4::some(simd, c1.as_slice(), at),
                F4::some(simd, c2.as_slice(), at),
            );
            let (c3, c4, c5) = (
                F4::some(simd, c3.as_slice(), at),
                F4::some(simd, c4.as_slice(), at),
                F4::some(simd, c5.as_slice(), at),
            );
            let (a, b, c) = (c2 * t, c3 * t2, c4 * t3);
            let near = c1 + a + b * 0.5;
            let far = c1 + (a + b) * 1.5 + c;
            let last = c1 + a * 2.0 + b * 3.0 + c * 4.0 + c5 * t4 * 5.0;
            velocity.take(n1, at, [c1, c1 + a * 0.5, near, far, last]);
            let (a, b, c) = (c2 * 2.0, c3 * t * 2.0, c4 * t2 * 4.0);
            let last = a + b * 3.0 + c * 3.0 + c5 * t3 * 20.0;
            acceleration.take(n2, at, [a, a + b, a + b * 2.0 + c, last]);
            let (a, b) = (c3 * 6.0, c4 * t * 12.0);
            jerk.take(n3, at, [a, a + b, a + b * 2.0 + c5 * t2 * 60.0]);
        }
        hulls
    }
}

impl<const N: usize> Hull<N> {
    /// Adds the Bernstein points of the joints from `at` on.
    #[inline(always)]
    fn take<S: Four, const M: usize>(
        &mut self,
        narrow: &SVector<f64, N>,
        at: usize,
        points: [F4<S>; M],
    ) {
        let simd = points[0].build();
        let narrow = F4::some(simd, narrow.as_slice(), at);
        let ends = points[0].abs().max(points[M - 1].abs());
        let mut most = ends;
        for point in &points[1..M - 1] {
            most = point.abs().max(most);
        }
        let (most, ends) = (most * narrow, ends * narrow);
        most.put(&mut self.most, at);
        ends.put(&mut self.ends, at);
        let below = F4::splat(simd, FLOOR) - most;
        let exact = F4::splat(simd, TOLERANCE) - (most - ends);
        self.loose |= below.max(exact).least() < 0.0;
    }
}

/// The hull of the positions over a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent<const N: usize> {
    /// Where it begins and ends.
    pub ends: [[f64; N]; 2],
    /// The lowest and the highest of its Bernstein points, which bound it over the piece.
    pub hull: [[f64; N]; 2],
}

/// The hull of the positions over a piece.
///
/// # Source
/// As [`Hulls`].
pub(crate) struct Extents<'a, const N: usize>(pub &'a Piece<N>);

impl<const N: usize> Op for Extents<'_, N> {
    type Output = Extent<N>;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> Extent<N> {
        let mut extent = Extent {
            ends: [[0.0; N]; 2],
            hull: [[0.0; N]; 2],
        };
        let t = F4::splat(simd, self.0.duration);
        let t2 = t * t;
        let powers = [t, t2, t2 * t, t2 * t2, t2 * t2 * t];
        for at in groups(N) {
            let [c0, rest @ ..] = self.0.coefficients.each_ref();
            let first = F4::some(simd, c0.as_slice(), at);
            let term = |k: usize| F4::some(simd, rest[k].as_slice(), at) * powers[k];
            let (a, b, c, d, e) = (term(0), term(1), term(2), term(3), term(4));
            let points = [
                first,
                first + a * 0.2,
                first + a * 0.4 + b * 0.1,
                first + a * 0.6 + b * 0.3 + c * 0.1,
                first + a * 0.8 + b * 0.6 + c * 0.4 + d * 0.2,
                first + a + b + c + d + e,
            ];
            let (mut low, mut high) = (first, first);
            for point in &points[1..] {
                (low, high) = (point.min(low), point.max(high));
            }
            first.put(&mut extent.ends[0], at);
            points[5].put(&mut extent.ends[1], at);
            low.put(&mut extent.hull[0], at);
            high.put(&mut extent.hull[1], at);
        }
        extent
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poly::bernstein;
    use simd::Build;

    /// Against the derivatives at many places: bounded everywhere, met at the ends; the same in
    /// both builds, for more and fewer joints than a register holds.
    fn bounds<const N: usize>() {
        let coefficients = [0.3, -2.0, 1.0, 4.0, -3.0, 1.5]
            .map(|c| SVector::<f64, N>::from_fn(|j, _| c * (1.0 + 0.3 * j as f64).sin()));
        let piece = Piece {
            duration: 0.7,
            coefficients,
        };
        let extents = |build: Build| build.run(Extents(&piece));
        let (extent, plain) = (extents(Build::detect()), extents(Build::Plain));
        assert_eq!((extent.ends, extent.hull), (plain.ends, plain.hull));
        let form = bernstein(&coefficients, 0.0, 0.7);
        for j in 0..N {
            let [low, high] = [extent.hull[0][j], extent.hull[1][j]];
            let points = form.map(|point| point[j]);
            let ends = [points[0] - extent.ends[0][j], points[5] - extent.ends[1][j]];
            let hull = [
                points.iter().copied().fold(f64::INFINITY, f64::min) - low,
                points.iter().copied().fold(f64::NEG_INFINITY, f64::max) - high,
            ];
            assert!(ends.iter().chain(&hull).all(|off| off.abs() < 1e-14));
        }
        let narrow = [0.5, 0.1, 0.02].map(SVector::repeat);
        let hulls = |build: Build| {
            build.run(Hulls {
                piece: &piece,
                narrow: &narrow,
            })
        };
        let (hulls, plain) = (hulls(Build::detect()), hulls(Build::Plain));
        let samples = (0..=1000).map(|i| piece.sample(0.7 * f64::from(i) / 1000.0));
        let samples: Vec<_> = samples
            .map(|s| [s.velocity, s.acceleration, s.jerk])
            .collect();
        for order in 0..3 {
            let (hull, plain) = (&hulls[order], &plain[order]);
            assert_eq!((hull.most, hull.ends), (plain.most, plain.ends));
            let mut loose = false;
            for j in 0..N {
                let ratio = |i: usize| (samples[i][order][j] * narrow[order][j]).abs();
                let most = (0..=1000).map(ratio).fold(0.0, f64::max);
                let ends = ratio(0).max(ratio(1000));
                assert!(most <= hull.most[j] * (1.0 + 1e-12));
                assert!((hull.ends[j] - ends).abs() < 1e-12 * (1.0 + ends));
                loose |= hull.most[j] > FLOOR && hull.most[j] - hull.ends[j] > TOLERANCE;
            }
            assert_eq!((hull.loose, plain.loose), (loose, loose));
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
