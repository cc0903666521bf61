"""Writes the golden messages of `ros2/tests/data` with rosbags, or, with `check`, compares them.

Each file is one message in CDR, little endian, as hexadecimal digits: what rosbags makes of the
definitions of ROS. `ros2/tests/messages.rs` reads and writes the same bytes.
"""

import sys
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DATA = Path(__file__).parent / "data"

TOLERANCE = "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
COMPONENT = "string joint_name\nuint16 component\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
GOAL = """trajectory_msgs/JointTrajectory trajectory
trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory
control_msgs/JointTolerance[] path_tolerance
control_msgs/JointComponentTolerance[] component_path_tolerance
control_msgs/JointTolerance[] goal_tolerance
control_msgs/JointComponentTolerance[] component_goal_tolerance
builtin_interfaces/Duration goal_time_tolerance
"""
RESULT = "int32 error_code\nstring error_string\n"
FEEDBACK = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error
{index}string[] multi_dof_joint_names
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error
{multi_index}"""


def store(which, kilted):
    types = get_typestore(which)
    index = ("int32 index\n", "int32 multi_dof_index\n") if kilted else ("", "")
    for name, text in [
        ("control_msgs/msg/JointTolerance", TOLERANCE),
        ("control_msgs/msg/JointComponentTolerance", COMPONENT),
        ("control_msgs/msg/Goal", GOAL),
        ("control_msgs/msg/Result", RESULT),
        ("control_msgs/msg/Feedback", FEEDBACK.format(index=index[0], multi_index=index[1])),
        ("std_srvs/msg/TriggerResponse", "bool success\nstring message\n"),
    ]:
        types.register(get_types_from_msg(text, name))
    return types


def messages(types, kilted):
    kind = types.types
    floats = lambda *values: np.array(values, dtype=np.float64)
    time = kind["builtin_interfaces/msg/Time"]
    span = kind["builtin_interfaces/msg/Duration"]
    header = kind["std_msgs/msg/Header"](stamp=time(sec=1700000000, nanosec=123456789), frame_id="")
    point = lambda first, at: kind["trajectory_msgs/msg/JointTrajectoryPoint"](
        positions=floats(first, 0.25),
        velocities=floats(0.5, -0.5),
        accelerations=floats(),
        effort=floats(),
        time_from_start=at,
    )
    multi = kind["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"](
        transforms=[], velocities=[], accelerations=[], time_from_start=span(sec=0, nanosec=0)
    )
    names = ["shoulder", "elbow_joint"]
    tolerance = kind["control_msgs/msg/JointTolerance"](
        name="elbow_joint", position=0.1, velocity=-1.0, acceleration=0.0
    )
    component = kind["control_msgs/msg/JointComponentTolerance"](
        joint_name="base", component=3, position=0.5, velocity=0.0, acceleration=0.0
    )
    goal = kind["control_msgs/msg/Goal"](
        trajectory=kind["trajectory_msgs/msg/JointTrajectory"](
            header=header,
            joint_names=names,
            points=[point(0.125, span(sec=0, nanosec=0)), point(-1.5, span(sec=2, nanosec=500000000))],
        ),
        multi_dof_trajectory=kind["trajectory_msgs/msg/MultiDOFJointTrajectory"](
            header=header, joint_names=[], points=[]
        ),
        path_tolerance=[tolerance],
        component_path_tolerance=[component],
        goal_tolerance=[tolerance, tolerance],
        component_goal_tolerance=[],
        goal_time_tolerance=span(sec=1, nanosec=0),
    )
    index = {"index": 3, "multi_dof_index": 0} if kilted else {}
    at = span(sec=0, nanosec=750000000)
    feedback = kind["control_msgs/msg/Feedback"](
        header=header,
        joint_names=names,
        desired=point(0.5, at),
        actual=point(0.25, at),
        error=point(0.25, at),
        multi_dof_joint_names=[],
        multi_dof_desired=multi,
        multi_dof_actual=multi,
        multi_dof_error=multi,
        **index,
    )
    state = kind["sensor_msgs/msg/JointState"](
        header=header, name=names, position=floats(0.5, -0.25), velocity=floats(1.0, 2.0), effort=floats()
    )
    return {
        "goal": ("control_msgs/msg/Goal", goal),
        "feedback": ("control_msgs/msg/Feedback", feedback),
        "result": ("control_msgs/msg/Result", kind["control_msgs/msg/Result"](error_code=-4, error_string="no")),
        "joint_state": ("sensor_msgs/msg/JointState", state),
        "string": ("std_msgs/msg/String", kind["std_msgs/msg/String"](data="<robot/>")),
        "trigger": (
            "std_srvs/msg/TriggerResponse",
            kind["std_srvs/msg/TriggerResponse"](success=True, message="rest"),
        ),
    }


def main(check):
    wrong = []
    for distribution, which, kilted in [
        ("humble", Stores.ROS2_HUMBLE, False),
        ("jazzy", Stores.ROS2_JAZZY, False),
        ("kilted", Stores.ROS2_KILTED, True),
    ]:
        types = store(which, kilted)
        for name, (kind, message) in messages(types, kilted).items():
            path = DATA / f"{distribution}_{name}.hex"
            text = bytes(types.serialize_cdr(message, kind)).hex() + "\n"
            if not check:
                path.write_text(text)
            elif path.read_text() != text:
                wrong.append(path.name)
    assert not wrong, f"rosbags makes other bytes of {wrong}"


if __name__ == "__main__":
    main("check" in sys.argv[1:])
