//! A robot as the page needs it.

use nalgebra::Isometry3;
use planner::robot::Robot;
use serde_json::{Value, json};

use crate::forward::forward;
use crate::reach::reach;

/// x, y, z (m), qw, qx, qy, qz.
pub(crate) fn list(pose: &Isometry3<f64>) -> [f64; 7] {
    let (place, turn) = (pose.translation, pose.rotation);
    [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
}

/// What the page draws and what its plots are parts of.
pub(crate) fn robot(robot: &Robot, arm: &str, period_ns: u64) -> Value {
    let finite = |list: &[f64]| -> Vec<Option<f64>> {
        list.iter()
            .map(|value| value.is_finite().then_some(*value))
            .collect()
    };
    let joints = &robot.joints;
    let mounted = robot
        .mounted
        .and_then(|index| robot.end_effectors.get(index));
    json!({
        "name": robot.name,
        "description": robot.description,
        "arm": arm,
        "period_s": period_ns as f64 * 1e-9,
        "urdf": robot.urdf,
        "base_link": robot.model.base_link,
        "tip_link": robot.model.tip_link,
        "joints": robot.joint_names(),
        "slides": robot.sliding(),
        "reach": forward(robot).ok().map(|point| reach(robot, &point)),
        "lower": finite(&joints.lower),
        "upper": finite(&joints.upper),
        "velocity": joints.velocity,
        "acceleration": joints.acceleration,
        "jerk": joints.jerk,
        "tool": {
            "speed": robot.tool.speed,
            "acceleration": robot.tool.acceleration,
            "jerk": robot.tool.jerk,
        },
        "home": robot.home,
        "workstation_from_base": list(&robot.workstation_from_base),
        "flange_from_tool": mounted.map(|tool| list(&tool.flange_from_tcp)),
        "end_effector": mounted.map(|tool| &tool.name),
    })
}
