//! The planned motion that the cycle has received.

use nalgebra::SVector;

use crate::{Piece, Sample, Segment};

/// Result of pushing a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pushed {
    /// It is in the buffer.
    Taken,
    /// There is no room; try again later.
    Full,
    /// Its duration or a coefficient is not finite, or the duration negative: it was not taken.
    Broken,
}

/// A place in the buffer: a segment, and the time since its start (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cursor {
    pub(crate) index: usize,
    pub(crate) offset: f64,
}

/// A ring of up to `B` segments, in the order of execution.
#[derive(Clone, Debug)]
pub(crate) struct Buffer<const N: usize, const B: usize> {
    segments: [Segment<N>; B],
    first: usize,
    count: usize,
    /// Sum of the durations (s).
    horizon: f64,
    /// How many of the segments end a command.
    ends: usize,
}

impl<const N: usize, const B: usize> Buffer<N, B> {
    pub(crate) fn new() -> Self {
        let empty = Segment {
            piece: Piece::hold(SVector::zeros(), 0.0),
            command: 0,
            last: false,
        };
        Self {
            segments: [empty; B],
            first: 0,
            count: 0,
            horizon: 0.0,
            ends: 0,
        }
    }

    pub(crate) fn push(&mut self, segment: &Segment<N>) -> Pushed {
        // First: a planner that is ahead asks in every period.
        if self.count >= B {
            return Pushed::Full;
        }
        let piece = &segment.piece;
        let mut numbers = piece.coefficients.iter().flat_map(|c| c.as_slice());
        let finite = numbers.all(|x| x.is_finite());
        if !(finite && piece.duration.is_finite() && piece.duration >= 0.0) {
            return Pushed::Broken;
        }
        if let Some(place) = self.segments.get_mut((self.first + self.count) % B) {
            *place = *segment;
            self.count += 1;
            self.horizon += piece.duration;
            self.ends += usize::from(segment.last);
        }
        Pushed::Taken
    }

    pub(crate) fn get(&self, index: usize) -> Option<&Segment<N>> {
        if index < self.count {
            self.segments.get((self.first + index) % B)
        } else {
            None
        }
    }

    /// Drops the segments before `index`.
    pub(crate) fn drop_before(&mut self, index: usize) {
        for _ in 0..index.min(self.count) {
            if let Some(gone) = self.segments.get(self.first) {
                self.horizon -= gone.piece.duration;
                self.ends -= usize::from(gone.last);
            }
            self.first = (self.first + 1) % B;
            self.count -= 1;
        }
        if self.count == 0 {
            self.horizon = 0.0;
        }
    }

    /// Drops everything behind a place: the segment there ends at it, and ends no command.
    pub(crate) fn cut(&mut self, at: Cursor) {
        if at.index >= self.count {
            return;
        }
        if let Some(segment) = self.segments.get_mut((self.first + at.index) % B) {
            segment.piece.duration = segment.piece.duration.min(at.offset);
            segment.last = false;
        }
        self.count = at.index + 1;
        (self.horizon, self.ends) = (0.0, 0);
        for index in 0..self.count {
            if let Some(segment) = self.segments.get((self.first + index) % B) {
                self.horizon += segment.piece.duration;
                self.ends += usize::from(segment.last);
            }
        }
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.ends = 0;
        self.horizon = 0.0;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn is_full(&self) -> bool {
        self.count >= B
    }

    /// Planned time in the buffer (s).
    pub(crate) fn horizon(&self) -> f64 {
        self.horizon
    }

    /// Whether the end of the first command is in the buffer.
    pub(crate) fn has_end(&self) -> bool {
        self.ends > 0
    }

    /// The place `by` (s) after `from`, not beyond the end of the command or of the buffer. Also
    /// says whether that place is the end of the buffer but not of the command.
    pub(crate) fn advance(&self, from: Cursor, by: f64) -> (Cursor, bool) {
        let mut at = Cursor {
            index: from.index,
            offset: from.offset + by,
        };
        for _ in 0..B {
            let Some(segment) = self.get(at.index) else {
                return (at, true);
            };
            if at.offset <= segment.piece.duration {
                return (at, false);
            }
            let next_exists = self.get(at.index + 1).is_some();
            if segment.last || !next_exists {
                return (
                    Cursor {
                        offset: segment.piece.duration,
                        ..at
                    },
                    !segment.last,
                );
            }
            at = Cursor {
                index: at.index + 1,
                offset: at.offset - segment.piece.duration,
            };
        }
        (at, true)
    }

    /// The planned motion at a place; derivatives to planned time.
    pub(crate) fn sample(&self, at: Cursor) -> Option<Sample<N>> {
        self.get(at.index)
            .map(|segment| segment.piece.sample(at.offset))
    }
}
