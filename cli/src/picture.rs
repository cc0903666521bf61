use planner::dry_run::{Plan, PlanSample, PlannedCommand};
use planner::robot::Robot;

use crate::plot::{Drawing, PlotRow, Span, Target};

/// Number of states of the curves: two per pixel.
const STATES: f64 = 1500.0;

/// A planned program as a drawing.
pub(crate) fn drawing(robot: &Robot, plan: &Plan, program: &str) -> Drawing {
    let period = (plan.duration_s / STATES).max(1e-4);
    Drawing {
        title: format!("{} on {}", file_name(program), plan.robot),
        subtitle: subtitle(plan),
        joints: robot
            .model
            .joints
            .iter()
            .map(|joint| joint.name.clone())
            .collect(),
        spans: plan
            .commands
            .iter()
            .filter(|command| command.duration_s > 0.0)
            .map(span)
            .collect(),
        rows: plan
            .samples(period)
            .map(|sample| row(robot, &sample))
            .collect(),
        targets: plan.commands.iter().flat_map(targets).collect(),
    }
}

fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn subtitle(plan: &Plan) -> String {
    let moves = plan
        .commands
        .iter()
        .filter(|command| command.certificate.is_some())
        .count();
    let peak = plan
        .commands
        .iter()
        .filter_map(|command| command.certificate.as_ref())
        .map(|certificate| certificate.peaks.largest())
        .fold(0.0, f64::max);
    format!(
        "{:.3} s \u{b7} {} commands, {moves} of them moves \u{b7} planned in {:.0} ms \u{b7} \
         largest use of a limit {:.1} %",
        plan.duration_s,
        plan.commands.len(),
        plan.planning_s * 1e3,
        peak * 100.0
    )
}

fn span(command: &PlannedCommand) -> Span {
    let end = command.start_s + command.duration_s;
    Span {
        label: format!(
            "line {}: {}, {:.3} s to {end:.3} s",
            command.line, command.name, command.start_s
        ),
        name: command.name.to_owned(),
        start: command.start_s,
        end,
        moving: command.certificate.is_some(),
    }
}

fn row(robot: &Robot, sample: &PlanSample) -> PlotRow {
    let limits = &robot.joints;
    let part = |values: &[f64], of: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(of)
            .map(|(value, limit)| value / limit)
            .collect()
    };
    let position = sample.q.iter().zip(limits.lower.iter().zip(&limits.upper));
    let position = position
        .map(|(q, (lower, upper))| within(*q, *lower, *upper))
        .collect();
    let place = sample.workstation_from_tool.translation;
    PlotRow {
        time: sample.t_s,
        ratios: [
            position,
            part(&sample.dq, &limits.velocity),
            part(&sample.ddq, &limits.acceleration),
            part(&sample.dddq, &limits.jerk),
        ],
        point: [place.x, place.y, place.z],
    }
}

/// -1 at the lower limit, 1 at the upper; a joint without limits is shown over two turns.
fn within(q: f64, lower: f64, upper: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let (lower, upper) = if (upper - lower).is_finite() {
        (lower, upper)
    } else {
        (-turn, turn)
    };
    (2.0 * q - lower - upper) / (upper - lower)
}

/// The poses of a move: balls for the intermediate ones, a dot for the last.
fn targets(command: &PlannedCommand) -> Vec<Target> {
    let last = command.poses.len().saturating_sub(1);
    let tolerance = |index: usize| {
        let certificate = command.certificate.as_ref()?;
        (index < last).then(|| {
            certificate
                .poses
                .get(index)
                .map_or(0.0, |pass| pass.tolerance_m)
        })
    };
    let target = |(index, pose): (usize, &nalgebra::Isometry3<f64>)| Target {
        point: pose.translation.vector.into(),
        tolerance: tolerance(index),
    };
    command.poses.iter().enumerate().map(target).collect()
}
