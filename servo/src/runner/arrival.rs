//! A command is done when the measured arm has arrived, not when its plan ends: until then its end,
//! and what comes after it, is not reported. Where the command has a tolerance for its end, the next
//! one does not move before the tool is within it.

use nalgebra::SVector;

use super::Runner;
use crate::end_tolerance::{EndTolerance, OffEnd};
use crate::event::Event;

/// How many reports wait at most; the oldest is reported when there are more.
pub(super) const WAITING: usize = 64;

/// How many tolerances of ends are at hand at most.
pub(super) const ENDS: usize = 64;

/// What is reported when the arm has arrived.
#[derive(Clone, Copy, Debug)]
pub(super) enum Awaited<const N: usize> {
    /// The end of a command.
    End {
        command: u32,
        /// Where the command ends (rad).
        end: SVector<f64, N>,
        /// The last period in which the arm may arrive.
        until: u64,
        /// The joint that was furthest from the end when the arm was nearest to it, and how far (rad, m):
        /// meanwhile the next command may move the arm away.
        nearest: (u32, f64),
        /// How near the tool must come, if the command says so.
        wanted: Option<EndTolerance<N>>,
        /// How near the tool came.
        off: OffEnd,
    },
    /// An event behind it.
    Event(Event),
}

impl<const N: usize> Awaited<N> {
    /// Notes how near the arm is, if it was never nearer.
    fn look(&mut self, measured: &SVector<f64, N>) {
        let Self::End {
            end,
            nearest,
            wanted,
            off,
            ..
        } = self
        else {
            return;
        };
        let found = distance(measured, end);
        if found.1 < nearest.1 {
            *nearest = found;
        }
        if let Some(wanted) = wanted {
            let found = wanted.off(measured);
            if found.share < off.share {
                *off = found;
            }
        }
    }
}

impl<const N: usize> Runner<N> {
    /// The plan of a command has ended with the setpoint that was just made; `wanted` is how near the
    /// tool must come to its end.
    pub(super) fn await_arrival(&mut self, command: u32, wanted: Option<EndTolerance<N>>) {
        let patience = self.config.arrival.patience.as_secs_f64() / self.period;
        self.hold(Awaited::End {
            command,
            end: self.published.position,
            until: self.tick + patience as u64,
            nearest: (0, f64::INFINITY),
            wanted,
            off: OffEnd::UNKNOWN,
        });
    }

    /// Takes the tolerance of a command's end off the ring; says whether there was room, or it is not
    /// needed any more.
    pub(super) fn take_tolerance(&mut self, end: &EndTolerance<N>) -> bool {
        if self.is_dropped(end.command) {
            return true;
        }
        // The queue must not grow: that would allocate.
        let room = self.ends.len() < ENDS;
        if room {
            self.ends.push_back(*end);
        }
        room
    }

    /// Takes out the tolerance of a command's end.
    pub(super) fn take_end(&mut self, command: u32) -> Option<EndTolerance<N>> {
        let at = self.ends.iter().position(|end| end.command == command)?;
        self.ends.remove(at)
    }

    /// The arm will not arrive anywhere: forgets the ends of commands without a report.
    pub(super) fn forget_ends(&mut self) {
        self.awaited.clear();
        self.ends.clear();
    }

    /// Whether the next command may move: the tool has been within the tolerance of each end that is
    /// awaited, and is within that of the command that moves, if this ends now.
    pub(super) fn may_start(&self) -> bool {
        if self.awaited.is_empty() && self.ends.is_empty() {
            return true;
        }
        let measured = self.measured();
        let follows = self.cycle.follows();
        let ends_now = self.ends.front().filter(|end| follows == Some(end.command));
        let misses = |end: &EndTolerance<N>| !end.off(&measured).is_within();
        let waits = |awaited: &Awaited<N>| match awaited {
            Awaited::End { wanted, off, .. } => {
                !off.is_within() && wanted.as_ref().is_some_and(misses)
            }
            Awaited::Event(_) => false,
        };
        !ends_now.is_some_and(misses) && !self.awaited.iter().any(waits)
    }

    /// Reports an event after the ends of commands that are awaited.
    pub(super) fn report_in_order(&mut self, event: Event) {
        if self.awaited.is_empty() {
            self.report(event);
        } else {
            self.hold(Awaited::Event(event));
        }
    }

    fn hold(&mut self, awaited: Awaited<N>) {
        // The queue must not grow: that would allocate.
        if self.awaited.len() == WAITING
            && let Some(oldest) = self.awaited.pop_front()
        {
            self.tell_awaited(oldest);
        }
        self.awaited.push_back(awaited);
    }

    /// Reports the commands at whose end the arm has arrived.
    pub(super) fn watch_arrival(&mut self) {
        if self.awaited.is_empty() {
            return;
        }
        let measured = self.measured();
        for awaited in &mut self.awaited {
            awaited.look(&measured);
        }
        while let Some(first) = self.awaited.front().copied() {
            if !self.ends_with(&first) {
                return;
            }
            self.awaited.pop_front();
            self.tell_awaited(first);
        }
    }

    /// Whether the arm has arrived, or is not waited for any longer; then what it misses is reported. An event
    /// waits for nothing else.
    fn ends_with(&mut self, first: &Awaited<N>) -> bool {
        let Awaited::End {
            command,
            until,
            nearest: (joint, error),
            wanted,
            off,
            ..
        } = *first
        else {
            return true;
        };
        let tick = self.tick;
        let arrived = self.config.arrival.tolerance;
        let settled = error <= self.settles(command).unwrap_or(arrived);
        let within = wanted.is_none() || off.is_within();
        if !(settled && within) && tick < until {
            return false;
        }
        if error > arrived {
            self.report(Event::NotArrived {
                command,
                joint,
                error,
                tick,
            });
        }
        if !within {
            self.report(Event::EndMissed {
                command,
                point: off.point,
                angle: off.angle,
                tick,
            });
        }
        true
    }

    /// Reports everything that waits, because the arm rests for good.
    pub(super) fn arrive_at_once(&mut self) {
        self.ends.clear();
        while let Some(first) = self.awaited.pop_front() {
            self.tell_awaited(first);
        }
    }

    fn tell_awaited(&mut self, awaited: Awaited<N>) {
        let tick = self.tick;
        if let Awaited::End { command, .. } = awaited {
            self.report_guards(command);
        }
        self.report(match awaited {
            Awaited::End { command, .. } => Event::Finished { command, tick },
            Awaited::Event(event) => event,
        });
    }
}

/// The joint that is furthest from `end`, and how far it is (rad, m).
pub(super) fn distance<const N: usize>(
    measured: &SVector<f64, N>,
    end: &SVector<f64, N>,
) -> (u32, f64) {
    let joints = measured.as_slice().iter().zip(end.as_slice()).enumerate();
    joints.fold((0, 0.0), |(worst, most), (joint, (at, end))| {
        let error = (at - end).abs();
        if error > most {
            (joint as u32, error)
        } else {
            (worst, most)
        }
    })
}
