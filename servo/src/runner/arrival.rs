//! A command is done when the measured arm has arrived, not when its plan ends: until then its end,
//! and what comes after it, is not reported.

use nalgebra::SVector;

use super::Runner;
use crate::event::Event;

/// How many reports wait at most; the oldest is reported when there are more.
pub(super) const WAITING: usize = 64;

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
    },
    /// An event behind it.
    Event(Event),
}

impl<const N: usize> Runner<N> {
    /// The plan of a command has ended with the setpoint that was just made.
    pub(super) fn await_arrival(&mut self, command: u32) {
        let patience = self.config.arrival.patience.as_secs_f64() / self.period;
        self.hold(Awaited::End {
            command,
            end: self.published.position,
            until: self.tick + patience as u64,
            nearest: (0, f64::INFINITY),
        });
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
            if let Awaited::End { end, nearest, .. } = awaited {
                let found = distance(&measured, end);
                if found.1 < nearest.1 {
                    *nearest = found;
                }
            }
        }
        while let Some(first) = self.awaited.front().copied() {
            if let Awaited::End {
                command,
                until,
                nearest: (joint, error),
                ..
            } = first
            {
                let arrived = self.config.arrival.tolerance;
                if error > self.settles(command).unwrap_or(arrived) && self.tick < until {
                    return;
                }
                if error > arrived {
                    self.report(Event::NotArrived {
                        command,
                        joint,
                        error,
                        tick: self.tick,
                    });
                }
            }
            self.awaited.pop_front();
            self.tell_awaited(first);
        }
    }

    /// Reports everything that waits, because the arm rests for good.
    pub(super) fn arrive_at_once(&mut self) {
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
