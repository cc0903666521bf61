//! A command that takes the place of the one that moves, in the same state of motion.

use super::Runner;
use crate::event::Event;
use crate::segment_sender::Splice;

impl<const N: usize> Runner<N> {
    /// Forgets the rest of the command that moves, if there is still time for it; the pieces of the
    /// new one come next. Otherwise these are dropped.
    pub(super) fn splice(&mut self, splice: &Splice) -> bool {
        let runs = self.watch.is_none() && self.fault.is_none() && self.aborting.is_none();
        let accepted = runs && self.cycle.cut(splice.command, splice.path_time);
        if accepted {
            self.take_end(splice.command);
        } else {
            self.refused = Some(splice.by);
        }
        self.report(Event::Spliced {
            by: splice.by,
            accepted,
            tick: self.tick,
        });
        true
    }
}
