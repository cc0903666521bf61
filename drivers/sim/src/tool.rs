//! A gripper or tool changer whose actions take time.

use ipc::{ToolAction, ToolFeedback, ToolStatus};

use crate::ToolOptions;

/// A gripper or tool changer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tool {
    options: Option<ToolOptions>,
    goal: ToolStatus,
    /// What is left of the motion (s).
    left: f64,
    status: ToolStatus,
}

impl Tool {
    pub(crate) fn new(options: Option<ToolOptions>) -> Self {
        let status = match options {
            None => ToolStatus::Unknown,
            Some(options) if options.open => ToolStatus::Open,
            Some(_) => ToolStatus::Closed,
        };
        Self {
            options,
            goal: status,
            left: 0.0,
            status,
        }
    }

    /// Begins an action.
    pub(crate) fn act(&mut self, action: ToolAction) {
        let (goal, duration) = match (action, self.options) {
            (ToolAction::None, _) => return,
            (_, None) => {
                self.status = ToolStatus::Failed;
                return;
            }
            (ToolAction::Open, Some(options)) => (ToolStatus::Open, options.opening),
            (ToolAction::Close, Some(options)) => (ToolStatus::Closed, options.closing),
        };
        if self.status != goal {
            self.goal = goal;
            self.status = ToolStatus::Moving;
            self.left = duration;
        }
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

    pub(crate) fn feedback(&self) -> ToolFeedback {
        let width = self.options.map_or(0.0, |options| options.width);
        let duration = self.options.map_or(1.0, |options| match self.goal {
            ToolStatus::Open => options.opening,
            _ => options.closing,
        });
        let left = if duration > 0.0 {
            (self.left / duration).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let position = match (self.status, self.goal) {
            (ToolStatus::Open, _) => width,
            (ToolStatus::Moving, ToolStatus::Open) => width * (1.0 - left),
            (ToolStatus::Moving, _) => width * left,
            _ => 0.0,
        };
        ToolFeedback {
            status: self.status as u32,
            position,
            ..ToolFeedback::default()
        }
    }
}
