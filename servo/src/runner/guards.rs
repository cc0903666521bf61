//! Guarded commands: sensors are looked at in every period; a guard that trips stops the arm on its
//! path, and what is left of the command is dropped.

use core::sync::atomic::Ordering;

use realtime::{Demand, Segment};

use super::Runner;
use crate::event::Event;
use crate::guard::{GuardOrder, GuardOutcome, Guarded, SETTLED, Watch};

impl<const N: usize> Runner<N> {
    /// Begins to watch the sensors of a command; says whether it may begin now. A command whose
    /// guard has tripped already, or whose sensor is not known, does not move.
    pub(super) fn start_guards(&mut self, order: &GuardOrder) -> bool {
        let moving = matches!(self.demand(), Demand::Run(share) if share > 0.0);
        let rests = self.cycle.is_idle() && self.awaited.is_empty() && self.tool.is_none();
        if !self.ready || !moving || !rests || self.watch.is_some() {
            return false;
        }
        let mut watch = Watch::new(order, &self.state);
        if watch.look(&self.state) {
            self.begin_stop(&mut watch);
            watch.has_ended = true;
            self.dropping = Some(order.command);
            self.report(Event::Started {
                command: order.command,
                tick: self.tick,
            });
        }
        self.watch = Some(watch);
        true
    }

    /// Whether the segment belongs to a command that a guard has ended, or that came too late to
    /// take the place of another; it is dropped then.
    pub(super) fn drops(&mut self, segment: &Segment<N>) -> bool {
        if self.refused == Some(segment.command) {
            if segment.last {
                self.refused = None;
            }
            return true;
        }
        let dropped = self.dropping == Some(segment.command);
        if dropped && segment.last {
            self.dropping = None;
            self.await_arrival(segment.command, None);
        }
        dropped
    }

    /// Whether what belongs to the command is dropped.
    pub(super) fn is_dropped(&self, command: u32) -> bool {
        self.refused == Some(command) || self.dropping == Some(command)
    }

    /// A segment was pushed into the cycle.
    pub(super) fn note_pushed(&mut self, segment: &Segment<N>) {
        if let Some(watch) = &mut self.watch
            && watch.report.command == segment.command
        {
            watch.is_whole |= segment.last;
        }
    }

    /// A command has come to the end of its plan.
    pub(super) fn note_finished(&mut self, command: u32) {
        if let Some(watch) = &mut self.watch
            && watch.report.command == command
        {
            watch.has_ended = true;
        }
    }

    /// Looks at the sensors, and ends a command whose guard has tripped when the arm rests.
    pub(super) fn watch_guards(&mut self) {
        let Some(mut watch) = self.watch else { return };
        if watch.look(&self.state) {
            self.begin_stop(&mut watch);
        }
        if watch.stops() && self.cycle.is_resting() {
            watch.has_ended = true;
            self.cycle.flush();
            self.published = *self.cycle.setpoint();
            let command = watch.report.command;
            // The arm rests elsewhere.
            self.take_end(command);
            if watch.is_whole {
                self.await_arrival(command, None);
            } else {
                self.dropping = Some(command);
            }
        }
        self.watch = Some(watch);
    }

    fn begin_stop(&self, watch: &mut Watch<N>) {
        let report = &mut watch.report;
        report.tick = self.tick;
        report.measured = self.measured();
        report.setpoint = self.published.position;
        let moves = !self.cycle.is_idle() && self.cycle.command() == report.command;
        if moves && !self.cycle.is_resting() {
            report.path_time = self.cycle.path_time();
            report.time_scaling = self.cycle.time_scaling();
        }
    }

    /// How near the measured arm must be to where it rests, for a command that a guard has stopped
    /// (rad, m).
    pub(super) fn settles(&self, command: u32) -> Option<f64> {
        let stopped = |report: &Guarded<N>| {
            report.command == command && report.outcome != GuardOutcome::Quiet
        };
        let report = self.watch.map(|watch| watch.report);
        report.filter(stopped).map(|_| SETTLED)
    }

    /// Reports what became of the guards of a command that has ended and rests.
    pub(super) fn report_guards(&mut self, command: u32) {
        let Some(watch) = self.watch else { return };
        if watch.report.command != command {
            return;
        }
        self.watch = None;
        let mut report = watch.report;
        report.rested = self.measured();
        report.stop_s = self.tick.saturating_sub(report.tick) as f64 * self.period;
        if self.guarded.push(report).is_err() {
            self.shared.lost_reports.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Forgets guards: a fault, an abort or a new session has dropped their command.
    pub(super) fn forget_guards(&mut self) {
        self.watch = None;
        self.dropping = None;
        self.refused = None;
    }
}
