//! Bounds of speeds whose limits fall towards the ends of the range.

use std::ops::Range;

use realtime::Piece;

use crate::JointLimits;
use crate::found::Found;
use crate::poly::{bernstein, halve};

/// A piece is halved at most this often.
const DEPTH: u32 = 14;
/// Slower than this (rad/s), a joint rests.
const STILL: f64 = 1e-9;

/// Position and velocity of one joint over a stretch of time, in Bernstein form.
#[derive(Clone, Copy)]
struct Stretch {
    position: [f64; 6],
    velocity: [f64; 5],
}

impl Stretch {
    fn of<const N: usize>(piece: &Piece<N>, joint: usize) -> Self {
        let power = piece.coefficients.map(|c| c[joint]);
        let [_, c1, c2, c3, c4, c5] = power;
        let velocity = [c1, 2.0 * c2, 3.0 * c3, 4.0 * c4, 5.0 * c5];
        Self {
            position: bernstein(&power, 0.0, piece.duration),
            velocity: bernstein(&velocity, 0.0, piece.duration),
        }
    }

    fn halves(&self) -> [Self; 2] {
        let (position, velocity) = (halve(&self.position), halve(&self.velocity));
        let one = |position, velocity| Self { position, velocity };
        [one(position.0, velocity.0), one(position.1, velocity.1)]
    }

    /// The hulls of positions and velocities, lowest and highest.
    fn hulls(&self) -> [[f64; 2]; 2] {
        [hull(&self.position), hull(&self.velocity)]
    }
}

fn hull(points: &[f64]) -> [f64; 2] {
    let lowest = points.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = points.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [lowest, highest]
}

/// The limits of one joint.
struct Near<'a, const N: usize> {
    limits: &'a JointLimits<N>,
    joint: usize,
}

impl<const N: usize> Near<'_, N> {
    /// A speed over its limit at a position.
    fn ratio(&self, position: f64, velocity: f64) -> f64 {
        if velocity.abs() <= STILL {
            return 0.0;
        }
        velocity.abs() / self.limits.speed(self.joint, position, velocity)
    }

    /// Whether the whole speed is allowed between these positions.
    fn is_free(&self, [lowest, highest]: [f64; 2]) -> bool {
        let most = self.limits.velocity[self.joint];
        let speed = |position, sign| self.limits.speed(self.joint, position, sign);
        speed(highest, 1.0) >= most && speed(lowest, -1.0) >= most
    }

    /// Adds the ratio over a stretch, halved at most `depth` times: the speed at each time of a
    /// stretch is at most the largest, and its limit at least that at the farthest position.
    fn take(&self, stretch: &Stretch, when: Range<f64>, depth: u32, found: &mut Found) {
        let [[lowest, highest], [slowest, fastest]] = stretch.hulls();
        let upwards = self.ratio(highest, fastest.max(0.0));
        let bound = upwards.max(self.ratio(lowest, slowest.min(0.0)));
        let ends = [0, 4].map(|i| (stretch.position[i + i / 4], stretch.velocity[i]));
        for (position, velocity) in ends {
            found.reached = found.reached.max(self.ratio(position, velocity));
        }
        if bound <= found.bound {
            return;
        }
        if depth == 0 || found.enough(bound) || bound.is_nan() {
            found.raise(bound, 0.5 * (when.start + when.end));
            return;
        }
        let middle = 0.5 * (when.start + when.end);
        let [left, right] = stretch.halves();
        self.take(&left, when.start..middle, depth - 1, found);
        self.take(&right, middle..when.end, depth - 1, found);
    }
}

/// The largest ratio of the speed of a joint over a piece, from time `start` (s) on, to its limit at
/// the same time; `None` if the limits are the same everywhere on the piece.
pub(crate) fn over<const N: usize>(
    piece: &Piece<N>,
    start: f64,
    (limits, joint): (&JointLimits<N>, usize),
) -> Option<Found> {
    limits.ends?;
    let near = Near { limits, joint };
    let stretch = Stretch::of(piece, joint);
    if near.is_free(stretch.hulls()[0]) {
        return None;
    }
    let mut found = Found {
        floor: FLOOR,
        ..Found::default()
    };
    near.take(&stretch, start..start + piece.duration, DEPTH, &mut found);
    Some(found)
}

/// Ratios below this need not be tight.
const FLOOR: f64 = 0.5;

/// The same ratio; 0 if the limits are the same everywhere on the piece.
pub(crate) fn ratio<const N: usize>(
    piece: &Piece<N>,
    limits: &JointLimits<N>,
    joint: usize,
) -> f64 {
    over(piece, 0.0, (limits, joint)).map_or(0.0, |found| found.bound)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SVector, vector};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use realtime::{EndSpeeds, Sample};

    fn limits() -> JointLimits<1> {
        JointLimits {
            ends: Some(EndSpeeds {
                lower: vector![-2.0],
                upper: vector![2.0],
                deceleration: vector![6.0],
                offset: vector![0.3],
            }),
            ..JointLimits::uniform(2.6, 10.0, 5000.0)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(139), cases: 400, ..ProptestConfig::default() })]

        /// The bound is above every sample, and near the highest.
        #[test]
        fn bounds_every_sample(
            from in -1.9..1.9_f64, to in -1.9..1.9_f64, speeds in prop::array::uniform2(-2.0..2.0_f64),
            duration in 0.01..2.0_f64,
        ) {
            let state = |position: f64, speed: f64| Sample {
                velocity: vector![speed],
                ..Sample::rest(vector![position])
            };
            let piece = Piece::hermite(duration, &state(from, speeds[0]), &state(to, speeds[1]));
            let limits = limits();
            let inside = (0..=2000).all(|i| {
                let at = piece.sample(duration * f64::from(i) / 2000.0);
                at.position[0].abs() < 1.97
            });
            prop_assume!(inside);
            let found = over(&piece, 0.0, (&limits, 0));
            let mut most = 0.0_f64;
            for i in 0..=2000 {
                let at = piece.sample(duration * f64::from(i) / 2000.0);
                let allowed = limits.speed(0, at.position[0], at.velocity[0]);
                most = most.max(at.velocity[0].abs() / allowed);
            }
            match found {
                Some(found) => {
                    prop_assert!(found.bound >= most * (1.0 - 1e-9), "{} {most}", found.bound);
                    prop_assert!(found.bound <= (most * 1.01).max(0.51), "{} {most}", found.bound);
                }
                None => {
                    let speed = (0..=2000).map(|i| piece.sample(duration * f64::from(i) / 2000.0).velocity[0].abs());
                    let fastest = speed.fold(0.0, f64::max);
                    prop_assert!((most - fastest / 2.6).abs() < 1e-12);
                }
            }
        }
    }

    /// A joint that rests where no speed is allowed breaks no limit; one that moves there does.
    #[test]
    fn no_speed_is_allowed_at_the_end() {
        let limits = limits();
        let still = Piece::hold(SVector::<f64, 1>::new(1.995), 1.0);
        assert_eq!(ratio(&still, &limits, 0), 0.0);
        let (from, to) = (Sample::rest(vector![1.9]), Sample::rest(vector![1.995]));
        assert_eq!(
            ratio(&Piece::hermite(1.0, &from, &to), &limits, 0),
            f64::INFINITY
        );
        let back = ratio(&Piece::hermite(1.0, &to, &from), &limits, 0);
        assert!(back < 0.5, "{back}");
    }
}
