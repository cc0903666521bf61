//! Reads what the real-time thread reports.

use rtrb::Consumer;

use super::event::{Event, Recorded};
use super::guard::Guarded;

/// The reader of events and of published and measured samples. Both halves can go to threads of
/// their own.
#[derive(Debug)]
pub struct Monitor<const N: usize> {
    /// The reader of events.
    pub events: Events<N>,
    /// The reader of samples.
    pub samples: Samples<N>,
}

/// The reader of events, and of what became of guarded commands.
#[derive(Debug)]
pub struct Events<const N: usize> {
    ring: Consumer<Event>,
    guarded: Consumer<Guarded<N>>,
    seen: u64,
}

/// The reader of published and measured samples.
#[derive(Debug)]
pub struct Samples<const N: usize> {
    ring: Consumer<Recorded<N>>,
}

impl<const N: usize> Monitor<N> {
    pub(super) fn new(
        events: Consumer<Event>,
        guarded: Consumer<Guarded<N>>,
        samples: Consumer<Recorded<N>>,
    ) -> Self {
        Self {
            events: Events {
                ring: events,
                guarded,
                seen: 0,
            },
            samples: Samples { ring: samples },
        }
    }

    /// As [`Events::event`].
    pub fn event(&mut self) -> Option<Event> {
        self.events.event()
    }

    /// As [`Events::guarded`].
    pub fn guarded(&mut self) -> Option<Guarded<N>> {
        self.events.guarded()
    }

    /// As [`Samples::sample`].
    pub fn sample(&mut self) -> Option<Recorded<N>> {
        self.samples.sample()
    }
}

impl<const N: usize> Events<N> {
    /// The oldest event that was not read yet.
    pub fn event(&mut self) -> Option<Event> {
        let event = self.ring.pop().ok();
        self.seen += u64::from(event.is_some());
        event
    }

    /// What became of the oldest guarded command that was not read yet; it is there when the
    /// [`Event::Finished`] of the command comes.
    pub fn guarded(&mut self) -> Option<Guarded<N>> {
        self.guarded.pop().ok()
    }

    /// How many events were read, for [`super::SegmentSender::settle`].
    #[must_use]
    pub fn seen(&self) -> u64 {
        self.seen
    }
}

impl<const N: usize> Samples<N> {
    /// The oldest sample that was not read yet; none without [`super::ExecutorConfig::record`]. In
    /// lock-step the thread waits for the reader; by the wall clock it drops samples that do not
    /// fit.
    pub fn sample(&mut self) -> Option<Recorded<N>> {
        self.ring.pop().ok()
    }
}
