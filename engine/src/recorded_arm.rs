//! What a recording tells of its arm, and how poses and events are written in it.

use std::time::{SystemTime, UNIX_EPOCH};

use nalgebra::Isometry3;
use planner::robot::Robot;
use recorder::Head;

/// The arm of a recording, at its first period.
#[derive(Clone, Debug)]
pub struct RecordedArm<'a> {
    /// The robot, with its own files.
    pub robot: &'a Robot,
    /// Name of the arm.
    pub arm: String,
    /// Name of its driver; empty where that is not known.
    pub driver: String,
    /// Length of a servo period (ns).
    pub period_ns: u64,
    /// The present servo period of the session.
    pub tick: u64,
    /// Joint positions at the start (rad, m).
    pub start: Vec<f64>,
    /// Unit of length until a program sets one, in one word.
    pub default_length: String,
}

impl RecordedArm<'_> {
    /// The head of a recording that begins now.
    #[must_use]
    pub fn head(self) -> Head {
        let robot = self.robot;
        let since_begin = self.tick.saturating_mul(self.period_ns);
        Head {
            form: recorder::FORM,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            arm: self.arm,
            robot: robot.name.clone(),
            driver: self.driver,
            joints: robot.joint_names(),
            root_link: robot.model.base_link.clone(),
            period_ns: self.period_ns,
            begin_ns: wall_ns().saturating_sub(since_begin),
            workstation_from_base: pose_numbers(&robot.workstation_from_base),
            start: self.start,
            default_length: self.default_length,
            reason: "record".to_owned(),
            urdf: robot.urdf.clone(),
            robot_toml: robot.toml.clone(),
        }
    }
}

/// The time of the day (ns since 1970).
pub(crate) fn wall_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as u64)
}

/// A pose as x, y, z (m), qw, qx, qy, qz.
///
/// ```
/// use engine::recorded_arm::pose_numbers;
/// let pose = nalgebra::Isometry3::translation(0.1, 0.2, 0.3);
/// assert_eq!(pose_numbers(&pose), [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]);
/// ```
#[must_use]
pub fn pose_numbers(pose: &Isometry3<f64>) -> [f64; 7] {
    let (place, turn) = (pose.translation, pose.rotation);
    [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k]
}

/// The log level of an event (the name that [`Note`](crate::session::Note) is serialised with), by
/// the levels of ROS 2: 40 error, 30 warning, 20 information.
#[must_use]
pub fn level(event: &str) -> u8 {
    match event {
        "faulted" => 40,
        "refused" | "aborted" | "stopped" => 30,
        _ => 20,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{Blame, Note};

    /// The names are those that notes have in JSON.
    #[test]
    fn levels_follow_the_names_of_notes() {
        let faulted = Note::Faulted {
            blame: Blame::Guard,
            reason: String::new(),
            tick: 1,
            dropped: 0,
        };
        let aborted = Note::Aborted { dropped: 0 };
        for (note, wanted) in [
            (faulted, 40),
            (aborted, 30),
            (Note::Stopped, 30),
            (Note::Recovered, 20),
        ] {
            let json = serde_json::to_value(&note).unwrap();
            assert_eq!(level(json["event"].as_str().unwrap()), wanted, "{json}");
        }
    }
}
