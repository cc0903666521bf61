"""Messages, services and actions of ROS 2 as types of Cyclone DDS, as rmw_cyclonedds maps them.

A service of rmw_cyclonedds carries in front of request and response the second half of the client's
GUID and a sequence number.
"""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, int8, int32, int64, sequence, uint8, uint16, uint32, uint64


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces::msg::dds_::Duration_"):
    sec: int32 = 0
    nanosec: uint32 = 0

    @staticmethod
    def of(seconds: float) -> "Duration":
        whole = int(seconds // 1)
        return Duration(whole, round((seconds - whole) * 1e9))

    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str = ""


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float]
    velocity: sequence[float]
    effort: sequence[float]


@dataclass
class Log(IdlStruct, typename="rcl_interfaces::msg::dds_::Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


@dataclass
class Point(IdlStruct, typename="trajectory_msgs::msg::dds_::JointTrajectoryPoint_"):
    positions: sequence[float] = field(default_factory=list)
    velocities: sequence[float] = field(default_factory=list)
    accelerations: sequence[float] = field(default_factory=list)
    effort: sequence[float] = field(default_factory=list)
    time_from_start: Duration = field(default_factory=Duration)


@dataclass
class Trajectory(IdlStruct, typename="trajectory_msgs::msg::dds_::JointTrajectory_"):
    header: Header = field(default_factory=Header)
    joint_names: sequence[str] = field(default_factory=list)
    points: sequence[Point] = field(default_factory=list)


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
class MultiPoint(IdlStruct, typename="trajectory_msgs::msg::dds_::MultiDOFJointTrajectoryPoint_"):
    transforms: sequence[Transform] = field(default_factory=list)
    velocities: sequence[Twist] = field(default_factory=list)
    accelerations: sequence[Twist] = field(default_factory=list)
    time_from_start: Duration = field(default_factory=Duration)


@dataclass
class MultiTrajectory(IdlStruct, typename="trajectory_msgs::msg::dds_::MultiDOFJointTrajectory_"):
    header: Header = field(default_factory=Header)
    joint_names: sequence[str] = field(default_factory=list)
    points: sequence[MultiPoint] = field(default_factory=list)


@dataclass
class Tolerance(IdlStruct, typename="control_msgs::msg::dds_::JointTolerance_"):
    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass
class ComponentTolerance(IdlStruct, typename="control_msgs::msg::dds_::JointComponentTolerance_"):
    joint_name: str = ""
    component: uint16 = 0
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass
class Goal(IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_Goal_"):
    trajectory: Trajectory = field(default_factory=Trajectory)
    multi_dof_trajectory: MultiTrajectory = field(default_factory=MultiTrajectory)
    path_tolerance: sequence[Tolerance] = field(default_factory=list)
    component_path_tolerance: sequence[ComponentTolerance] = field(default_factory=list)
    goal_tolerance: sequence[Tolerance] = field(default_factory=list)
    component_goal_tolerance: sequence[ComponentTolerance] = field(default_factory=list)
    goal_time_tolerance: Duration = field(default_factory=Duration)


@dataclass
class Result(IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_Result_"):
    error_code: int32 = 0
    error_string: str = ""


@dataclass
class FeedbackMessage(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_FeedbackMessage_"
):
    goal_id: array[uint8, 16]
    header: Header
    joint_names: sequence[str]
    desired: Point
    actual: Point
    error: Point
    multi_dof_joint_names: sequence[str]
    multi_dof_desired: MultiPoint
    multi_dof_actual: MultiPoint
    multi_dof_error: MultiPoint


@dataclass
class KiltedFeedbackMessage(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_FeedbackMessage_"
):
    goal_id: array[uint8, 16]
    header: Header
    joint_names: sequence[str]
    desired: Point
    actual: Point
    error: Point
    index: int32
    multi_dof_joint_names: sequence[str]
    multi_dof_desired: MultiPoint
    multi_dof_actual: MultiPoint
    multi_dof_error: MultiPoint
    multi_dof_index: int32


@dataclass
class SendGoalRequest(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_SendGoal_Request_"
):
    client: uint64
    number: int64
    goal_id: array[uint8, 16]
    goal: Goal


@dataclass
class SendGoalResponse(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_SendGoal_Response_"
):
    client: uint64
    number: int64
    accepted: bool
    stamp: Time


@dataclass
class GetResultRequest(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_GetResult_Request_"
):
    client: uint64
    number: int64
    goal_id: array[uint8, 16]


@dataclass
class GetResultResponse(
    IdlStruct, typename="control_msgs::action::dds_::FollowJointTrajectory_GetResult_Response_"
):
    client: uint64
    number: int64
    status: int8
    result: Result


@dataclass
class GoalInfo(IdlStruct, typename="action_msgs::msg::dds_::GoalInfo_"):
    goal_id: array[uint8, 16]
    stamp: Time


@dataclass
class GoalStatus(IdlStruct, typename="action_msgs::msg::dds_::GoalStatus_"):
    goal_info: GoalInfo
    status: int8


@dataclass
class GoalStatusArray(IdlStruct, typename="action_msgs::msg::dds_::GoalStatusArray_"):
    status_list: sequence[GoalStatus]


@dataclass
class CancelRequest(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Request_"):
    client: uint64
    number: int64
    goal_info: GoalInfo


@dataclass
class CancelResponse(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Response_"):
    client: uint64
    number: int64
    return_code: int8
    goals_canceling: sequence[GoalInfo]


@dataclass
class TriggerRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    client: uint64
    number: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
class TriggerResponse(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    client: uint64
    number: int64
    success: bool
    message: str
