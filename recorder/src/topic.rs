//! The topics of a recording.

use crate::schema::{JOINT_STATE, LOG, PERIODS, POSE_STAMPED, SETPOINT, STATE, STRING, Schema, TF};

/// Every setpoint.
pub const SETPOINT_TOPIC: &str = "/canter/setpoint";
/// What was measured in every period.
pub const STATE_TOPIC: &str = "/canter/state";
/// The measured joints, 100 a second.
pub const JOINTS_TOPIC: &str = "/joint_states";
/// Base and controlled point in the workstation, 100 a second.
pub const TF_TOPIC: &str = "/tf";
/// The published pose of the controlled point in the workstation, 100 a second.
pub const TOOL_TOPIC: &str = "/canter/tool";
/// What happened, for people.
pub const LOG_TOPIC: &str = "/rosout";
/// What happened, as JSON.
pub const NOTE_TOPIC: &str = "/canter/note";
/// Counts of servo periods, one a second.
pub const PERIODS_TOPIC: &str = "/canter/periods";
/// The URDF.
pub const URDF_TOPIC: &str = "/robot_description";
/// What the recording is about: the JSON of [`crate::Head`].
pub const HEAD_TOPIC: &str = "/canter/head";
/// The robot's other file.
pub const ROBOT_TOPIC: &str = "/canter/robot";
/// Programs that were given, each as JSON with name, form, text and the number of its first command.
pub const PROGRAM_TOPIC: &str = "/canter/program";
/// What was proved of a program's moves: the JSON of its plan.
pub const CERTIFICATE_TOPIC: &str = "/canter/certificate";

/// A quality of service that keeps the last message for whoever comes late.
const LATCHED: &str = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  \
    deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    \
    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    \
    nsec: 854775807\n  avoid_ros_namespace_conventions: false\n";

/// A topic, its type and its quality of service.
pub(crate) struct Topic {
    pub(crate) name: &'static str,
    pub(crate) schema: Schema,
    pub(crate) quality: &'static str,
}

/// All topics.
pub(crate) const TOPICS: [Topic; 13] = [
    topic(SETPOINT_TOPIC, SETPOINT, ""),
    topic(STATE_TOPIC, STATE, ""),
    topic(JOINTS_TOPIC, JOINT_STATE, ""),
    topic(TF_TOPIC, TF, ""),
    topic(TOOL_TOPIC, POSE_STAMPED, ""),
    topic(LOG_TOPIC, LOG, ""),
    topic(NOTE_TOPIC, STRING, ""),
    topic(PERIODS_TOPIC, PERIODS, ""),
    topic(URDF_TOPIC, STRING, LATCHED),
    topic(HEAD_TOPIC, STRING, LATCHED),
    topic(ROBOT_TOPIC, STRING, LATCHED),
    topic(PROGRAM_TOPIC, STRING, LATCHED),
    topic(CERTIFICATE_TOPIC, STRING, LATCHED),
];

const fn topic(name: &'static str, schema: Schema, quality: &'static str) -> Topic {
    Topic {
        name,
        schema,
        quality,
    }
}
