//! Reads what the real-time thread reports.

use rtrb::Consumer;

use super::event::{Event, Recorded};

/// The reader of events and of published and measured samples. Both halves can go to threads of
/// their own.
#[derive(Debug)]
pub struct Monitor<const N: usize> {
    /// The reader of events.
    pub events: Events,
    /// The reader of samples.
    pub samples: Samples<N>,
}

/// The reader of events.
#[derive(Debug)]
pub struct Events {
    ring: Consumer<Event>,
    seen: u64,
}

/// The reader of published and measured samples.
#[derive(Debug)]
pub struct Samples<const N: usize> {
    ring: Consumer<Recorded<N>>,
}

impl<const N: usize> Monitor<N> {
    pub(super) fn new(events: Consumer<Event>, samples: Consumer<Recorded<N>>) -> Self {
        Self {
            events: Events {
                ring: events,
                seen: 0,
            },
            samples: Samples { ring: samples },
        }
    }

    /// As [`Events::event`].
    pub fn event(&mut self) -> Option<Event> {
        self.events.event()
    }

    /// As [`Samples::sample`].
    pub fn sample(&mut self) -> Option<Recorded<N>> {
        self.samples.sample()
    }
}

impl Events {
    /// The oldest event that was not read yet.
    pub fn event(&mut self) -> Option<Event> {
        let event = self.ring.pop().ok();
        self.seen += u64::from(event.is_some());
        event
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
