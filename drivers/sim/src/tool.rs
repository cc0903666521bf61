//! A gripper or tool changer that takes its time.

use ipc::{ToolAction, ToolCommand, ToolFeedback, ToolStatus};

use crate::ToolOptions;

/// A gripper or tool changer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tool {
    options: Option<ToolOptions>,
    order: u32,
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
            order: 0,
            goal: status,
            left: 0.0,
            status,
        }
    }

    /// A session counts its orders from 1 again.
    pub(crate) fn forget_orders(&mut self) {
        self.order = 0;
    }

    /// Takes an order if it is new.
    pub(crate) fn take(&mut self, command: &ToolCommand) {
        if command.order == self.order {
            return;
        }
        let Some(action) = ToolAction::from_number(command.action) else {
            return;
        };
        self.order = command.order;
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
            order: self.order,
            status: self.status as u32,
            position,
            force: 0.0,
            reserved: 0,
        }
    }
}
