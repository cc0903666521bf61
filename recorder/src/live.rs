//! The messages of a recording, for viewers that look on while the arm moves.

use crate::topic::{self, TOPICS};
use crate::{Head, Sample, message};

/// A topic with the definition of its messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LiveChannel {
    /// Its name.
    pub topic: &'static str,
    /// Name of the type of its messages.
    pub schema: &'static str,
    /// Definition of that type, as `ros2msg`.
    pub definition: &'static str,
}

/// The topics that a running arm has: those of every period, those for viewers, and the robot.
#[must_use]
pub fn live_channels() -> Vec<LiveChannel> {
    let names = [
        topic::SETPOINT_TOPIC,
        topic::STATE_TOPIC,
        topic::JOINTS_TOPIC,
        topic::TF_TOPIC,
        topic::TOOL_TOPIC,
        topic::URDF_TOPIC,
    ];
    let all = TOPICS.iter().map(|topic| LiveChannel {
        topic: topic.name,
        schema: topic.schema.name,
        definition: topic.schema.text,
    });
    all.filter(|channel| names.contains(&channel.topic))
        .collect()
}

/// The messages of a period as ROS 2's CDR, each with its topic; with those that come 100 times a
/// second where `slow` is set.
#[must_use]
pub fn live_messages(head: &Head, sample: &Sample, slow: bool) -> Vec<(&'static str, Vec<u8>)> {
    let (time, joints) = (head.time_of(sample.tick), head.joints.len());
    let mut messages = vec![
        (
            topic::SETPOINT_TOPIC,
            message::setpoint(time, sample, joints),
        ),
        (topic::STATE_TOPIC, message::state(time, sample, joints)),
    ];
    if slow {
        messages.push((
            topic::JOINTS_TOPIC,
            message::joint_state(time, sample, head),
        ));
        messages.push((topic::TF_TOPIC, message::transforms(time, sample, head)));
        messages.push((topic::TOOL_TOPIC, message::tool(time, sample)));
    }
    messages
}

/// A text as a message of a topic of texts.
#[must_use]
pub fn live_text(text: &str) -> Vec<u8> {
    message::string(text)
}
