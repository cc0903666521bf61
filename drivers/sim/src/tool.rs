//! A gripper or tool changer whose actions take time.

use ipc::{ToolAction, ToolCommand, ToolFeedback, ToolFlags, ToolStatus};

use crate::ToolOptions;

/// Force of a gripper that was given none (N).
const USUAL_FORCE: f64 = 20.0;

/// A gripper or tool changer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tool {
    options: Option<ToolOptions>,
    goal: ToolStatus,
    /// Openings at the begin and at the end of the motion (m).
    way: [f64; 2],
    /// Length of the motion, and what is left of it (s).
    duration: f64,
    left: f64,
    status: ToolStatus,
    /// Force on the object that is held (N).
    force: f64,
}

impl Tool {
    pub(crate) fn new(options: Option<ToolOptions>) -> Self {
        let (status, opening) = match options {
            None => (ToolStatus::Unknown, 0.0),
            Some(options) if options.open => (ToolStatus::Open, options.width),
            Some(_) => (ToolStatus::Closed, 0.0),
        };
        Self {
            options,
            goal: status,
            way: [opening; 2],
            duration: 0.0,
            left: 0.0,
            status,
            force: 0.0,
        }
    }

    /// Begins an order.
    pub(crate) fn act(&mut self, order: &ToolCommand) {
        let Some(options) = self.options else {
            if ToolAction::from_number(order.action) != Some(ToolAction::None) {
                self.status = ToolStatus::Failed;
            }
            return;
        };
        let object = options.object.unwrap_or(0.0);
        let share = |to: f64| (to - self.opening()).abs() / options.width.max(1e-9);
        let (goal, to, duration) = match ToolAction::from_number(order.action) {
            Some(ToolAction::Open) => (ToolStatus::Open, options.width, options.opening),
            Some(ToolAction::Close) => (ToolStatus::Closed, object, options.closing),
            Some(ToolAction::Home) => (ToolStatus::Open, options.width, options.opening),
            Some(ToolAction::Move) => {
                let to = order.position.clamp(object, options.width);
                (ToolStatus::Reached, to, options.closing * share(to))
            }
            Some(ToolAction::None) | None => return,
        };
        if self.status == goal && goal != ToolStatus::Reached {
            return;
        }
        self.way = [self.opening(), to];
        self.duration = if order.velocity > 0.0 {
            (to - self.way[0]).abs() / order.velocity
        } else {
            duration
        };
        self.left = self.duration;
        (self.goal, self.status) = (goal, ToolStatus::Moving);
        let held = options.object.is_some() && goal == ToolStatus::Closed;
        self.force = match (held, order.force > 0.0) {
            (false, _) => 0.0,
            (true, true) => order.force,
            (true, false) => USUAL_FORCE,
        };
    }

    /// Moves for `period` (s).
    pub(crate) fn move_on(&mut self, period: f64) {
        if self.status == ToolStatus::Moving {
            self.left -= period;
            if self.left <= 0.0 {
                self.status = self.goal;
            }
        }
    }

    /// The present opening (m).
    fn opening(&self) -> f64 {
        let [from, to] = self.way;
        let left = if self.duration > 0.0 {
            (self.left / self.duration).clamp(0.0, 1.0)
        } else {
            0.0
        };
        to + (from - to) * left
    }

    pub(crate) fn feedback(&self) -> ToolFeedback {
        let Some(options) = self.options else {
            return ToolFeedback {
                status: self.status as u32,
                ..ToolFeedback::default()
            };
        };
        let held = self.status == ToolStatus::Closed && options.object.is_some();
        let object = if held { ToolFlags::OBJECT } else { 0 };
        ToolFeedback {
            status: self.status as u32,
            position: self.opening(),
            force: if held { self.force } else { 0.0 },
            flags: ToolFlags::POSITION | ToolFlags::FORCE | ToolFlags::SENSES_OBJECT | object,
            ..ToolFeedback::default()
        }
    }
}
