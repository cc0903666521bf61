//! Poses that bring their own speeds, accelerations and tolerances.

use super::data::{PoseSettings, PoseTolerance, Quantity, Waypoint};
use crate::command::Command;
use crate::pose_and_set::PoseAndSet;

/// A move to one pose, with the settings of the pose around it.
pub(super) fn own_settings(waypoint: &Waypoint, command: Command) -> Vec<Command> {
    let Some(own) = &waypoint.settings else {
        return vec![command];
    };
    let speeds = pose_and_set(waypoint);
    let without = PoseAndSet {
        tolerance: None,
        angle_tolerance: None,
        ..speeds
    };
    let mut commands = vec![Command::SaveSettings];
    commands.extend(without.settings());
    commands.extend(own.tolerance.iter().flat_map(end_tolerance));
    commands.push(command);
    commands.push(Command::RestoreSettings);
    commands
}

/// A move near all poses but the last.
pub(super) fn through(waypoints: &[Waypoint]) -> Command {
    if waypoints.iter().all(|waypoint| waypoint.settings.is_none()) {
        let poses = waypoints.iter().map(|waypoint| waypoint.pose).collect();
        return Command::MoveSmoothlyTo { poses };
    }
    Command::MoveThroughWaypoints {
        waypoints: waypoints.iter().map(pose_and_set).collect(),
    }
}

fn pose_and_set(waypoint: &Waypoint) -> PoseAndSet {
    let mut found = PoseAndSet::from(waypoint.pose);
    let own = waypoint.settings.unwrap_or_default();
    let absolute = |quantity: Option<Quantity>| match quantity {
        Some(Quantity::Absolute(value)) => Some(value),
        _ => None,
    };
    let relative = |quantity: Option<Quantity>| match quantity {
        Some(Quantity::Relative(share)) => Some(percent(share)),
        _ => None,
    };
    found.speed = absolute(own.trans_speed);
    found.relative_speed = relative(own.trans_speed);
    found.acceleration = absolute(own.trans_accel);
    found.relative_acceleration = relative(own.trans_accel);
    found.rot_speed = absolute(own.rot_speed);
    found.relative_rot_speed = relative(own.rot_speed);
    found.rot_accel = absolute(own.rot_accel);
    found.relative_rot_accel = relative(own.rot_accel);
    found.tolerance = own.tolerance.and_then(|tolerance| tolerance.ball());
    found.angle_tolerance = own.tolerance.and_then(|tolerance| tolerance.angle());
    found
}

/// The same in XML.
pub(super) fn settings_of(waypoint: &PoseAndSet) -> Option<PoseSettings> {
    let quantity = |absolute: Option<f64>, relative: Option<f64>| {
        let share = relative.map(|percent| Quantity::Relative(percent / 100.0));
        share.or(absolute.map(Quantity::Absolute))
    };
    let PoseAndSet {
        tolerance: ball,
        angle_tolerance: angle,
        ..
    } = *waypoint;
    let told = waypoint.values().iter().any(Option::is_some);
    told.then(|| PoseSettings {
        coordinated: true,
        trans_speed: quantity(waypoint.speed, waypoint.relative_speed),
        rot_speed: quantity(waypoint.rot_speed, waypoint.relative_rot_speed),
        trans_accel: quantity(waypoint.acceleration, waypoint.relative_acceleration),
        rot_accel: quantity(waypoint.rot_accel, waypoint.relative_rot_accel),
        tolerance: (ball.is_some() || angle.is_some()).then_some(PoseTolerance {
            x: ball,
            y: ball,
            z: ball,
            x_axis: angle,
            z_axis: angle,
        }),
    })
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
