//! A move that takes the place of the one that moves, in the same state of motion.

use std::time::{Duration, Instant};

use crcl::Located;
use planner::controller::{Controller, Step};
use planner::task::Task;
use servo::{EndTolerance, Splice};
use trajectory::Trajectory;

use super::super::ReplaceError;
use super::super::note::Note;
use super::motion::{end_tolerance, motion};
use super::{Work, Worker};

/// How long before the new motion begins it is planned (s of the old one).
const LEAD: f64 = 0.05;

/// How long before that it must be with the real-time thread (s).
const MARGIN: f64 = 0.004;

/// How long the real-time thread may take to answer.
const ANSWER: Duration = Duration::from_millis(100);

/// Most pieces of a motion that can be cut: what the real-time thread has at hand.
const MOST_PIECES: usize = 500;

/// The new move with what comes before and behind it.
struct New<const N: usize> {
    controller: Controller<N>,
    steps: Vec<(Located, Step<N>)>,
}

impl<const N: usize> Worker<'_, N> {
    /// Plans a move from where the arm will be in a moment, and hands it over.
    pub(super) fn replace(&mut self, commands: Vec<Located>) -> Result<Vec<u32>, ReplaceError> {
        // In lock-step, time stands from here on.
        self.sender.settle(None);
        self.read_reports();
        self.report_done();
        let refused = |why: &str| ReplaceError(why.to_owned());
        let waits = !self.ends.shared.inbox().is_empty() || !self.work.is_empty();
        let held = self.fault.is_some() || self.is_held() || self.jogging.is_some();
        let [old] = self.flight.make_contiguous() else {
            return Err(refused("not exactly one command is under way"));
        };
        let (old_id, guarded) = (old.id, old.guarding.is_some());
        let Some(motion) = old.motion.as_ref().filter(|_| !guarded && !waits && !held) else {
            return Err(refused("the command under way cannot be replaced"));
        };
        let now = self.remote.measured();
        let steady = now.command == old_id && now.time_scaling == 1.0 && !now.held;
        let path_time = now.path_time + LEAD;
        if !steady || path_time + MARGIN >= motion.duration() {
            return Err(refused(
                "the motion is about to end, or does not go its planned speed",
            ));
        }
        if motion.pieces().len() > MOST_PIECES {
            return Err(refused("the motion under way is too long"));
        }
        let at = motion.sample(path_time);
        let new = self.plan_all(commands, &at)?;
        if self.remote.measured().path_time + MARGIN >= path_time {
            return Err(refused("planning took too long"));
        }
        self.hand_over(old_id, path_time, new)
    }

    /// Plans the commands: one move, and settings.
    fn plan_all(
        &self,
        commands: Vec<Located>,
        at: &realtime::Sample<N>,
    ) -> Result<New<N>, ReplaceError> {
        let mut controller = self.controller.clone();
        controller.set_joints(at.position);
        let mut steps = Vec::with_capacity(commands.len());
        let mut moves = 0;
        for located in commands {
            let planned = if located.command.takes_guards() {
                moves += 1;
                controller.step_moving(&located.command, at)
            } else {
                controller.step(&located.command)
            };
            let step = planned.map_err(|error| ReplaceError(error.to_string()))?;
            let fits = step.planned.is_some() || step.task == Task::Setting;
            if !fits || moves > 1 {
                return Err(ReplaceError(
                    "it is not a single move with settings".to_owned(),
                ));
            }
            steps.push((located, step));
        }
        match moves {
            1 => Ok(New { controller, steps }),
            _ => Err(ReplaceError("there is no move".to_owned())),
        }
    }

    /// Sends the new motion to the real-time thread, and waits until that has taken it.
    fn hand_over(
        &mut self,
        old: u32,
        path_time: f64,
        new: New<N>,
    ) -> Result<Vec<u32>, ReplaceError> {
        let ids = self.ends.shared.inbox().number(new.steps.len());
        let newest = self.steering.newest();
        let mut flights = Vec::with_capacity(ids.len());
        let mut by = 0;
        for (id, (located, step)) in ids.iter().zip(new.steps) {
            let named = (located.line, located.command.name());
            let mut flight = self.take_off(*id, named, *new.controller.chain(), newest);
            flight.planned_s = step.ticks as f64 / self.config.rate_hz;
            match step.planned {
                Some(planned) => {
                    by = *id;
                    let splice = Splice {
                        command: old,
                        path_time,
                        by,
                    };
                    let pieces = planned.trajectory.pieces();
                    let end = end_tolerance(by, pieces, &new.controller);
                    self.send_motion(splice, &planned.trajectory, end);
                    flight.motion = Some(planned.trajectory);
                }
                None => flight.finished = Some(0),
            }
            flights.push(flight);
        }
        if !self.is_taken(by) {
            self.work.clear();
            return Err(ReplaceError("it came too late".to_owned()));
        }
        if let Some(old) = self.flight.pop_front() {
            let (id, line, name) = (old.id, old.line, old.name);
            self.say(Note::Replaced { id, line, name, by });
        }
        self.controller = new.controller;
        self.flight.extend(flights);
        self.ends.shared.inbox().set_flying(self.flight.len());
        Ok(ids)
    }

    fn send_motion(&mut self, splice: Splice, way: &Trajectory<N>, end: Option<EndTolerance<N>>) {
        self.work.push_back(Work::Splice(splice));
        self.work.extend(motion(splice.by, way.pieces(), true, end));
        self.spliced = None;
        self.feed();
    }

    /// Waits until the real-time thread says whether it has taken the motion.
    fn is_taken(&mut self, by: u32) -> bool {
        let end = Instant::now() + ANSWER;
        while Instant::now() < end {
            self.read_reports();
            self.feed();
            if let Some((_, accepted)) = self.spliced.filter(|(id, _)| *id == by) {
                return accepted;
            }
            self.sender.settle(Some(self.events.seen()));
            std::thread::sleep(Duration::from_micros(50));
        }
        false
    }
}
