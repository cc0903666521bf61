//! Reads the reports of the servo thread and makes the session's notes, in the order of the
//! commands.

use std::sync::PoisonError;

use servo::{Event, Fault};

use super::super::note::{Blame, Note};
use super::Worker;

impl<const N: usize> Worker<'_, N> {
    /// Takes what the servo thread has reported.
    pub(super) fn read_reports(&mut self) {
        let mut sampling = self.sampling.lock().unwrap_or_else(PoisonError::into_inner);
        sampling.read(&self.seen, &self.ends.shared.samples);
        drop(sampling);
        while let Some(event) = self.events.event() {
            self.on_event(event);
        }
    }

    fn on_event(&mut self, event: Event) {
        match event {
            Event::Started { command, tick } => {
                let Some(flight) = self.flight.iter_mut().find(|f| f.id == command) else {
                    return;
                };
                flight.started = Some(tick);
                let (id, line, name) = (flight.id, flight.line, flight.name);
                let planned_s = flight.planned_s;
                // Earlier commands have ended and are reported first.
                self.report_done();
                self.say(Note::Started {
                    id,
                    line,
                    name,
                    planned_s,
                    tick,
                });
            }
            Event::Finished { command, .. } if self.jog_finished(command) => {}
            Event::Finished { command, tick } => {
                self.end_guards(command);
                if let Some(flight) = self.flight.iter_mut().find(|f| f.id == command) {
                    flight.finished = Some(tick);
                }
                self.report_done();
            }
            Event::NotArrived { .. } | Event::EndMissed { .. } | Event::NotSettled { .. } => {
                self.say_missed(event);
            }
            Event::Spliced { by, accepted, .. } => self.spliced = Some((by, accepted)),
            Event::SpeedAsked { share, .. } => self.say(Note::SpeedAsked { share }),
            Event::Stopped { .. } => self.say(Note::Stopped),
            Event::Aborted { aborts, .. } => {
                let asked = aborts.wrapping_sub(self.epoch);
                let ours = asked <= self.jog_aborts;
                self.jog_aborts = self.jog_aborts.saturating_sub(asked);
                self.epoch = aborts;
                self.on_abort(ours);
            }
            Event::Faulted { fault, tick } => self.on_fault(&fault, tick),
            Event::Recovered { .. } => {
                let dropped = self.drop_all(None);
                self.fault = None;
                self.ends.shared.inbox().set_fault(None);
                tracing::debug!(dropped, "recovered");
                self.say(Note::Recovered);
            }
            Event::Ended { .. } => self.closing = true,
        }
    }

    /// Says where the arm is not, although the plan is.
    fn say_missed(&mut self, event: Event) {
        self.say(match event {
            Event::NotArrived {
                command,
                joint,
                error,
                ..
            } => Note::NotArrived {
                id: command,
                joint: joint + 1,
                error,
            },
            Event::EndMissed {
                command,
                point,
                angle,
                ..
            } => Note::EndMissed {
                id: command,
                off_m: point,
                off_rad: angle,
            },
            Event::NotSettled { joint, error, .. } => Note::NotSettled {
                joint: joint + 1,
                error,
            },
            _ => return,
        });
    }

    /// Drops everything, and keeps the fault until an operator recovers from it.
    fn on_fault(&mut self, fault: &Fault, tick: u64) {
        let (blame, reason) = (blame(fault), fault.to_string());
        let dropped = self.drop_all(None);
        self.fault = Some(reason.clone());
        self.ends.shared.inbox().set_fault(self.fault.clone());
        self.say(Note::Faulted {
            blame,
            reason,
            tick,
            dropped,
        });
    }

    /// The arm rests after an abort: one that ends a jog, or one that an operator asked for. Only
    /// the latter drops the commands given before it.
    fn on_abort(&mut self, ends_jog: bool) {
        if ends_jog {
            self.ends.shared.inbox().renew(self.epoch);
        }
        if !self.rest_from_jog() {
            let dropped = self.drop_all(Some(self.epoch));
            self.say(Note::Aborted { dropped });
        } else if !ends_jog {
            let dropped = self.ends.shared.inbox().drop_all(Some(self.epoch));
            self.say(Note::Aborted { dropped });
        }
    }

    /// Drops everything that is planned or queued, except commands of `epoch`, and starts again
    /// from where the arm is.
    fn drop_all(&mut self, epoch: Option<u32>) -> usize {
        let dropped = self.flight.len();
        self.work.clear();
        self.flight.clear();
        let dropped = dropped + {
            let mut inbox = self.ends.shared.inbox();
            inbox.set_flying(0);
            inbox.drop_all(epoch)
        };
        self.jogging = None;
        self.streaming = None;
        self.sender.renew();
        self.held = None;
        self.controller.abort();
        self.controller.set_joints(self.remote.measured().setpoint);
        dropped
    }

    /// Reports, in order, every command that has ended.
    pub(super) fn report_done(&mut self) {
        while self
            .flight
            .front()
            .is_some_and(|flight| flight.finished.is_some())
        {
            let Some(flight) = self.flight.pop_front() else {
                return;
            };
            if let Some(note) = flight.says {
                self.say(note);
            }
            if flight.refused {
                continue;
            }
            let ticks = match (flight.started, flight.finished) {
                (Some(from), Some(to)) => to.saturating_sub(from),
                _ => 0,
            };
            let (id, line, name) = (flight.id, flight.line, flight.name);
            self.say(Note::Done {
                id,
                line,
                name,
                ticks,
            });
        }
    }
}

fn blame(fault: &Fault) -> Blame {
    match fault {
        Fault::Limit(_) | Fault::BrokenSegment | Fault::Stalled { .. } => Blame::Guard,
        _ => Blame::Driver,
    }
}
