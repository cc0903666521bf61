//! The bounded queue between clients and the planner.

use std::collections::VecDeque;

use crcl::Located;
use planner::controller::AnyStep;
use planner::timed::TimedTrajectory;
use thiserror::Error;

/// What is to be executed.
#[derive(Debug)]
pub enum Given {
    /// A command of the language, planned already or not.
    Command {
        /// The command and where it stood.
        located: Located,
        /// How it is executed, if it was planned before.
        planned: Option<AnyStep>,
    },
    /// A joint trajectory whose times are given.
    Timed(TimedTrajectory),
}

impl Given {
    /// Its name in notes and status.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Command { located, .. } => located.command.name(),
            Self::Timed(_) => "FollowJointTrajectory",
        }
    }

    /// Its line in the program, from 1; 0 where there is none.
    #[must_use]
    pub fn line(&self) -> usize {
        match self {
            Self::Command { located, .. } => located.line,
            Self::Timed(_) => 0,
        }
    }
}

impl From<Located> for Given {
    fn from(located: Located) -> Self {
        let planned = None;
        Self::Command { located, planned }
    }
}

/// A command with its number in the queue.
#[derive(Debug)]
pub struct Queued {
    /// Number of the command, counted from 1 over the life of the queue.
    pub id: u32,
    /// How many aborts there were when it was given: a later one drops it.
    pub epoch: u32,
    /// The command.
    pub given: Given,
}

/// Why a command was not taken.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the command queue is full: it holds {capacity} commands")]
pub struct Full {
    /// How many commands the queue holds.
    pub capacity: usize,
}

/// First in, first out; never grows beyond its capacity.
///
/// ```
/// use engine::queue::Queue;
/// let mut queue = Queue::new(1);
/// let command = |command| crcl::Located { command, span: 0..0, line: 1, column: 1 }.into();
/// assert_eq!(queue.push(command(crcl::Command::InitCanon), 0), Ok(1));
/// assert!(queue.push(command(crcl::Command::OpenGripper), 0).is_err());
/// assert_eq!(queue.pop().map(|queued| queued.id), Some(1));
/// ```
#[derive(Debug)]
pub struct Queue {
    commands: VecDeque<Queued>,
    capacity: usize,
    next_id: u32,
}

impl Queue {
    /// An empty queue for at most `capacity` commands.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self {
            commands: VecDeque::with_capacity(capacity),
            capacity,
            next_id: 1,
        }
    }

    /// Appends a command that is given after `epoch` aborts, and returns its number.
    ///
    /// # Errors
    /// [`Full`]; the queue is then unchanged.
    pub fn push(&mut self, given: Given, epoch: u32) -> Result<u32, Full> {
        if self.commands.len() >= self.capacity {
            return Err(Full {
                capacity: self.capacity,
            });
        }
        let id = self.next_id;
        self.next_id += 1;
        self.commands.push_back(Queued { id, epoch, given });
        Ok(id)
    }

    /// Numbers for commands that do not wait: as many as asked for.
    pub fn number(&mut self, count: usize) -> Vec<u32> {
        let first = self.next_id;
        self.next_id += u32::try_from(count).unwrap_or(0);
        (first..self.next_id).collect()
    }

    /// Takes the oldest command.
    pub fn pop(&mut self) -> Option<Queued> {
        self.commands.pop_front()
    }

    /// The oldest command.
    #[must_use]
    pub fn front(&self) -> Option<&Queued> {
        self.commands.front()
    }

    /// All commands count as given at `epoch`.
    pub fn renew(&mut self, epoch: u32) {
        for queued in &mut self.commands {
            queued.epoch = epoch;
        }
    }

    /// Drops the commands of other epochs than `epoch`, and returns how many there were.
    pub fn keep(&mut self, epoch: u32) -> usize {
        let before = self.commands.len();
        self.commands.retain(|queued| queued.epoch == epoch);
        before - self.commands.len()
    }

    /// Drops all commands and returns how many there were.
    pub fn flush(&mut self) -> usize {
        let count = self.commands.len();
        self.commands.clear();
        count
    }

    /// How many commands wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.commands.len()
    }

    /// Whether no command waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.commands.is_empty()
    }
}
