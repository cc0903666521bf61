//! The last seconds of a running arm.

use std::collections::VecDeque;

use crate::Sample;

/// The last samples, in memory of fixed size.
#[derive(Debug)]
pub struct Ring {
    samples: VecDeque<Sample>,
    room: usize,
}

impl Ring {
    /// Room for `room` samples, one at least.
    #[must_use]
    pub fn new(room: usize) -> Self {
        let room = room.max(1);
        Self {
            samples: VecDeque::with_capacity(room),
            room,
        }
    }

    /// Takes a sample; the oldest goes where there is no room.
    pub fn push(&mut self, sample: Sample) {
        if self.samples.len() == self.room {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// All samples, oldest first; the ring is empty afterwards.
    pub fn take(&mut self) -> Vec<Sample> {
        let fresh = VecDeque::with_capacity(self.room);
        std::mem::replace(&mut self.samples, fresh).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_samples_are_kept_in_order() {
        let mut ring = Ring::new(3);
        for tick in 0..5 {
            ring.push(Sample {
                tick,
                ..Sample::default()
            });
        }
        assert_eq!(ring.len(), 3);
        let ticks: Vec<_> = ring.take().iter().map(|sample| sample.tick).collect();
        assert_eq!(ticks, [2, 3, 4]);
        assert!(ring.is_empty());
    }
}
