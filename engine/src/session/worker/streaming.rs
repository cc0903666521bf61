//! A long smooth move, whose windows are planned while it moves.

use planner::command_error::CommandError;
use planner::motion::WindowedMove;
use realtime::{Piece, Segment};

use super::motion::{end_tolerance, motion};
use super::{InFlight, Work, Worker};
use crate::queue::Given;

/// A move that is under way and not planned to its end.
#[derive(Debug)]
pub(super) struct Streaming<const N: usize> {
    id: u32,
    windowed: WindowedMove<'static, N>,
}

impl<const N: usize> Worker<'_, N> {
    /// The way of a long smooth move that was not planned before, checked, if its windows can be
    /// planned while it moves.
    pub(super) fn begin(&mut self, given: &Given) -> Option<WindowedMove<'static, N>> {
        match given {
            Given::Command {
                located,
                planned: None,
            } => self.controller.begin(&located.command),
            _ => None,
        }
    }

    /// Begins a move whose whole way was checked.
    pub(super) fn stream(&mut self, flight: &mut InFlight<N>, windowed: WindowedMove<'static, N>) {
        flight.planned_s = windowed.duration();
        let id = flight.id;
        self.streaming = Some(Streaming { id, windowed });
    }

    /// Whether the next window can be planned now: all windows before it have gone to the real-time
    /// thread, and that has not dropped them.
    pub(super) fn wants_window(&self) -> bool {
        self.streaming.is_some()
            && self.work.is_empty()
            && self.fault.is_none()
            && self.steering.aborts() == self.epoch
    }

    /// Plans the next window and turns it into work.
    pub(super) fn plan_window(&mut self) {
        let Some(mut streaming) = self.streaming.take() else {
            return;
        };
        let command = streaming.id;
        let window = match self.controller.next_window(&mut streaming.windowed) {
            Ok(window) => window,
            Err(error) => return self.end_on_the_way(&streaming, error),
        };
        let (pieces, whole) = (&window.pieces, window.last);
        let end = if whole {
            end_tolerance(command, pieces, &self.controller)
        } else {
            None
        };
        self.work.extend(motion(command, pieces, whole, end));
        if let Some(flight) = self.flight.iter_mut().find(|flight| flight.id == command) {
            flight.planned_s = streaming.windowed.duration();
        }
        if !window.last {
            // Nobody asks for what is behind, and a list may be long.
            streaming.windowed.forget();
            self.streaming = Some(streaming);
        }
    }

    /// No window goes on from where the last one rests: the command ends there, and is refused.
    fn end_on_the_way(&mut self, streaming: &Streaming<N>, error: CommandError) {
        let rest = streaming.windowed.here();
        self.controller.set_joints(rest);
        let Some(at) = self
            .flight
            .iter()
            .position(|flight| flight.id == streaming.id)
        else {
            return;
        };
        let Some(mut flight) = self.flight.remove(at) else {
            return;
        };
        self.refuse(&mut flight, error, true);
        self.work.push_back(Work::Motion(Segment {
            piece: Piece::hold(rest, 1.0 / self.config.rate_hz),
            command: streaming.id,
            last: true,
        }));
        self.flight.insert(at, flight);
    }
}
