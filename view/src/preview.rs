//! A program, planned and not executed, as the page draws it.

use crcl::{CheckOptions, LengthUnit, ReadOptions, Source};
use planner::dry_run::{FailurePolicy, Plan, PlanOptions, plan_program};
use planner::robot::Robot;
use serde_json::{Value, json};

/// How many points of the path are drawn at most.
const POINTS: f64 = 20_000.0;

/// Least time between two points of the path (s).
const STEP_S: f64 = 0.01;

/// The same where the plots are drawn from them (s).
const FINE_STEP_S: f64 = 0.002;

/// What of the path a page gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Detail {
    /// What is drawn: points and joint positions.
    #[default]
    Picture,
    /// Velocities and accelerations as well: nothing moves, and the plots are those of the plan.
    Plots,
}

/// A program to plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draft {
    pub(crate) name: String,
    /// `text` or `json`.
    pub(crate) form: String,
    pub(crate) text: String,
    /// Joint positions at the start (rad, m); home without.
    pub(crate) start: Option<Vec<f64>>,
    /// `mm`, `m` or `inch`.
    pub(crate) default_length: String,
    pub(crate) rate_hz: f64,
    pub(crate) detail: Detail,
}

/// Reads, checks and plans a program: findings, times, certificates, the path.
pub(crate) fn preview(robot: &Robot, draft: &Draft) -> Value {
    let read = match draft.form.as_str() {
        "json" => crcl::json::read,
        _ => crcl::text::read,
    };
    let default_length = match draft.default_length.as_str() {
        "m" => LengthUnit::Meter,
        "inch" => LengthUnit::Inch,
        _ => LengthUnit::Millimeter,
    };
    let mut reading = read(&draft.text, &ReadOptions::default());
    if !reading.has_errors() {
        let options = CheckOptions {
            strict: false,
            default_length,
        };
        let more = crcl::check(&reading.program, &options);
        reading.findings.extend(more);
    }
    let source = Source::new(&draft.name, &draft.text);
    let findings = crcl::records(&reading.findings, &source);
    if reading.has_errors() {
        return json!({
            "is": "preview", "name": draft.name, "ok": false, "findings": findings,
        });
    }
    let options = PlanOptions {
        rate_hz: draft.rate_hz,
        default_length,
        on_refusal: FailurePolicy::Abort,
        start: draft.start.clone(),
        ..PlanOptions::default()
    };
    match plan_program(robot, &reading.program, &options) {
        Ok(plan) => json!({
            "is": "preview",
            "name": draft.name,
            "ok": plan.refusals.is_empty(),
            "findings": findings,
            "refusals": plan.refusals,
            "duration_s": plan.duration_s,
            "commands": commands(&plan),
            "path": path(&plan, draft.detail),
        }),
        Err(error) => json!({
            "is": "preview", "name": draft.name, "ok": false, "findings": findings,
            "error": error.to_string(),
        }),
    }
}

/// The commands with what was proved of them and the poses they are about.
fn commands(plan: &Plan) -> Vec<Value> {
    let as_value = |command: &planner::dry_run::PlannedCommand| {
        let poses: Vec<[f64; 3]> = command
            .poses
            .iter()
            .map(|pose| pose.translation.vector.into())
            .collect();
        json!({
            "index": command.index,
            "line": command.line,
            "name": command.name,
            "start_s": command.start_s,
            "duration_s": command.duration_s,
            "certificate": command.certificate,
            "poses": poses,
        })
    };
    plan.commands.iter().map(as_value).collect()
}

/// Points of the path with joints, at equal times.
fn path(plan: &Plan, detail: Detail) -> Value {
    let whole = detail == Detail::Plots;
    let step = if whole { FINE_STEP_S } else { STEP_S }.max(plan.duration_s / POINTS);
    let (mut points, mut commands) = (Vec::new(), Vec::new());
    let mut joints: [Vec<Vec<f64>>; 3] = Default::default();
    for sample in plan.samples(step) {
        let place = sample.workstation_from_tool.translation;
        points.push([place.x, place.y, place.z].map(rounded));
        commands.push(sample.command);
        let lists = [&sample.q, &sample.dq, &sample.ddq];
        for (to, from) in joints.iter_mut().zip(lists).take(if whole { 3 } else { 1 }) {
            to.push(from.iter().copied().map(rounded).collect());
        }
    }
    let [positions, velocities, accelerations] = joints;
    json!({
        "step_s": step, "points": points, "commands": commands, "joints": positions,
        "velocities": velocities, "accelerations": accelerations,
    })
}

/// To a tenth of a micrometre: it is for drawing.
fn rounded(value: f64) -> f64 {
    (value * 1e7).round() * 1e-7
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft(text: &str) -> Draft {
        Draft {
            name: "p".to_owned(),
            form: "text".to_owned(),
            text: text.to_owned(),
            rate_hz: 1000.0,
            ..Draft::default()
        }
    }

    #[test]
    fn a_program_is_previewed() {
        let robot = planner::robot::load("ur5e").unwrap();
        let text = include_str!("../../examples/pick_and_place.canon");
        let seen = preview(&robot, &draft(text));
        assert_eq!(seen["ok"], true, "{seen}");
        let points = seen["path"]["points"].as_array().unwrap();
        let seconds = seen["duration_s"].as_f64().unwrap();
        assert!((points.len() as f64 * 0.01 - seconds).abs() < 0.05);
        assert!(seen["path"]["velocities"].as_array().unwrap().is_empty());
        let whole = Draft {
            detail: Detail::Plots,
            ..draft(text)
        };
        let path = preview(&robot, &whole)["path"].clone();
        let count = |name: &str| path[name].as_array().unwrap().len();
        assert_eq!(count("accelerations"), count("points"));
        assert!((count("points") as f64 * FINE_STEP_S - seconds).abs() < 0.05);
        let commands = seen["commands"].as_array().unwrap();
        assert!(
            commands
                .iter()
                .any(|command| !command["certificate"].is_null())
        );
    }

    #[test]
    fn faults_have_their_place() {
        let robot = planner::robot::load("ur5e").unwrap();
        let seen = preview(&robot, &draft("InitCanon()\nMoveTo({{1, 2}})\n"));
        assert_eq!(seen["ok"], false);
        assert_eq!(seen["findings"][0]["line"], 2, "{seen}");
        let far = "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({{9000, 0, 0}, {0,0,-1}, {1,0,0}})\nEndCanon(0)\n";
        let seen = preview(&robot, &draft(far));
        assert_eq!(seen["ok"], false);
        assert_eq!(seen["refusals"][0]["line"], 3, "{seen}");
    }
}
