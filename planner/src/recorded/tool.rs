//! Rules for the controlled point: pose columns, speed, acceleration and jerk.

use nalgebra::Isometry3;
use trajectory::ToolLimits;

use super::arm::{ToolState, angle_between};
use super::finding::{Measure, RuleReport, Subject};
use super::joints::ALLOWED;
use super::row::RecordedSample;
use super::rule::Rule;
use super::span::{Recording, Span};

/// Largest distance (m) and angle (rad) of a recorded pose from that of the recorded joints.
const POSE: (f64, f64) = (1e-9, 1e-8);

/// The pose columns are those of the joint columns. While the tool changes, the controlled point
/// may be that of either tool; a run shows the next tools at rest, after the move before.
pub(super) fn pose(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    for row in &recording.rows[span.own.clone()] {
        let flange = recording.arm.flange(&row.joints);
        let off = |tool: &Isometry3<f64>| {
            let pose = flange * tool;
            let way = (pose.translation.vector - row.pose.translation.vector).norm();
            (way, angle_between(&pose.rotation, &row.pose.rotation))
        };
        let (mut way, mut turn) = off(&span.tools[1]);
        let rests = row.rests();
        let allowed = span.tools[..1]
            .iter()
            .chain(span.later_tools.iter().filter(|_| rests));
        for tool in allowed {
            let (other_way, other_turn) = off(tool);
            if other_way + other_turn < way + turn {
                (way, turn) = (other_way, other_turn);
            }
        }
        let subject = Subject::The("the distance of the recorded point from that of the joints");
        let measure = Measure::at_most(way, POSE.0, "m");
        report.hold(Rule::Pose, subject, row.t_s, measure);
        let subject = Subject::The("the angle of the recorded pose from that of the joints");
        let measure = Measure::at_most(turn, POSE.1, "rad");
        report.hold(Rule::Pose, subject, row.t_s, measure);
    }
}

/// States of the tool at the rows of a command and at the one before.
pub(super) fn states(recording: &Recording<'_>, span: &Span<'_>) -> Vec<ToolState> {
    let state = |row: &RecordedSample| {
        let columns = [&row.joints[..], &row.rates, &row.accelerations];
        recording.arm.tool(columns, &span.tools[1])
    };
    recording.rows[span.shown()].iter().map(state).collect()
}

const POINT: Subject = Subject::The("the controlled point");
const TOOL: Subject = Subject::The("the tool");

/// The limits of the tool, at every sample and between samples.
pub(super) fn caps(
    recording: &Recording<'_>,
    span: &Span<'_>,
    states: &[ToolState],
    limits: &ToolLimits,
    report: &mut RuleReport,
) {
    let shown = span.shown();
    for (offset, pair) in states.windows(2).enumerate() {
        let index = shown.start + offset + 1;
        let (row, before) = (&recording.rows[index], &recording.rows[index - 1]);
        let (from, to) = (&pair[0], &pair[1]);
        let mut hold = |rule, subject, value: f64, most: f64, unit| {
            // Velocities of 1e-10 and accelerations of 1e-8 are rounding.
            let measure = Measure::at_most(value, most * ALLOWED + 1e-8, unit);
            report.hold(rule, subject, row.t_s, measure);
        };
        let (speed, turning) = (to.velocity.norm(), to.angular_velocity.norm());
        hold(Rule::ToolSpeed, POINT, speed, limits.speed, "m/s");
        hold(
            Rule::AngularSpeed,
            TOOL,
            turning,
            limits.angular_speed,
            "rad/s",
        );
        if !at_full_speed(before, row) {
            continue;
        }
        let h = row.t_s - before.t_s;
        let jerk = (to.acceleration - from.acceleration).norm() / h;
        let angular = (to.angular_acceleration - from.angular_acceleration).norm() / h;
        let noise = 1e-7 / h;
        hold(Rule::ToolJerk, POINT, jerk, limits.jerk + noise, "m/s3");
        let most = limits.angular_jerk + noise;
        hold(Rule::AngularJerk, TOOL, angular, most, "rad/s3");
        let after = recording
            .rows
            .get(index + 1)
            .filter(|_| offset + 2 < states.len());
        if after.is_none_or(|after| at_full_speed(row, after)) {
            let acceleration = to.acceleration.norm();
            hold(
                Rule::ToolAcceleration,
                POINT,
                acceleration,
                limits.acceleration,
                "m/s2",
            );
            let angular = to.angular_acceleration.norm();
            let most = limits.angular_acceleration;
            hold(Rule::AngularAcceleration, TOOL, angular, most, "rad/s2");
        }
    }
}

/// Whether planned time and time pass equally between two rows; always true in a plan.
fn at_full_speed(from: &RecordedSample, to: &RecordedSample) -> bool {
    let (Some(a), Some(b)) = (&from.run, &to.run) else {
        return true;
    };
    let start = if from.command == to.command {
        a.path_time_s
    } else {
        0.0
    };
    let lag = (to.t_s - from.t_s) - (b.path_time_s - start);
    lag.abs() <= 1e-9 || to.rests()
}
