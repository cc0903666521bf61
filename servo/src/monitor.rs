//! Reads what the real-time thread reports.

use rtrb::Consumer;

use super::event::{Event, Recorded};
use super::guard::Guarded;

/// The reader of events and of published and measured samples.
#[derive(Debug)]
pub struct Monitor<const N: usize> {
    pub(super) events: Consumer<Event>,
    pub(super) samples: Consumer<Recorded<N>>,
    pub(super) guarded: Consumer<Guarded<N>>,
    pub(super) seen: u64,
}

impl<const N: usize> Monitor<N> {
    /// The oldest event that was not read yet.
    pub fn event(&mut self) -> Option<Event> {
        let event = self.events.pop().ok();
        self.seen += u64::from(event.is_some());
        event
    }

    /// What became of the oldest guarded command that was not read yet; it is there when the
    /// [`Event::Finished`] of the command comes.
    pub fn guarded(&mut self) -> Option<Guarded<N>> {
        self.guarded.pop().ok()
    }

    /// How many events were read, for [`super::SegmentSender::settle`].
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// The oldest sample that was not read yet; none without [`super::ExecutorConfig::record`]. In
    /// lock-step the thread waits for the reader; by the wall clock it drops samples that do not
    /// fit.
    pub fn sample(&mut self) -> Option<Recorded<N>> {
        self.samples.pop().ok()
    }
}
