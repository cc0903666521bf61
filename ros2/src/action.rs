//! The action `FollowJointTrajectory`: what a goal goes through.

use std::time::{Duration, Instant};

use ros2_client::RmwRequestId;
use ros2_client::action::{
    CancelGoalResponse, GetResultResponse, GoalInfo, GoalStatusEnum, SendGoalRequest,
    SendGoalResponse,
};
use ros2_client::action_msgs::{CancelGoalResponseEnum, GoalStatus, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;
use ros2_client::log::LogLevel;

use crate::bridge::Bridge;
use crate::engine::{Order, Task};
use crate::goal::{Wanted, violation};
use crate::goals::{Active, Cancel, Phase, wanted};
use crate::messages::{Feedback, Goal, Outcome};
use crate::notes::Fate;
use crate::stopper::Stopped;

/// Time between two feedbacks.
const FEEDBACK: Duration = Duration::from_millis(50);

/// How long the engine may take to check a trajectory and begin it.
const CHECK: Duration = Duration::from_secs(30);

/// How long it may remain unknown whether it was this goal that the engine dropped.
const DOUBT: Duration = Duration::from_secs(1);

impl Bridge {
    pub(crate) fn read_goals(&mut self) {
        loop {
            match self.ends.action.receive_goal() {
                Ok(Some((request, goal))) => self.take(request, goal),
                Ok(None) => return,
                Err(error) => {
                    return self
                        .ends
                        .say(LogLevel::Warn, &format!("a goal cannot be read: {error}"));
                }
            }
        }
    }

    /// Asks the engine for a goal, or rejects it.
    fn take(&mut self, request: RmwRequestId, asked: SendGoalRequest<Goal>) {
        let id = asked.goal_id;
        let now = Time::now();
        let read = if self.goals.knows(id) {
            Err("a goal of this name is known already".to_owned())
        } else if let Some(why) = self.busy() {
            Err(why.to_owned())
        } else {
            Wanted::read(asked.goal, &self.arm.joints, now.to_nanos() as f64 * 1e-9)
        };
        let wanted = match read {
            Ok(wanted) => wanted,
            Err(why) => return self.reject(request, &why),
        };
        let serial = self.next_serial();
        let task = Task::Follow {
            joints: wanted.joints.clone(),
            points: wanted.points.clone(),
            retime: self.retime,
        };
        let _ = self.threads.orders.send(Order { serial, task });
        self.goals.active = Some(Active {
            id,
            request,
            wanted,
            serial,
            since: Instant::now(),
            command: None,
            accepted: now,
            dropped: None,
            doomed: false,
            phase: Phase::Checking,
        });
    }

    /// Says no, and why on `/rosout`: the answer itself has no room for words.
    fn reject(&self, request: RmwRequestId, why: &str) {
        self.ends
            .say(LogLevel::Error, &format!("goal rejected: {why}"));
        let answer = SendGoalResponse {
            accepted: false,
            stamp: Time::now(),
        };
        self.sent(self.ends.action.send_goal_response(request, answer));
    }

    /// Says where an answer was lost.
    fn sent<E: std::fmt::Display>(&self, result: Result<(), E>) {
        if let Err(error) = result {
            self.ends
                .say(LogLevel::Warn, &format!("an answer was not sent: {error}"));
        }
    }

    /// The engine has queued the trajectory as this command.
    pub(crate) fn goal_taken(&mut self, serial: u64, command: u64) {
        if let Some(active) = self.goals.active.as_mut().filter(|a| a.serial == serial) {
            active.command = Some(command);
        }
    }

    /// The engine does not follow the goal for which `which` is true, if it is being checked.
    pub(crate) fn goal_refused(&mut self, which: impl Fn(&Active) -> bool, why: &str) {
        let checked = |active: &Active| active.phase == Phase::Checking && which(active);
        if self.goals.active.as_ref().is_some_and(checked)
            && let Some(active) = self.goals.active.take()
        {
            self.reject(active.request, why);
        }
    }

    /// What became of the goal's command.
    pub(crate) fn goal_fate(&mut self, fate: Fate) {
        let Some(active) = &self.goals.active else {
            return;
        };
        let ours = |id: u64| active.command == Some(id);
        match fate {
            Fate::Started(id) if ours(id) => self.accept(),
            Fate::Done(id) if ours(id) => {
                self.accept();
                if let Some(active) = &mut self.goals.active
                    && active.phase == Phase::Moving
                {
                    active.phase = Phase::Arriving(Instant::now());
                }
            }
            Fate::Refused(id, why) if ours(id) => {
                self.goal_refused(|_| true, &why);
            }
            Fate::Dropped(why) => self.dropped(&why),
            _ => {}
        }
    }

    /// The arm will not go on: a fault, a stop of others, or the end of the engine.
    fn dropped(&mut self, why: &str) {
        match self
            .goals
            .active
            .as_ref()
            .map(|active| active.phase.clone())
        {
            Some(Phase::Checking) => {
                if let Some(active) = &mut self.goals.active {
                    active.dropped = Some((Instant::now(), why.to_owned()));
                }
            }
            Some(Phase::Moving | Phase::Arriving(_)) => {
                let outcome = Outcome {
                    error_code: Outcome::PATH_TOLERANCE_VIOLATED,
                    error_string: why.to_owned(),
                };
                self.finish(GoalStatusEnum::Aborted, outcome);
            }
            // Our own stop ends it.
            Some(Phase::Ending(_)) | None => {}
        }
    }

    /// Says yes: the trajectory was checked and begins.
    fn accept(&mut self) {
        let Some(active) = self.goals.active.as_mut() else {
            return;
        };
        if active.phase != Phase::Checking {
            return;
        }
        if active.doomed {
            let _ = self.threads.stops.send(0);
            return self.goal_refused(|_| true, "a stop was asked for");
        }
        active.phase = Phase::Moving;
        active.accepted = Time::now();
        let answer = SendGoalResponse {
            accepted: true,
            stamp: active.accepted,
        };
        let request = active.request;
        self.sent(self.ends.action.send_goal_response(request, answer));
        self.publish_statuses();
    }

    fn publish_statuses(&self) {
        let status = |(goal_info, status)| GoalStatus { goal_info, status };
        let status_list = self.goals.statuses().into_iter().map(status).collect();
        let message = GoalStatusArray { status_list };
        // The next change brings all of them again.
        let _ = self.ends.action.send_goal_statuses(message);
    }

    pub(crate) fn read_cancels(&mut self) {
        while let Ok(Some((request, asked))) = self.ends.action.receive_cancel_request() {
            let meant = wanted(&asked).map_or(Cancel::Unknown, |info| self.goals.cancel(&info));
            let canceling = self.begin_cancel(meant);
            let return_code = match (meant, canceling.is_empty()) {
                (_, false) => CancelGoalResponseEnum::None,
                (Cancel::Active, true) => CancelGoalResponseEnum::Rejected,
                (Cancel::Over, true) => CancelGoalResponseEnum::GoalTerminated,
                (Cancel::Unknown, true) => CancelGoalResponseEnum::UnknownGoal,
            };
            let answer = CancelGoalResponse {
                return_code,
                goals_canceling: canceling,
            };
            self.sent(self.ends.action.send_cancel_response(request, answer));
            self.publish_statuses();
        }
    }

    /// Begins to stop the goal that is executed; gives the goals that are stopped now.
    fn begin_cancel(&mut self, meant: Cancel) -> Vec<GoalInfo> {
        let Some(active) = self
            .goals
            .active
            .as_mut()
            .filter(|_| meant == Cancel::Active)
        else {
            return Vec::new();
        };
        let info = GoalInfo {
            goal_id: active.id,
            stamp: active.accepted,
        };
        match active.phase {
            Phase::Ending(Some(_)) => return Vec::new(),
            Phase::Ending(None) => return vec![info],
            _ => active.phase = Phase::Ending(None),
        }
        let _ = self.threads.stops.send(active.serial);
        vec![info]
    }

    /// The arm rests after a stop: the goal that was stopped is over.
    pub(crate) fn goal_stopped(&mut self, stopped: &Stopped) {
        let Some(active) = self
            .goals
            .active
            .as_ref()
            .filter(|a| a.serial == stopped.serial)
        else {
            return;
        };
        let Phase::Ending(why) = active.phase.clone() else {
            return;
        };
        let at = self.arm.path_time();
        let failed = stopped.result.as_ref().err();
        let (status, error_code, error_string) = match (why, failed) {
            (_, Some(failure)) => {
                let code = Outcome::PATH_TOLERANCE_VIOLATED;
                (GoalStatusEnum::Aborted, code, failure.clone())
            }
            (Some(why), None) => (
                GoalStatusEnum::Aborted,
                Outcome::PATH_TOLERANCE_VIOLATED,
                why,
            ),
            (None, None) => {
                let said = format!("stopped on the path, {at:.3} s after its start");
                (GoalStatusEnum::Canceled, 0, said)
            }
        };
        self.finish(
            status,
            Outcome {
                error_code,
                error_string,
            },
        );
    }

    /// Ends the goal, and tells everybody.
    fn finish(&mut self, status: GoalStatusEnum, outcome: Outcome) {
        if status == GoalStatusEnum::Aborted {
            self.ends.say(
                LogLevel::Error,
                &format!("goal aborted: {}", outcome.error_string),
            );
        }
        for request in self.goals.finish(status, outcome.clone()) {
            let answer = GetResultResponse {
                status,
                result: outcome.clone(),
            };
            self.sent(self.ends.action.send_result(request, answer));
        }
        self.publish_statuses();
    }

    pub(crate) fn read_results(&mut self) {
        while let Ok(Some((request, asked))) = self.ends.action.receive_result_request() {
            if let Some(over) = self.goals.result(request, asked.goal_id) {
                let answer = GetResultResponse {
                    status: over.status,
                    result: over.outcome,
                };
                self.sent(self.ends.action.send_result(request, answer));
            }
        }
    }

    /// Looks after the goal: its tolerances, its end, its feedback.
    pub(crate) fn watch(&mut self) {
        match self.goals.active.as_ref().map(|active| &active.phase) {
            Some(Phase::Checking) => self.watch_check(),
            Some(Phase::Moving) => {
                self.watch_path();
                self.feed_back();
            }
            Some(Phase::Arriving(since)) => self.watch_end(*since),
            Some(Phase::Ending(_)) | None => {}
        }
    }

    fn watch_check(&mut self) {
        let active = self.goals.active.as_ref();
        let dropped = active.and_then(|active| active.dropped.clone());
        if let Some((_, why)) = dropped.filter(|(at, _)| at.elapsed() > DOUBT) {
            // It must not begin later, when nobody expects it.
            let _ = self.threads.stops.send(0);
            return self.goal_refused(|_| true, &why);
        }
        let late = |active: &Active| active.since.elapsed() > CHECK;
        if self.goals.active.as_ref().is_some_and(late) {
            let _ = self.threads.stops.send(0);
            let why = format!("the trajectory has not begun within {} s", CHECK.as_secs());
            self.goal_refused(|_| true, &why);
        }
    }

    fn watch_path(&mut self) {
        let Some(active) = &mut self.goals.active else {
            return;
        };
        let off = self.arm.off().unwrap_or_default().into_iter();
        if let Some(why) = violation(&self.arm.joints, &active.wanted.path, off) {
            active.phase = Phase::Ending(Some(why));
            let _ = self.threads.stops.send(active.serial);
        }
    }

    /// The engine is done: the goal is reached when every joint is near enough.
    fn watch_end(&mut self, since: Instant) {
        let Some(active) = &self.goals.active else {
            return;
        };
        let off = self.arm.off().unwrap_or_default().into_iter();
        match violation(&self.arm.joints, &active.wanted.end, off) {
            None => self.finish(GoalStatusEnum::Succeeded, Outcome::default()),
            Some(why) if since.elapsed().as_secs_f64() >= active.wanted.patience => {
                let error_code = Outcome::GOAL_TOLERANCE_VIOLATED;
                self.finish(
                    GoalStatusEnum::Aborted,
                    Outcome {
                        error_code,
                        error_string: why,
                    },
                );
            }
            Some(_) => {}
        }
    }

    fn feed_back(&mut self) {
        if self.told.elapsed() < FEEDBACK {
            return;
        }
        let (Some(active), Some(progress)) = (&self.goals.active, self.arm.progress()) else {
            return;
        };
        self.told = Instant::now();
        let (header, [desired, actual, error]) = progress;
        let index = self
            .indexed
            .then(|| active.wanted.index(self.arm.path_time()));
        let feedback = Feedback {
            header,
            joint_names: self.arm.joints.clone(),
            desired,
            actual,
            error,
            index,
        };
        // The next one comes soon.
        let _ = self.ends.action.send_feedback(active.id, feedback);
    }
}
