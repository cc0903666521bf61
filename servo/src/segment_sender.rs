//! Sends planned segments and tool orders to the real-time thread.

use std::sync::Arc;

use ipc::{Payload, ToolAction};
use realtime::Segment;
use rtrb::Producer;
use thiserror::Error;

use super::end_tolerance::EndTolerance;
use super::guard::GuardOrder;
use super::remote::Shared;

/// An order to a gripper or tool changer. It is carried out at rest, after all that was pushed
/// before, and what is pushed after it waits for the tool's answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolOrder {
    /// Index of the command.
    pub command: u32,
    /// [`ipc::GRIPPER`] or [`ipc::TOOL_CHANGER`].
    pub tool: usize,
    /// What to do.
    pub action: ToolAction,
    /// How long the tool may take (s).
    pub timeout: f64,
    /// Wanted opening (m), of a move or of a close with a tolerance.
    pub position: f64,
    /// Fastest motion (m/s); 0 is the tool's own.
    pub velocity: f64,
    /// Largest force (N); 0 is the tool's own.
    pub force: f64,
    /// How far the opening may be from `position` with an object held (m); 0 is any.
    pub tolerance: f64,
    /// What the arm carries when the tool has done it; `None` is as before. Its number is given by the
    /// real-time thread.
    pub payload: Option<Payload>,
}

impl ToolOrder {
    /// An order with the tool's own speed and force, which may take `timeout` (s).
    pub fn new(command: u32, tool: usize, action: ToolAction, timeout: f64) -> Self {
        Self {
            command,
            tool,
            action,
            timeout,
            position: 0.0,
            velocity: 0.0,
            force: 0.0,
            tolerance: 0.0,
            payload: None,
        }
    }
}

/// A command takes the place of the one that moves, from a moment of its plan on. The answer is
/// [`super::Event::Spliced`]; refused, the pieces that follow are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splice {
    /// Index of the command that moves.
    pub command: u32,
    /// When its plan ends (s since its start).
    pub path_time: f64,
    /// Index of the command that begins there, in the same state of motion.
    pub by: u32,
}

/// What goes through the ring.
#[derive(Clone, Copy, Debug)]
pub enum Work<const N: usize> {
    /// A piece of a planned motion.
    Motion(Segment<N>),
    /// An order to a tool.
    Tool(ToolOrder),
    /// Guards of the command whose pieces follow.
    Guards(GuardOrder),
    /// How near the arm must come to the end of the command whose pieces go through the ring.
    End(EndTolerance<N>),
    /// The command whose pieces follow takes the place of the one that moves.
    Splice(Splice),
}

/// Work and the epoch it belongs to: an abort begins a new epoch and drops what is older.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item<const N: usize> {
    pub(super) epoch: u32,
    pub(super) work: Work<N>,
}

/// The ring to the real-time thread has no room now; try again a little later.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the ring to the real-time thread is full")]
pub struct Full;

/// The planner's handle. What is pushed is executed in order.
#[derive(Debug)]
pub struct SegmentSender<const N: usize> {
    pub(super) ring: Producer<Item<N>>,
    pub(super) shared: Arc<Shared<N>>,
    pub(super) epoch: u32,
}

impl<const N: usize> SegmentSender<N> {
    /// Sends a planned segment.
    ///
    /// # Errors
    /// [`Full`] when there is no room now.
    pub fn push(&mut self, segment: Segment<N>) -> Result<(), Full> {
        self.hand_over(Work::Motion(segment))
    }

    /// Sends a tool order.
    ///
    /// # Errors
    /// [`Full`] when there is no room now.
    pub fn tool(&mut self, order: ToolOrder) -> Result<(), Full> {
        self.hand_over(Work::Tool(order))
    }

    /// Begins a new program after an abort or a fault: work pushed before this call is dropped if
    /// it was not executed yet. Call it once the [`super::Event::Aborted`] or
    /// [`super::Event::Recovered`] has come.
    pub fn renew(&mut self) {
        self.epoch = self.shared.epoch();
    }

    /// Says that the planner has nothing more to send after `events` events, or, with `None`, that
    /// it begins to plan. Only used with [`super::ExecutorConfig::wait_for_planner`].
    pub fn settle(&self, events: Option<u64>) {
        self.shared.answer(events);
    }

    /// How many more items fit now.
    pub fn room(&self) -> usize {
        self.ring.slots()
    }

    /// Hands over a segment or a tool order.
    ///
    /// # Errors
    /// [`Full`] when there is no room now.
    pub fn hand_over(&mut self, work: Work<N>) -> Result<(), Full> {
        self.ring
            .push(Item {
                epoch: self.epoch,
                work,
            })
            .map_err(|_| Full)
    }
}
