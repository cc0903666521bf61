//! The end of a session. A driver that was late is behind the setpoints when these rest: a goodbye then
//! would leave the rest of the way to it. So the thread says goodbye when the driver's own references rest.

use nalgebra::SVector;
use realtime::{Demand, StopCategory};

use super::Runner;
use super::arrival::distance;
use super::message::first;
use crate::event::Event;
use ipc::StateFlags;

/// In how many states, one after the other, the commanded joints must stand.
const STATES: u32 = 5;

/// How far a joint that stands may move from one state to the next (rad, m): rounding of the driver's
/// references, or of a controller that says what it commands in numbers of 32 bits.
const REFERENCES: f64 = 1e-9;
const CONTROLLER: f64 = 1e-6;

/// What the thread has seen since it was told to end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaving<const N: usize> {
    /// The period since which the setpoints rest.
    since: Option<u64>,
    /// What the driver commanded in the last state (rad, m), and the number of that state.
    commanded: SVector<f64, N>,
    sequence: u64,
    /// In how many states it stood.
    states: u32,
    /// The driver rests, or is not waited for any longer.
    over: bool,
}

impl<const N: usize> Runner<N> {
    /// Comes to rest on the path, whatever is asked for, because the thread will end.
    pub(crate) fn leave(&mut self) {
        let commanded = first(&self.state.commanded);
        self.leaving.get_or_insert(Leaving {
            since: None,
            commanded,
            sequence: self.state.sequence,
            states: 0,
            over: false,
        });
    }

    /// Whether the arm rests and nothing is left for the driver to follow, so that the thread may end.
    pub(crate) fn may_leave(&self) -> bool {
        let over = self.leaving.is_some_and(|leaving| leaving.over);
        self.cycle.is_resting() && (over || !self.waits_for_driver())
    }

    /// Whether the driver follows: not after a fault, and not where a person asked for the fastest stop.
    fn waits_for_driver(&self) -> bool {
        let fast = Demand::Stop(StopCategory::Fast);
        self.ready && self.fault.is_none() && self.asked.demand() != fast
    }

    /// Looks whether the joints that the driver commands stand near the last setpoint, and the arm with
    /// them; after the patience of an arrival they are named and not waited for.
    pub(super) fn watch_leaving(&mut self) {
        let Some(mut leaving) = self.leaving else {
            return;
        };
        if leaving.over || !self.cycle.is_resting() || !self.waits_for_driver() {
            return;
        }
        let end = self.published.position;
        let commanded = first(&self.state.commanded);
        let (joint, error) = [commanded, self.measured()]
            .map(|joints| distance(&joints, &end))
            .into_iter()
            .fold(
                (0, 0.0),
                |worst, found| {
                    if found.1 > worst.1 { found } else { worst }
                },
            );
        let since = *leaving.since.get_or_insert(self.tick);
        if self.state.sequence > leaving.sequence {
            let told = self.state.flags & StateFlags::COMMANDED != 0;
            let still = if told { CONTROLLER } else { REFERENCES };
            let stands = (commanded - leaving.commanded).amax() <= still;
            let there = error <= self.config.arrival.tolerance;
            leaving.states = if stands && there {
                leaving.states + 1
            } else {
                0
            };
            (leaving.commanded, leaving.sequence) = (commanded, self.state.sequence);
        }
        let waited = (self.tick - since) as f64 * self.period;
        let late = waited >= self.config.arrival.patience.as_secs_f64();
        leaving.over = leaving.states >= STATES || late;
        self.leaving = Some(leaving);
        if late && leaving.states < STATES {
            let tick = self.tick;
            self.report(Event::NotSettled { joint, error, tick });
        }
    }
}
