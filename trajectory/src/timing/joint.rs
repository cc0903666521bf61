//! Pieces between two states of motion, all joints at once.

use nalgebra::SVector;
use realtime::{Piece, Sample};

use super::gridpoints::Gridpoint;
use super::problem::Spot;
use simd::{F4, Four, Op, groups};

/// The motion of the joints at a gridpoint, where the law is `spot`.
pub(super) struct Motion<'a, const N: usize> {
    pub gridpoint: &'a Gridpoint<N>,
    pub spot: Spot,
}

impl<const N: usize> Op for Motion<'_, N> {
    type Output = Sample<N>;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> Sample<N> {
        let mut sample = Sample::rest(self.gridpoint.position);
        let [first, second, third] = &self.gridpoint.joint;
        let Spot { a, b, c } = self.spot;
        let root = a.sqrt();
        let [a, b, c, root] = [
            F4::splat(simd, a),
            F4::splat(simd, b),
            F4::splat(simd, c),
            F4::splat(simd, root),
        ];
        for at in groups(N) {
            let q1 = F4::some(simd, first.as_slice(), at);
            let q2 = F4::some(simd, second.as_slice(), at);
            let q3 = F4::some(simd, third.as_slice(), at);
            (q1 * root).put(sample.velocity.as_mut_slice(), at);
            (q2 * a + q1 * b).put(sample.acceleration.as_mut_slice(), at);
            let jerk = (q3 * a + q2 * b * 3.0 + q1 * c) * root;
            jerk.put(sample.jerk.as_mut_slice(), at);
        }
        sample
    }
}

/// The quintic from `start` to `end`, and how far its jerk is from theirs at most, over the limit.
pub(super) struct Join<'a, const N: usize> {
    pub duration: f64,
    pub start: &'a Sample<N>,
    pub end: &'a Sample<N>,
    /// One over the jerk limits.
    pub narrow: &'a SVector<f64, N>,
}

impl<const N: usize> Op for Join<'_, N> {
    type Output = (Piece<N>, f64);

    /// # Source
    /// As [`Piece::hermite`].
    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> (Piece<N>, f64) {
        let mut piece = Piece::hold(self.start.position, self.duration);
        let [_, c1, c2, c3, c4, c5] = &mut piece.coefficients;
        let (start, end) = (self.start, self.end);
        let t = F4::splat(simd, self.duration);
        let inverse = t.inverse();
        let (square, cube) = (t * t, inverse * inverse * inverse);
        let mut off = F4::splat(simd, 0.0);
        for at in groups(N) {
            let [p, v, a, j] = sample(simd, start, at);
            let [p1, v1, a1, j1] = sample(simd, end, at);
            v.put(c1.as_mut_slice(), at);
            (a * 0.5).put(c2.as_mut_slice(), at);
            let step = p1 - p;
            let (v0, v1) = (v * t, v1 * t);
            let (a0, a1) = (a * square, a1 * square);
            let third = step * 10.0 - v0 * 6.0 - v1 * 4.0 - (a0 * 3.0 - a1) * 0.5;
            let fourth = v0 * 8.0 + v1 * 7.0 - step * 15.0 + (a0 * 3.0 - a1 * 2.0) * 0.5;
            let fifth = step * 6.0 - (v0 + v1) * 3.0 - (a0 - a1) * 0.5;
            let third = third * cube;
            let (fourth, fifth) = (fourth * cube, fifth * cube);
            third.put(c3.as_mut_slice(), at);
            (fourth * inverse).put(c4.as_mut_slice(), at);
            (fifth * inverse * inverse).put(c5.as_mut_slice(), at);
            let first = third * 6.0;
            let last = first + fourth * 24.0 + fifth * 60.0;
            let worst = (first - j).abs().max((last - j1).abs());
            let narrow = F4::some(simd, self.narrow.as_slice(), at);
            off = (worst * narrow).max(off);
        }
        (piece, off.largest())
    }
}

/// Position, velocity, acceleration and jerk of the joints from `at` on.
#[inline(always)]
fn sample<S: Four, const N: usize>(simd: S, sample: &Sample<N>, at: usize) -> [F4<S>; 4] {
    [
        F4::some(simd, sample.position.as_slice(), at),
        F4::some(simd, sample.velocity.as_slice(), at),
        F4::some(simd, sample.acceleration.as_slice(), at),
        F4::some(simd, sample.jerk.as_slice(), at),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use simd::Build;

    fn check<const N: usize>() {
        let numbers = |x: f64| SVector::<f64, N>::from_fn(|j, _| (x + 1.7 * j as f64).sin());
        let gridpoint = |x: f64| Gridpoint {
            position: numbers(x),
            joint: [numbers(x + 1.0), numbers(x + 2.0), numbers(x + 3.0)],
            reparametrization: [0.0; 4],
        };
        let (one, two) = (gridpoint(0.3), gridpoint(4.1));
        let [start, end] = [(&one, 1.1, 0.2), (&two, 0.8, -0.3)].map(|(gridpoint, a, b)| {
            let spot = Spot { a, b, c: 0.4 };
            let sample = Build::detect().run(Motion { gridpoint, spot });
            assert_eq!(sample, Build::Plain.run(Motion { gridpoint, spot }));
            let [q1, q2, _] = gridpoint.joint;
            assert!((sample.velocity - q1 * a.sqrt()).amax() < 1e-15);
            assert!((sample.acceleration - (q2 * a + q1 * b)).amax() < 1e-15);
            sample
        });
        let narrow = &SVector::repeat(0.01);
        let join = |build: Build| {
            build.run(Join {
                duration: 0.37,
                start: &start,
                end: &end,
                narrow,
            })
        };
        let (piece, off) = join(Build::detect());
        assert_eq!((piece, off), join(Build::Plain));
        let wanted = Piece::hermite(0.37, &start, &end);
        for (found, wanted) in piece.coefficients.iter().zip(&wanted.coefficients) {
            assert!((found - wanted).amax() <= 1e-13 * wanted.amax());
        }
        let ends = [(0.0, start), (0.37, end)];
        let wrong = ends.map(|(t, state)| (wanted.sample(t).jerk - state.jerk).amax());
        assert!((off - 0.01 * wrong[0].max(wrong[1])).abs() < 1e-10 * off);
    }

    #[test]
    fn joins_as_the_plain_quintic_does() {
        check::<1>();
        check::<3>();
        check::<4>();
        check::<7>();
        check::<9>();
    }
}
