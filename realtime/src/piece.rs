//! One polynomial piece of a joint motion.

use nalgebra::SVector;

/// Position, velocity, acceleration and jerk of `N` joints at one instant
/// (rad, rad/s, rad/s², rad/s³; metres for a prismatic joint).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const N: usize> {
    /// Joint positions (rad).
    pub position: SVector<f64, N>,
    /// Joint velocities (rad/s).
    pub velocity: SVector<f64, N>,
    /// Joint accelerations (rad/s²).
    pub acceleration: SVector<f64, N>,
    /// Joint jerks (rad/s³).
    pub jerk: SVector<f64, N>,
}

impl<const N: usize> Sample<N> {
    /// A sample at rest in `position` (rad).
    pub fn rest(position: SVector<f64, N>) -> Self {
        let zero = SVector::zeros();
        Self {
            position,
            velocity: zero,
            acceleration: zero,
            jerk: zero,
        }
    }
}

/// The value of one joint; NaN if there is no such joint.
pub(crate) fn of<const N: usize>(values: &SVector<f64, N>, joint: usize) -> f64 {
    values.get(joint).copied().unwrap_or(f64::NAN)
}

/// One polynomial piece of a joint motion: `q(t) = sum_k coefficients[k] t^k` for
/// `0 <= t <= duration` (s). Quintic: coefficient `k` is in rad/s^k.
///
/// ```
/// use nalgebra::SVector;
/// use realtime::Piece;
///
/// // One joint that starts at 1 rad with 2 rad/s and is braked with -2 rad/s² for one second.
/// let one = |value| SVector::<f64, 1>::from_element(value);
/// let piece = Piece::cubic(1.0, one(1.0), one(2.0), one(-2.0), one(0.0));
/// let end = piece.sample(1.0);
/// assert_eq!(end.position, one(2.0));
/// assert_eq!(end.velocity, one(0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<const N: usize> {
    /// How long the piece lasts (s).
    pub duration: f64,
    /// `coefficients[k]` multiplies `t^k` (rad/s^k).
    pub coefficients: [SVector<f64, N>; 6],
}

impl<const N: usize> Piece<N> {
    /// A piece that rests in `position` (rad) for `duration` (s).
    pub fn hold(position: SVector<f64, N>, duration: f64) -> Self {
        let zero = SVector::zeros();
        Self {
            duration,
            coefficients: [position, zero, zero, zero, zero, zero],
        }
    }

    /// A piece of constant jerk that starts from `position` (rad), `velocity` (rad/s) and
    /// `acceleration` (rad/s²) and lasts `duration` (s); `jerk` in rad/s³.
    #[expect(
        clippy::too_many_arguments,
        reason = "the five quantities that define the piece"
    )]
    pub fn cubic(
        duration: f64,
        position: SVector<f64, N>,
        velocity: SVector<f64, N>,
        acceleration: SVector<f64, N>,
        jerk: SVector<f64, N>,
    ) -> Self {
        let zero = SVector::zeros();
        let coefficients = [
            position,
            velocity,
            acceleration / 2.0,
            jerk / 6.0,
            zero,
            zero,
        ];
        Self {
            duration,
            coefficients,
        }
    }

    /// The quintic that has the position, velocity and acceleration of `start` at 0 and those of
    /// `end` at `duration` (s). The jerks of the two samples are not used. A duration that is not
    /// positive gives a hold of zero length at `end`.
    ///
    /// # Source
    /// Quintic Hermite interpolation; Biagiotti and Melchiorri, Trajectory Planning for Automatic
    /// Machines and Robots, 2008, eq. 2.5.
    pub fn hermite(duration: f64, start: &Sample<N>, end: &Sample<N>) -> Self {
        if duration.is_nan() || duration <= 0.0 {
            return Self::hold(end.position, 0.0);
        }
        let t = duration;
        let step = end.position - start.position;
        let (v0, v1) = (start.velocity * t, end.velocity * t);
        let (a0, a1) = (start.acceleration * (t * t), end.acceleration * (t * t));
        let third = step * 10.0 - v0 * 6.0 - v1 * 4.0 - (a0 * 3.0 - a1) * 0.5;
        let fourth = step * -15.0 + v0 * 8.0 + v1 * 7.0 + (a0 * 3.0 - a1 * 2.0) * 0.5;
        let fifth = step * 6.0 - (v0 + v1) * 3.0 - (a0 - a1) * 0.5;
        let cube = t * t * t;
        let coefficients = [
            start.position,
            start.velocity,
            start.acceleration * 0.5,
            third / cube,
            fourth / (cube * t),
            fifth / (cube * t * t),
        ];
        Self {
            duration,
            coefficients,
        }
    }

    /// The sample at `t` (s from the start of the piece). The polynomial is evaluated as it is,
    /// also outside of `0..=duration`.
    pub fn sample(&self, t: f64) -> Sample<N> {
        let [c0, c1, c2, c3, c4, c5] = &self.coefficients;
        Sample {
            position: c0 + (c1 + (c2 + (c3 + (c4 + c5 * t) * t) * t) * t) * t,
            velocity: c1 + (c2 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * t)) * t) * t) * t,
            acceleration: c2 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * t)) * t) * t,
            jerk: c3 * 6.0 + (c4 * 24.0 + c5 * (60.0 * t)) * t,
        }
    }
}

/// A piece that the planner sends to the cycle, through a wait-free ring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<const N: usize> {
    /// The motion.
    pub piece: Piece<N>,
    /// The index of the canonical command that the piece belongs to.
    pub command: u32,
    /// Whether the command ends, at rest, with this piece.
    pub last: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(values: [f64; 3]) -> Sample<2> {
        let both = |value: f64| SVector::<f64, 2>::new(value, -0.5 * value);
        Sample {
            position: both(values[0]),
            velocity: both(values[1]),
            acceleration: both(values[2]),
            jerk: SVector::zeros(),
        }
    }

    #[test]
    fn hermite_meets_both_ends() {
        let (start, end) = (sample([0.3, -1.2, 4.0]), sample([1.1, 0.7, -2.5]));
        let piece = Piece::hermite(0.37, &start, &end);
        for (at, wanted) in [(0.0, start), (0.37, end)] {
            let got = piece.sample(at);
            assert!((got.position - wanted.position).amax() < 1e-13);
            assert!((got.velocity - wanted.velocity).amax() < 1e-12);
            assert!((got.acceleration - wanted.acceleration).amax() < 1e-11);
        }
    }

    #[test]
    fn derivatives_are_those_of_the_position() {
        let piece = Piece::hermite(0.8, &sample([0.3, -1.2, 4.0]), &sample([1.1, 0.7, -2.5]));
        let (t, h) = (0.31, 1e-5);
        let (before, at, after) = (piece.sample(t - h), piece.sample(t), piece.sample(t + h));
        let slope = |a: SVector<f64, 2>, b: SVector<f64, 2>| (b - a) / (2.0 * h);
        assert!((slope(before.position, after.position) - at.velocity).amax() < 1e-6);
        assert!((slope(before.velocity, after.velocity) - at.acceleration).amax() < 1e-6);
        assert!((slope(before.acceleration, after.acceleration) - at.jerk).amax() < 1e-6);
    }

    #[test]
    fn hermite_without_duration_is_a_hold() {
        for duration in [0.0, -1.0, f64::NAN] {
            let end = sample([1.0, 0.0, 0.0]);
            let piece = Piece::hermite(duration, &sample([0.0, 0.0, 0.0]), &end);
            assert_eq!(piece.sample(0.0).position, end.position);
            assert_eq!(piece.duration, 0.0);
        }
    }
}
