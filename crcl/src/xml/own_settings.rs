//! Poses that bring their own speeds, accelerations and tolerances.
//!
//! They hold for one move. A move through several poses is made within the smallest speed and
//! acceleration and the narrowest tolerance that any of them asks for, which is within those of all.

use super::data::{PoseSettings, PoseTolerance, Quantity, Waypoint};
use super::refusal::{Refusal, refusal};
use crate::command::Command;

/// The move with the settings of its poses around it.
pub(super) fn own_settings(
    waypoints: &[Waypoint],
    command: Command,
) -> Result<Vec<Command>, Refusal> {
    if waypoints.iter().all(|waypoint| waypoint.settings.is_none()) {
        return Ok(vec![command]);
    }
    let mut commands = vec![Command::SaveSettings];
    commands.extend(speeds(waypoints)?);
    if let Some((last, others)) = waypoints.split_last() {
        commands.extend(intermediate_tolerances(others)?);
        commands.extend(end_tolerances(last));
    }
    commands.push(command);
    commands.push(Command::RestoreSettings);
    Ok(commands)
}

fn speeds(waypoints: &[Waypoint]) -> Result<Vec<Command>, Refusal> {
    let mut commands = Vec::new();
    if let Some(speed) = smallest(waypoints, "TransSpeed", |own| own.trans_speed)? {
        commands.push(match speed {
            Quantity::Absolute(value) => Command::SetAbsoluteSpeed { value },
            Quantity::Relative(share) => Command::SetRelativeSpeed {
                percent: percent(share),
            },
        });
    }
    if let Some(speed) = smallest(waypoints, "RotSpeed", |own| own.rot_speed)? {
        commands.push(match speed {
            Quantity::Absolute(value) => Command::SetAbsoluteRotSpeed { value },
            Quantity::Relative(share) => Command::SetRelativeRotSpeed {
                percent: percent(share),
            },
        });
    }
    if let Some(accel) = smallest(waypoints, "TransAccel", |own| own.trans_accel)? {
        commands.push(match accel {
            Quantity::Absolute(value) => Command::SetAbsoluteAcceleration { value },
            Quantity::Relative(share) => Command::SetRelativeAcceleration {
                percent: percent(share),
            },
        });
    }
    if let Some(accel) = smallest(waypoints, "RotAccel", |own| own.rot_accel)? {
        commands.push(match accel {
            Quantity::Absolute(value) => Command::SetAbsoluteRotAccel { value },
            Quantity::Relative(share) => Command::SetRelativeRotAccel {
                percent: percent(share),
            },
        });
    }
    Ok(commands)
}

/// The smallest of a quantity that all poses have, or none has.
fn smallest(
    waypoints: &[Waypoint],
    element: &'static str,
    of: impl Fn(&PoseSettings) -> Option<Quantity>,
) -> Result<Option<Quantity>, Refusal> {
    let own = |waypoint: &Waypoint| waypoint.settings.as_ref().and_then(&of);
    let given: Vec<_> = waypoints.iter().filter_map(own).collect();
    let Some(first) = given.first().copied() else {
        return Ok(None);
    };
    if given.len() < waypoints.len() {
        return Err(mixed(element));
    }
    let least = given
        .into_iter()
        .try_fold(first, |least, other| match (least, other) {
            (Quantity::Absolute(a), Quantity::Absolute(b)) => Some(Quantity::Absolute(a.min(b))),
            (Quantity::Relative(a), Quantity::Relative(b)) => Some(Quantity::Relative(a.min(b))),
            _ => None,
        });
    let message = format!("`{element}` of one move partly absolute and partly relative");
    least.map(Some).ok_or_else(|| refusal(element, message))
}

/// The narrowest tolerances of the poses that are passed, where all have one.
fn intermediate_tolerances(others: &[Waypoint]) -> Result<Vec<Command>, Refusal> {
    let tolerances = others.iter().map(|waypoint| {
        let own = waypoint.settings.as_ref()?;
        own.tolerance
    });
    let given: Vec<_> = tolerances.flatten().collect();
    if given.is_empty() {
        return Ok(Vec::new());
    }
    if given.len() < others.len() {
        return Err(mixed("Tolerance"));
    }
    let ball = given.iter().filter_map(|each| each.ball()).reduce(f64::min);
    let angle = given
        .iter()
        .filter_map(|each| each.angle())
        .reduce(f64::min);
    let ball = ball.map(|tolerance| Command::SetIntermediatePointTolerance { tolerance });
    let angle = angle.map(|tolerance| Command::SetIntermediateAngleTolerance { tolerance });
    Ok(ball.into_iter().chain(angle).collect())
}

fn end_tolerances(last: &Waypoint) -> Vec<Command> {
    let tolerance = last.settings.as_ref().and_then(|own| own.tolerance);
    tolerance.map_or_else(Vec::new, |tolerance| end_tolerance(&tolerance))
}

fn mixed(element: &'static str) -> Refusal {
    let message =
        format!("some poses of one move with `{element}` of their own and others without");
    Refusal {
        help: Some("give it to every pose of the move, or to none"),
        ..refusal(element, message)
    }
}

/// A box becomes the ball inside it; what is free stays as it was set before, which is nearer.
pub(super) fn end_tolerance(tolerance: &PoseTolerance) -> Vec<Command> {
    let point = tolerance.ball();
    let angle = tolerance.angle();
    let point = point.map(|tolerance| Command::SetEndPointTolerance { tolerance });
    let angle = angle.map(|tolerance| Command::SetEndAngleTolerance { tolerance });
    point.into_iter().chain(angle).collect()
}

/// The percentage whose hundredth is the share.
pub(super) fn percent(share: f64) -> f64 {
    let percent = share * 100.0;
    // 0.07 is 7 percent, not 7.000000000000001.
    let short = format!("{percent:.13e}").parse().unwrap_or(percent);
    if short / 100.0 == share {
        short
    } else {
        percent
    }
}
