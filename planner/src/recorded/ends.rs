//! Rules: moves begin and end at rest, and end in their last pose.

use nalgebra::Isometry3;

use super::arm::angle_between;
use super::between::from_rest;
use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};
use super::verdict::PassFound;
use crate::task::Move;

/// Largest distance (m) and angle (rad) from the last pose.
pub(super) const ARRIVED: (f64, f64) = (1e-6, 1e-6);

/// At rest at the start of the recording.
pub(super) fn start(recording: &Recording<'_>, report: &mut RuleReport) {
    let Some(row) = recording.rows.first() else {
        return;
    };
    for joint in 0..recording.arm.dof() {
        let [_, speed, change, _] = recording.arm.unit(joint);
        let measures = [
            Measure::at_most(row.rates[joint].abs(), 1e-9, speed),
            Measure::at_most(row.accelerations[joint].abs(), 1e-9, change),
        ];
        for measure in measures {
            report.hold(Rule::Rest, Subject::Joint(joint), row.t_s, measure);
        }
    }
}

/// The last row of a move. The move ends before the next row, so here the joints may be as far from
/// rest and from the goal as they can still stop in until then. If the arm rests at the next row,
/// it rests at the goal.
pub(super) fn end(
    recording: &Recording<'_>,
    span: &Span<'_>,
    motion: &Move,
    report: &mut RuleReport,
) {
    let Some(goal) = motion.poses.last() else {
        return;
    };
    // A move without rows ends within a period after the row before it.
    let last = if span.own.is_empty() {
        span.own.start.saturating_sub(1)
    } else {
        span.own.end - 1
    };
    let row = &recording.rows[last];
    let left = recording.time_after(last);
    let arm = &recording.arm;
    for joint in 0..arm.dof() {
        let [_, speed, change] = from_rest(arm.limits, joint, left);
        let [_, speed_unit, change_unit, _] = arm.unit(joint);
        let measures = [
            Measure::at_most(row.rates[joint].abs(), speed + 1e-9, speed_unit),
            Measure::at_most(row.accelerations[joint].abs(), change + 1e-9, change_unit),
        ];
        for measure in measures {
            report.hold(Rule::Rest, Subject::Joint(joint), row.t_s, measure);
        }
    }
    let (way, turn) = if row.rests() && !span.own.is_empty() {
        (0.0, 0.0)
    } else {
        let levers = arm.levers(&span.tools[1]);
        arm.spread(&levers, |joint| from_rest(arm.limits, joint, left)[0])
    };
    let at_rest = span.rest_after.map(|index| (index, 0.0, 0.0));
    for (index, way, turn) in [Some((last, way, turn)), at_rest].into_iter().flatten() {
        let (off, turned) = off_goal(recording, span, index, goal);
        let time = recording.rows[index].t_s;
        let subject = Subject::The("the distance from the last pose");
        let measure = Measure::at_most(off, ARRIVED.0 + way, "m");
        report.hold(Rule::End, subject, time, measure);
        let subject = Subject::The("the angle from the last pose");
        let measure = Measure::at_most(turned, ARRIVED.1 + turn, "rad");
        report.hold(Rule::End, subject, time, measure);
    }
}

/// Distance (m) and angle (rad) of the controlled point at a row from a pose.
fn off_goal(
    recording: &Recording<'_>,
    span: &Span<'_>,
    row: usize,
    goal: &Isometry3<f64>,
) -> (f64, f64) {
    let pose = recording.arm.flange(&recording.rows[row].joints) * span.tools[1];
    let off = (goal.translation.vector - pose.translation.vector).norm();
    (off, angle_between(&goal.rotation, &pose.rotation))
}

/// The last pose of a move as a pass, at its last row.
pub(super) fn last_pass(
    recording: &Recording<'_>,
    span: &Span<'_>,
    motion: &Move,
) -> Option<PassFound> {
    let goal = motion.poses.last()?;
    let row = span.own.clone().last()?;
    let (off, turned) = off_goal(recording, span, row, goal);
    Some(PassFound {
        index: motion.poses.len(),
        deviation_m: off,
        tolerance_m: ARRIVED.0,
        time_s: recording.rows[row].t_s,
        within: off <= ARRIVED.0 && turned <= ARRIVED.1,
    })
}
