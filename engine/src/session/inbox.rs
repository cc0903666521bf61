//! The waiting commands, shared by the threads that give commands and the thread that plans them.

use crcl::Command;

use super::{StepError, SubmitError};
use crate::queue::{Full, Given, Queue, Queued};
use servo::{Control, Steering};

/// The queue, with the state that decides whether commands are taken.
#[derive(Debug)]
pub(super) struct Inbox {
    queue: Queue,
    capacity: usize,
    /// Commands that left the queue and are not reported yet.
    flying: usize,
    /// The latched fault, until the worker has seen that it is cleared.
    fault: Option<String>,
    closed: bool,
    /// Whether each command waits until it is let go.
    single_step: bool,
    /// Whether the next command was let go.
    next: bool,
}

impl Inbox {
    /// An empty inbox for at most `capacity` commands.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            queue: Queue::new(capacity),
            capacity,
            flying: 0,
            fault: None,
            closed: false,
            single_step: false,
            next: false,
        }
    }

    /// Appends commands: all of them or none. A stop among them acts at once, before the commands
    /// in front of it.
    pub(super) fn submit(
        &mut self,
        commands: Vec<Given>,
        steering: &Steering,
    ) -> Result<Vec<u32>, SubmitError> {
        if self.closed {
            return Err(SubmitError::Closed);
        }
        if let Some(fault) = &self.fault {
            return Err(SubmitError::Fault(fault.clone()));
        }
        if steering.progress().fault != 0 {
            return Err(SubmitError::Fault("it was just found".to_owned()));
        }
        if self.queue.len() + commands.len() > self.capacity {
            return Err(SubmitError::Full(Full {
                capacity: self.capacity,
            }));
        }
        let epoch = steering.aborts();
        let mut ids = Vec::with_capacity(commands.len());
        for given in commands {
            if let Given::Command { located, .. } = &given
                && let Command::StopMotion { emergency } = located.command
                && self.flying > 0
            {
                steering.control(Control::Stop {
                    fast: emergency != 0,
                });
            }
            ids.push(self.queue.push(given, epoch)?);
        }
        Ok(ids)
    }

    /// Numbers for commands that take the place of the one that moves.
    pub(super) fn number(&mut self, count: usize) -> Vec<u32> {
        self.queue.number(count)
    }

    /// Takes the oldest command off the queue, if it was given at `epoch`.
    pub(super) fn take(&mut self, epoch: u32) -> Option<Queued> {
        if !self.has(epoch) {
            return None;
        }
        self.next = false;
        self.flying += 1;
        self.queue.pop()
    }

    /// Whether a command of this epoch can be taken.
    pub(super) fn has(&self, epoch: u32) -> bool {
        let given = self
            .queue
            .front()
            .is_some_and(|queued| queued.epoch == epoch);
        given && (!self.single_step || self.next)
    }

    /// Whether each command waits until it is let go.
    pub(super) fn set_single_step(&mut self, on: bool) {
        self.single_step = on;
        self.next = false;
    }

    /// Whether each command waits until it is let go.
    pub(super) fn is_single_step(&self) -> bool {
        self.single_step
    }

    /// Lets the next command begin.
    pub(super) fn step_on(&mut self) -> Result<(), StepError> {
        if !self.single_step {
            return Err(StepError::Off);
        }
        if self.flying > 0 {
            return Err(StepError::Moving);
        }
        if self.queue.is_empty() {
            return Err(StepError::Empty);
        }
        self.next = true;
        Ok(())
    }

    /// What waits counts as given at `epoch`.
    pub(super) fn renew(&mut self, epoch: u32) {
        self.queue.renew(epoch);
    }

    /// Drops all waiting commands, or those of other epochs than `epoch` if it is given; returns
    /// how many commands that were.
    pub(super) fn drop_all(&mut self, epoch: Option<u32>) -> usize {
        self.next = false;
        match epoch {
            Some(epoch) => self.queue.keep(epoch),
            None => self.queue.flush(),
        }
    }

    /// Sets how many commands have left the queue and are not reported yet.
    pub(super) fn set_flying(&mut self, flying: usize) {
        self.flying = flying;
    }

    /// Tells which fault is latched.
    pub(super) fn set_fault(&mut self, fault: Option<String>) {
        self.fault = fault;
    }

    /// Takes no more commands.
    pub(super) fn close(&mut self) {
        self.closed = true;
    }

    /// Whether a command waits or is being executed.
    pub(super) fn is_busy(&self) -> bool {
        self.flying > 0 || !self.queue.is_empty()
    }

    /// How many commands wait behind the one that moves.
    pub(super) fn waiting(&self) -> usize {
        self.queue.len() + self.flying.saturating_sub(1)
    }

    /// Whether no command is in the queue.
    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crcl::Located;

    fn commands(count: usize) -> Vec<Given> {
        let text = "Dwell(0.1)\n".repeat(count);
        let read = crcl::text::read(&text, &crcl::ReadOptions::default());
        let given = |located: &Located| Given::from(located.clone());
        read.program.commands.iter().map(given).collect()
    }

    /// In single step each command waits for its own word, and an abort takes the word back.
    #[test]
    fn commands_are_let_go_one_by_one() {
        let mut inbox = Inbox::new(10);
        assert_eq!(inbox.step_on(), Err(StepError::Off));
        inbox.set_single_step(true);
        assert_eq!(inbox.step_on(), Err(StepError::Empty));
        for given in commands(3) {
            inbox.queue.push(given, 7).unwrap();
        }
        assert!(!inbox.has(7) && inbox.take(7).is_none());
        assert_eq!(inbox.step_on(), Ok(()));
        assert!(inbox.has(7) && !inbox.has(8));
        assert!(inbox.take(7).is_some() && !inbox.has(7));
        assert_eq!(inbox.step_on(), Err(StepError::Moving));
        inbox.set_flying(0);
        assert_eq!(inbox.step_on(), Ok(()));
        inbox.drop_all(None);
        for given in commands(2) {
            inbox.queue.push(given, 8).unwrap();
        }
        assert!(!inbox.has(8), "what was let go before an abort is gone");
        inbox.set_single_step(false);
        assert!(inbox.take(8).is_some() && inbox.take(8).is_some());
    }
}
