//! Jogging with a dead man's switch: a jog lasts as long as requests keep coming.

use std::time::{Duration, Instant};

use planner::motion::Direction;
use realtime::Segment;
use servo::Control;

use super::super::jog::{Jog, JogError, JogSpace, Turns, direction};
use super::super::note::Note;
use super::{Work, Worker};

/// Command number of a jog in the executor.
const COMMAND: u32 = u32::MAX;
/// The dead man's switch: least and most time without a request.
const TIMEOUT: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(2));

/// The current jog.
#[derive(Clone, Debug)]
pub(super) struct Jogging {
    request: Jog,
    until: Instant,
    phase: Phase,
    /// The jog that begins after the stop, with its time limit.
    next: Option<(Jog, Instant)>,
}

/// Where a jog is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The path will be planned as soon as the arm rests.
    Waiting,
    /// On its way.
    Moving,
    /// It is stopping.
    Ending,
    /// The arm cannot move further; it rests until the switch is released.
    Stuck,
}

impl<const N: usize> Worker<'_, N> {
    /// Begins, prolongs, changes or ends a jog.
    pub(super) fn jog(&mut self, request: Jog) -> Result<(), JogError> {
        let direction = direction::<N>(&request, &self.turns())?;
        let until = Instant::now() + request.timeout.clamp(TIMEOUT.0, TIMEOUT.1);
        if let Some(fault) = &self.fault {
            return Err(JogError::Fault(fault.clone()));
        }
        if self.has_program() {
            return Err(JogError::Program);
        }
        let Some(jogging) = &mut self.jogging else {
            return match direction {
                Some(direction) => self.begin_jog(request, &direction, until),
                None => Ok(()),
            };
        };
        let same = direction.is_some()
            && jogging.request.speeds == request.speeds
            && jogging.request.goal == request.goal;
        if same && jogging.request.space == request.space && jogging.phase != Phase::Ending {
            jogging.until = until;
            return Ok(());
        }
        jogging.next = direction.map(|_| (request, until));
        self.end_jog();
        Ok(())
    }

    fn begin_jog(
        &mut self,
        request: Jog,
        direction: &Direction<N>,
        until: Instant,
    ) -> Result<(), JogError> {
        let now = self.remote.measured();
        if now.held || self.is_held() {
            return Err(JogError::Held);
        }
        if !(now.idle && now.resting) {
            return Err(JogError::Program);
        }
        self.plan_jog(direction)?;
        self.jogging = Some(Jogging {
            request,
            until,
            phase: Phase::Moving,
            next: None,
        });
        Ok(())
    }

    /// Orientations of tool and base in the workstation.
    fn turns(&self) -> Turns {
        let (now, chain) = (self.remote.measured().setpoint, self.controller.chain());
        Turns {
            tool: chain.forward(&now).rotation,
            base: chain.reference_from_base().rotation,
        }
    }

    /// Plans the path from where the arm rests and sends it.
    fn plan_jog(&mut self, direction: &Direction<N>) -> Result<(), JogError> {
        let start = self.remote.measured().setpoint;
        self.controller.set_joints(start);
        let planner = self.controller.planner();
        let planned = planner
            .jog(direction, &start, &self.most)
            .map_err(|error| JogError::Motion(error.to_string()))?;
        let pieces = planned.trajectory.pieces();
        for (index, piece) in pieces.iter().enumerate() {
            self.work.push_back(Work::Motion(Segment {
                piece: *piece,
                command: COMMAND,
                last: index + 1 == pieces.len(),
            }));
        }
        Ok(())
    }

    /// Stops the arm on its path; the next jog begins when it rests.
    fn end_jog(&mut self) {
        let Some(jogging) = &mut self.jogging else {
            return;
        };
        match jogging.phase {
            Phase::Waiting | Phase::Stuck => {
                self.rest_from_jog();
            }
            Phase::Moving => {
                jogging.phase = Phase::Ending;
                self.jog_aborts += 1;
                self.remote.control(Control::Discard { fast: false });
            }
            Phase::Ending => {}
        }
    }

    /// Checks the dead man's switch, and starts the next jog when the arm rests.
    pub(super) fn watch_jog(&mut self) {
        let Some(jogging) = &self.jogging else { return };
        if Instant::now() >= jogging.until {
            return self.end_jog();
        }
        let now = self.remote.measured();
        if jogging.phase != Phase::Waiting || !(now.idle && now.resting) || now.held {
            return;
        }
        let begun =
            direction::<N>(&jogging.request, &self.turns()).and_then(|direction| match direction {
                Some(direction) => self.plan_jog(&direction),
                None => Ok(()),
            });
        if let Some(jogging) = &mut self.jogging {
            jogging.phase = if begun.is_ok() {
                Phase::Moving
            } else {
                Phase::Stuck
            };
        }
        if let Err(error) = begun {
            let text = format!("jog: {error}");
            self.say(Note::Message { text });
        }
    }

    /// Whether it was a jog that came to the end of its path. It continues from there if it can,
    /// and is over where its length or its goal was given.
    pub(super) fn jog_finished(&mut self, command: u32) -> bool {
        let ours = command == COMMAND;
        if let Some(jogging) = self.jogging.as_mut().filter(|_| ours)
            && jogging.phase == Phase::Moving
        {
            if jogging.request.distance.is_some() || jogging.request.space == JogSpace::Goal {
                self.rest_from_jog();
            } else {
                jogging.phase = Phase::Waiting;
            }
        }
        ours
    }

    /// The arm rests after a jog; returns whether there was one. The next jog begins.
    pub(super) fn rest_from_jog(&mut self) -> bool {
        let Some(jogging) = self.jogging.take() else {
            return false;
        };
        self.work.clear();
        self.sender.renew();
        self.controller.set_joints(self.remote.measured().setpoint);
        match jogging.next.filter(|(_, until)| Instant::now() < *until) {
            Some((request, until)) => {
                self.jogging = Some(Jogging {
                    request,
                    until,
                    phase: Phase::Waiting,
                    next: None,
                });
            }
            None => self.say(Note::Stopped),
        }
        true
    }
}
