//! The messages of ROS 2 that are used here, field by field as in their packages.
//!
//! # Source
//! `std_msgs`, `sensor_msgs`, `trajectory_msgs`, `control_msgs` and `std_srvs` of Humble, Jazzy and
//! Kilted; they differ in the feedback of `FollowJointTrajectory` alone.

use ros2_client::Message;
use ros2_client::builtin_interfaces::Time;
use serde::{Deserialize, Serialize, Serializer};

/// `builtin_interfaces/Duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Whole seconds.
    pub sec: i32,
    /// Nanoseconds beyond them, below 10⁹.
    pub nanosec: u32,
}

impl Span {
    /// A time in s, rounded to whole nanoseconds; what does not fit is cut.
    #[must_use]
    pub fn of(seconds: f64) -> Self {
        let whole = seconds.floor();
        let nanosec = ((seconds - whole) * 1e9).round();
        if nanosec >= 1e9 {
            return Self {
                sec: whole as i32 + 1,
                nanosec: 0,
            };
        }
        Self {
            sec: whole as i32,
            nanosec: nanosec as u32,
        }
    }

    /// The time in s.
    #[must_use]
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// Frame; empty for joints.
    pub frame_id: String,
}

/// `sensor_msgs/JointState`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointState {
    /// When the joints were measured.
    pub header: Header,
    /// Names of the joints.
    pub name: Vec<String>,
    /// Positions (rad, m).
    pub position: Vec<f64>,
    /// Velocities (rad/s, m/s); empty where they are not measured.
    pub velocity: Vec<f64>,
    /// Efforts (N m, N); empty where they are not measured.
    pub effort: Vec<f64>,
}
impl Message for JointState {}

/// `std_msgs/String`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Text {
    /// The text.
    pub data: String,
}
impl Message for Text {}

/// `trajectory_msgs/JointTrajectoryPoint`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Positions (rad, m).
    pub positions: Vec<f64>,
    /// Velocities (rad/s, m/s).
    pub velocities: Vec<f64>,
    /// Accelerations (rad/s², m/s²).
    pub accelerations: Vec<f64>,
    /// Efforts (N m, N).
    pub effort: Vec<f64>,
    /// Time after the start of the trajectory.
    pub time_from_start: Span,
}

/// `trajectory_msgs/JointTrajectory`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// When it begins; 0 for at once.
    pub header: Header,
    /// The order of the numbers in the points.
    pub joint_names: Vec<String>,
    /// The points.
    pub points: Vec<Point>,
}

/// `geometry_msgs/Transform`: translation x, y, z and rotation x, y, z, w.
pub type Transform = [f64; 7];

/// `geometry_msgs/Twist`: linear x, y, z and angular x, y, z.
pub type Twist = [f64; 6];

/// `trajectory_msgs/MultiDOFJointTrajectoryPoint`; an arm has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiPoint {
    /// Poses.
    pub transforms: Vec<Transform>,
    /// Velocities.
    pub velocities: Vec<Twist>,
    /// Accelerations.
    pub accelerations: Vec<Twist>,
    /// Time after the start of the trajectory.
    pub time_from_start: Span,
}

/// `trajectory_msgs/MultiDOFJointTrajectory`; an arm has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MultiTrajectory {
    /// When it begins.
    pub header: Header,
    /// Names of the joints.
    pub joint_names: Vec<String>,
    /// The points.
    pub points: Vec<MultiPoint>,
}

/// `control_msgs/JointTolerance`: 0 is not given, below 0 is no limit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// The joint.
    pub name: String,
    /// Of its position (rad, m).
    pub position: f64,
    /// Of its velocity (rad/s, m/s).
    pub velocity: f64,
    /// Of its acceleration (rad/s², m/s²).
    pub acceleration: f64,
}

/// `control_msgs/JointComponentTolerance`; an arm has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ComponentTolerance {
    /// The joint.
    pub joint_name: String,
    /// Which component.
    pub component: u16,
    /// Of its position.
    pub position: f64,
    /// Of its velocity.
    pub velocity: f64,
    /// Of its acceleration.
    pub acceleration: f64,
}

/// The goal of `control_msgs/FollowJointTrajectory`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// What to follow.
    pub trajectory: Trajectory,
    /// What an arm does not have.
    pub multi_dof_trajectory: MultiTrajectory,
    /// How far joints may be from the trajectory.
    pub path_tolerance: Vec<Tolerance>,
    /// What an arm does not have.
    pub component_path_tolerance: Vec<ComponentTolerance>,
    /// How near joints must be to the end.
    pub goal_tolerance: Vec<Tolerance>,
    /// What an arm does not have.
    pub component_goal_tolerance: Vec<ComponentTolerance>,
    /// How long they may take to be there.
    pub goal_time_tolerance: Span,
}
impl Message for Goal {}

/// The result of `control_msgs/FollowJointTrajectory`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// One of the codes of the action.
    pub error_code: i32,
    /// In words.
    pub error_string: String,
}
impl Message for Outcome {}

/// Codes of [`Outcome`].
impl Outcome {
    /// The trajectory was not followed.
    pub const PATH_TOLERANCE_VIOLATED: i32 = -4;
    /// The end was not reached in time.
    pub const GOAL_TOLERANCE_VIOLATED: i32 = -5;
}

/// The feedback of `control_msgs/FollowJointTrajectory`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Feedback {
    /// When.
    pub header: Header,
    /// Names of the joints.
    pub joint_names: Vec<String>,
    /// Where the joints should be.
    pub desired: Point,
    /// Where they are.
    pub actual: Point,
    /// The first less the second.
    pub error: Point,
    /// The point that is passed, from 0; sent since Kilted.
    pub index: Option<i32>,
}

impl Serialize for Feedback {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let joints = (
            &self.header,
            &self.joint_names,
            &self.desired,
            &self.actual,
            &self.error,
        );
        let none: [String; 0] = [];
        let multi = MultiPoint::default();
        let multi = (Vec::from(none), &multi, &multi, &multi);
        match self.index {
            None => (joints, multi).serialize(serializer),
            Some(index) => (joints, index, multi, 0_i32).serialize(serializer),
        }
    }
}
impl Message for Feedback {}

/// The request of `std_srvs/Trigger`. ROS sends one byte for a message without fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// Without a meaning.
    pub structure_needs_at_least_one_member: u8,
}
impl Message for TriggerRequest {}

/// The response of `std_srvs/Trigger`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether it was done.
    pub success: bool,
    /// What came of it.
    pub message: String,
}
impl Message for TriggerResponse {}
