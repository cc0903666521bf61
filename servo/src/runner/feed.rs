//! What the planner has sent, from the ring into the cycle.

use realtime::Pushed;

use super::Runner;
use crate::event::Fault;
use crate::segment_sender::Work;

/// Largest number of items taken from the ring per period.
const A_PERIOD: usize = 64;

impl<const N: usize> Runner<N> {
    /// Takes planned work from the ring: from the period on after the one in which the driver became
    /// active. In lock-step time may stand from there until work comes, so work that waits already must
    /// not begin sooner than work that comes then.
    pub(super) fn feed(&mut self) {
        for _ in 0..A_PERIOD {
            let Ok(item) = self.items.peek() else { return };
            let item = *item;
            let done = if item.epoch != self.epoch || self.fault.is_some() {
                true
            } else {
                match item.work {
                    Work::Motion(segment) if self.drops(&segment) => true,
                    Work::Motion(segment) if self.tool.is_none() => {
                        match self.cycle.push(&segment) {
                            Pushed::Taken => {
                                self.note_pushed(&segment);
                                true
                            }
                            Pushed::Full => false,
                            Pushed::Broken => {
                                self.latch(Fault::BrokenSegment);
                                true
                            }
                        }
                    }
                    Work::Tool(order)
                        if self.tool.is_none()
                            && self.cycle.is_idle()
                            && self.awaited.is_empty() =>
                    {
                        self.start_tool(order)
                    }
                    Work::Guards(order) => self.start_guards(&order),
                    Work::End(end) => self.take_tolerance(&end),
                    Work::Splice(splice) => self.splice(&splice),
                    _ => false,
                }
            };
            if !done || self.items.pop().is_err() {
                return;
            }
        }
    }
}
