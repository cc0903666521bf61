//! The goals of the action: one that is executed, and the last ones that are over.

use std::collections::VecDeque;
use std::time::Instant;

use ros2_client::RmwRequestId;
use ros2_client::action::{GoalId, GoalInfo, GoalStatusEnum};
use ros2_client::builtin_interfaces::Time;
use serde_json::Value;

use crate::goal::Wanted;
use crate::messages::Outcome;

/// How many results are kept for clients that ask for them.
const KEPT: usize = 32;

/// How many requests for results may wait.
const WAITING: usize = 64;

/// Where the goal is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Phase {
    /// The engine checks it; the client has no answer yet.
    Checking,
    /// It moves.
    Moving,
    /// The engine is done; the joints may take a while to be there.
    Arriving(Instant),
    /// It is being stopped, and ends as canceled, or aborted for this reason.
    Ending(Option<String>),
}

/// The goal that is checked or executed.
#[derive(Clone, Debug)]
pub(crate) struct Active {
    /// Its name.
    pub(crate) id: GoalId,
    /// The request that waits for yes or no.
    pub(crate) request: RmwRequestId,
    /// What it wants.
    pub(crate) wanted: Wanted,
    /// Number of the task for the engine, and of a stop.
    pub(crate) serial: u64,
    /// When it came.
    pub(crate) since: Instant,
    /// Number of the engine's command.
    pub(crate) command: Option<u64>,
    /// When it was accepted.
    pub(crate) accepted: Time,
    /// When something was dropped while it was checked, and why. It may have been what was given before:
    /// notes come a moment after the engine takes commands again.
    pub(crate) dropped: Option<(Instant, String)>,
    /// Whether a stop was asked for before it began: it must not go on.
    pub(crate) doomed: bool,
    /// Where it is.
    pub(crate) phase: Phase,
}

impl Active {
    /// Its status; none before it is accepted.
    fn status(&self) -> Option<GoalStatusEnum> {
        match self.phase {
            Phase::Checking => None,
            Phase::Moving | Phase::Arriving(_) | Phase::Ending(Some(_)) => {
                Some(GoalStatusEnum::Executing)
            }
            Phase::Ending(None) => Some(GoalStatusEnum::Canceling),
        }
    }
}

/// A goal that is over.
#[derive(Clone, Debug)]
pub(crate) struct Over {
    id: GoalId,
    accepted: Time,
    /// How it ended.
    pub(crate) status: GoalStatusEnum,
    /// With what.
    pub(crate) outcome: Outcome,
}

/// What a request to cancel asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cancel {
    /// The goal that is executed.
    Active,
    /// A goal that is over.
    Over,
    /// A goal that is not known, or not accepted yet.
    Unknown,
}

/// All goals that are known.
#[derive(Debug, Default)]
pub(crate) struct Goals {
    /// The one that is checked or executed.
    pub(crate) active: Option<Active>,
    over: VecDeque<Over>,
    waiting: VecDeque<(RmwRequestId, GoalId)>,
}

impl Goals {
    /// Ends the goal that is executed; gives the requests that wait for its result.
    pub(crate) fn finish(&mut self, status: GoalStatusEnum, outcome: Outcome) -> Vec<RmwRequestId> {
        let Some(active) = self.active.take() else {
            return Vec::new();
        };
        let id = active.id;
        self.over.push_back(Over {
            id,
            accepted: active.accepted,
            status,
            outcome,
        });
        if self.over.len() > KEPT {
            self.over.pop_front();
        }
        let (these, others): (Vec<_>, Vec<_>) =
            self.waiting.drain(..).partition(|(_, goal)| *goal == id);
        self.waiting = others.into();
        these.into_iter().map(|(request, _)| request).collect()
    }

    /// Takes a request for a result: the result if the goal is over or unknown; none if the request
    /// waits now.
    pub(crate) fn result(&mut self, request: RmwRequestId, id: GoalId) -> Option<Over> {
        if let Some(over) = self.over.iter().rev().find(|over| over.id == id) {
            return Some(over.clone());
        }
        if self.active.as_ref().is_some_and(|active| active.id == id) {
            self.waiting.push_back((request, id));
            if self.waiting.len() > WAITING {
                self.waiting.pop_front();
            }
            return None;
        }
        Some(Over {
            id,
            accepted: Time::ZERO,
            status: GoalStatusEnum::Unknown,
            outcome: Outcome::default(),
        })
    }

    /// Whether a goal of this name is known.
    pub(crate) fn knows(&self, id: GoalId) -> bool {
        self.over.iter().any(|over| over.id == id)
            || self.active.as_ref().is_some_and(|active| active.id == id)
    }

    /// Name and status of every goal that was accepted.
    pub(crate) fn statuses(&self) -> Vec<(GoalInfo, GoalStatusEnum)> {
        let over = self
            .over
            .iter()
            .map(|over| (over.id, over.accepted, over.status));
        let active = self.active.as_ref();
        let active = active.and_then(|a| a.status().map(|status| (a.id, a.accepted, status)));
        let info = |(goal_id, stamp, status)| (GoalInfo { goal_id, stamp }, status);
        over.chain(active).map(info).collect()
    }

    /// Which goal a request to cancel means: one name, or all that were accepted until a time; both
    /// 0 means all.
    pub(crate) fn cancel(&self, wanted: &GoalInfo) -> Cancel {
        let all = wanted.goal_id == GoalId::ZERO;
        if let Some(active) = self
            .active
            .as_ref()
            .filter(|active| active.status().is_some())
        {
            let until = wanted.stamp != Time::ZERO && active.accepted <= wanted.stamp;
            let any = all && wanted.stamp == Time::ZERO;
            if any || until || active.id == wanted.goal_id {
                return Cancel::Active;
            }
        }
        if self.over.iter().any(|over| over.id == wanted.goal_id) {
            return Cancel::Over;
        }
        Cancel::Unknown
    }
}

/// What a request to cancel says. The crate keeps its field to itself; as data it is readable.
pub(crate) fn wanted(request: &impl serde::Serialize) -> Option<GoalInfo> {
    let data: Value = serde_json::to_value(request).ok()?;
    serde_json::from_value(data["goal_info"].clone()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros2_client::action::CancelGoalRequest;

    fn active(id: GoalId, phase: Phase) -> Active {
        Active {
            id,
            request: RmwRequestId::default(),
            wanted: Wanted {
                joints: Vec::new(),
                points: Vec::new(),
                path: Vec::new(),
                end: Vec::new(),
                patience: 0.0,
            },
            serial: 1,
            since: Instant::now(),
            command: None,
            accepted: Time::from_nanos(5_000_000_000),
            dropped: None,
            doomed: false,
            phase,
        }
    }

    /// A request for a result waits until the goal is over; the last results are kept, and their
    /// number is limited.
    #[test]
    fn results_wait_and_are_kept() {
        let mut goals = Goals::default();
        let first = GoalId::new_random();
        let request = RmwRequestId {
            sequence_number: 7,
            ..RmwRequestId::default()
        };
        let unknown = goals.result(request, first).unwrap();
        assert_eq!(unknown.status, GoalStatusEnum::Unknown);
        goals.active = Some(active(first, Phase::Moving));
        assert!(goals.result(request, first).is_none());
        let outcome = Outcome {
            error_code: -4,
            error_string: "x".to_owned(),
        };
        let served = goals.finish(GoalStatusEnum::Aborted, outcome.clone());
        assert_eq!(served, [request]);
        assert_eq!(goals.result(request, first).unwrap().outcome, outcome);
        for _ in 0..100 {
            goals.active = Some(active(GoalId::new_random(), Phase::Moving));
            goals.finish(GoalStatusEnum::Succeeded, Outcome::default());
        }
        assert_eq!(goals.statuses().len(), KEPT);
        assert!(!goals.knows(first));
    }

    /// A request to cancel means a goal by its name, all until a time, or all.
    #[test]
    fn cancel_names_a_goal_or_a_time() {
        let mut goals = Goals::default();
        let id = GoalId::new_random();
        let ask = |goals: &Goals, goal_id: GoalId, ns: i64| {
            goals.cancel(&GoalInfo {
                goal_id,
                stamp: Time::from_nanos(ns),
            })
        };
        assert_eq!(ask(&goals, GoalId::ZERO, 0), Cancel::Unknown);
        goals.active = Some(active(id, Phase::Checking));
        assert_eq!(ask(&goals, id, 0), Cancel::Unknown);
        goals.active = Some(active(id, Phase::Moving));
        assert_eq!(ask(&goals, id, 0), Cancel::Active);
        assert_eq!(ask(&goals, GoalId::ZERO, 0), Cancel::Active);
        assert_eq!(ask(&goals, GoalId::ZERO, 6_000_000_000), Cancel::Active);
        assert_eq!(ask(&goals, GoalId::ZERO, 4_000_000_000), Cancel::Unknown);
        assert_eq!(ask(&goals, GoalId::new_random(), 0), Cancel::Unknown);
        goals.finish(GoalStatusEnum::Canceled, Outcome::default());
        assert_eq!(ask(&goals, id, 0), Cancel::Over);
    }

    /// The field of a request to cancel that the crate does not show is read.
    #[test]
    fn a_request_to_cancel_is_read() {
        let info = GoalInfo {
            goal_id: GoalId::new_random(),
            stamp: Time::from_nanos(1_500_000_000),
        };
        let data = serde_json::json!({ "goal_info": serde_json::to_value(&info).unwrap() });
        let request: CancelGoalRequest = serde_json::from_value(data).unwrap();
        let read = wanted(&request).unwrap();
        assert_eq!((read.goal_id, read.stamp), (info.goal_id, info.stamp));
    }
}
