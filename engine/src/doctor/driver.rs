//! Checks whether the driver of an arm and the robot's description agree.

use core::time::Duration;

use ipc::{Arm, Clock, EngineLink, Hello, HelloAck, IpcError, text_of};

use super::{Check, Health};
use planner::robot::Robot;

/// Largest relative excess of a limit of the robot over the driver's: rounding of text.
const ROUNDING: f64 = 1e-6;

/// Opens a session with the driver, and ends it again.
pub(super) fn handshake(arm: &Arm, rate_hz: f64) -> (Check, Option<HelloAck>) {
    const NAME: &str = "driver handshake";
    let period = (1e9 / rate_hz) as u64;
    let greeted = EngineLink::open(arm).and_then(|link| {
        let joints = link.joints(Duration::from_secs(2))?;
        let hello = Hello::new(joints, period, 100_000_000.max(period), Clock::Wall);
        let times = [Duration::from_secs(2), ipc::READY];
        link.greet(&hello, times, |_| {})
    });
    match greeted {
        Ok(ack) => {
            let name = text_of(&ack.name);
            let seen = format!("{arm}: {name} of {} joints opened a session", ack.joints);
            (Check::new(NAME, Health::Ok, seen, ""), Some(ack))
        }
        Err(error) => {
            let remedy = match error {
                IpcError::Taken { .. } => format!("canter shutdown --arm {arm}"),
                IpcError::Refused { .. } => format!("canter driver test --arm {arm}"),
                _ => format!("canter driver sim --robot ROBOT --arm {arm}"),
            };
            (
                Check::new(NAME, Health::Fail, error.to_string(), &remedy),
                None,
            )
        }
    }
}

/// Whether the robot's acceleration and jerk limits have a source or are defaults.
pub(super) fn limits_known(robot: &Robot) -> Check {
    let joints = &robot.joints;
    let source = &joints.source;
    let default = source.to_lowercase().contains("default");
    let health = if default { Health::Warn } else { Health::Ok };
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let seen = format!(
        "{}: acceleration up to {} rad/s2, jerk up to {} rad/s3, source: {source}",
        robot.name,
        largest(&joints.acceleration),
        largest(&joints.jerk)
    );
    let remedy = format!(
        "canter robots show {}, then write what your arm can do, and its source, under [joints] \
         of robot.toml",
        robot.name
    );
    Check::new("robot limits", health, seen, &remedy)
}

/// Whether the driver's limits allow the limits of the robot's description.
pub(super) fn limits_agree(robot: &Robot, ack: &HelloAck) -> Check {
    const NAME: &str = "limits of robot and driver";
    let joints = &robot.joints;
    if robot.dof() != ack.joints as usize {
        let seen = format!(
            "{} has {} joints, the driver {}",
            robot.name,
            robot.dof(),
            ack.joints
        );
        let remedy = "use the robot that the driver moves: --robot";
        return Check::new(NAME, Health::Fail, seen, remedy);
    }
    let mut differences = Vec::new();
    for joint in 0..robot.dof() {
        let allowed = [
            (
                "speed",
                joints.velocity[joint],
                ack.velocity[joint],
                1.0_f64,
            ),
            ("upper end", joints.upper[joint], ack.upper[joint], 1.0),
            ("lower end", joints.lower[joint], ack.lower[joint], -1.0),
        ];
        for (what, robot, driver, sign) in allowed {
            if (robot - driver) * sign > ROUNDING * driver.abs().max(1.0) {
                differences.push(format!(
                    "joint {}: {what} {robot}, but the driver allows {driver}",
                    joint + 1
                ));
            }
        }
    }
    if differences.is_empty() {
        let seen = "the driver's limits are at least those of the robot".to_owned();
        return Check::new(NAME, Health::Ok, seen, "");
    }
    let remedy = "lower the limits in the robot's robot.urdf, or raise them in the driver";
    Check::new(NAME, Health::Warn, differences.join("; "), remedy)
}
