//! A motion in time.

use realtime::{Piece, Sample};

/// A motion of `N` joints in time: polynomial pieces one after the other, from 0 s on.
///
/// ```
/// use nalgebra::vector;
/// use realtime::Piece;
/// use trajectory::Trajectory;
///
/// let hold = Trajectory::new(vec![Piece::hold(vector![0.5], 1.0), Piece::hold(vector![0.5], 2.0)]);
/// assert_eq!(hold.duration(), 3.0);
/// assert_eq!(hold.sample(2.5).position, vector![0.5]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<const N: usize> {
    pieces: Vec<Piece<N>>,
    /// Start time of each piece, then the end of the last one.
    times: Vec<f64>,
}

impl<const N: usize> Trajectory<N> {
    /// The motion made of `pieces` in their order.
    pub fn new(pieces: Vec<Piece<N>>) -> Self {
        let mut times = Vec::with_capacity(pieces.len() + 1);
        let mut time = 0.0;
        times.push(time);
        for piece in &pieces {
            time += piece.duration;
            times.push(time);
        }
        Self { pieces, times }
    }

    /// How long the motion lasts (s).
    pub fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The pieces in their order.
    pub fn pieces(&self) -> &[Piece<N>] {
        &self.pieces
    }

    /// Start time of each piece (s), then the duration: one more number than there are pieces.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Position, velocity, acceleration and jerk at `t` (s). Times before the start give the start,
    /// times after the end give the end, with the derivatives there. A motion without pieces is at
    /// the origin.
    pub fn sample(&self, t: f64) -> Sample<N> {
        let after = self.times.partition_point(|start| *start <= t);
        let index = after
            .saturating_sub(1)
            .min(self.pieces.len().saturating_sub(1));
        match self.pieces.get(index) {
            Some(piece) => piece.sample((t - self.times[index]).clamp(0.0, piece.duration)),
            None => Sample::rest(nalgebra::SVector::zeros()),
        }
    }

    /// The same motion, `factor` times as long: velocities shrink by `factor`, accelerations by its
    /// square, jerks by its cube. The geometry does not change.
    pub fn stretched(&self, factor: f64) -> Self {
        self.clone().into_stretched(factor)
    }

    /// As [`Trajectory::stretched`], in the memory of this motion.
    pub(crate) fn into_stretched(mut self, factor: f64) -> Self {
        for piece in &mut self.pieces {
            let mut power = 1.0;
            for coefficient in &mut piece.coefficients {
                *coefficient *= power;
                power /= factor;
            }
            piece.duration *= factor;
        }
        Self::new(self.pieces)
    }
}
