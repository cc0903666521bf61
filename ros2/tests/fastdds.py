"""The bridge against eProsima Fast DDS, the library under ROS's own middleware: services as rmw_fastrtps
maps them, messages by rosbags. Needs `libfastrtps-dev` of Debian and a C++ compiler.

`CANTER_ROS2_GOALS` is the number of goals that are followed one after the other (default 4).
"""

import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
from golden import store
from rosbags.typesys import Stores, get_types_from_msg

HERE = Path(__file__).parent
DOMAIN = 91 + os.getpid() % 50
ACTION = "joint_trajectory_controller/follow_joint_trajectory/_action"
KIND = "control_msgs::action::dds_::FollowJointTrajectory_"
PATIENCE = 60.0
SUCCEEDED, CANCELED = 4, 5


def all_types():
    types = store(Stores.ROS2_JAZZY, False)
    for name, text in [
        ("GoalRequest", "uint8[16] goal_id\ncontrol_msgs/Goal goal\n"),
        ("GoalAnswer", "bool accepted\nbuiltin_interfaces/Time stamp\n"),
        ("ResultRequest", "uint8[16] goal_id\n"),
        ("ResultAnswer", "int8 status\ncontrol_msgs/Result result\n"),
        ("CancelRequest", "uint8[16] goal_id\nbuiltin_interfaces/Time stamp\n"),
        ("CancelAnswer", "int8 return_code\ncontrol_msgs/CancelRequest[] goals_canceling\n"),
        ("FeedbackMessage", "uint8[16] goal_id\ncontrol_msgs/Feedback feedback\n"),
        ("TriggerRequest", "uint8 structure_needs_at_least_one_member\n"),
    ]:
        types.register(get_types_from_msg(text, f"control_msgs/msg/{name}"))
    return types


TYPES = all_types()
SERVICES = {
    f"{ACTION}/send_goal": (f"{KIND}SendGoal", "GoalRequest", "GoalAnswer"),
    f"{ACTION}/get_result": (f"{KIND}GetResult", "ResultRequest", "ResultAnswer"),
    f"{ACTION}/cancel_goal": ("action_msgs::srv::dds_::CancelGoal", "CancelRequest", "CancelAnswer"),
    "canter/stop": ("std_srvs::srv::dds_::Trigger", "TriggerRequest", None),
}
TOPICS = {
    "rt/joint_states": ("sub", "sensor_msgs::msg::dds_::JointState_", "sensor_msgs/msg/JointState"),
    "rt/robot_description": ("late", "std_msgs::msg::dds_::String_", "std_msgs/msg/String"),
    "rt/rosout": ("sub", "rcl_interfaces::msg::dds_::Log_", "rcl_interfaces/msg/Log"),
    f"rt/{ACTION}/feedback": ("sub", f"{KIND}FeedbackMessage_", "control_msgs/msg/FeedbackMessage"),
}


class Peer:
    """The peer process, with what it got by name."""

    def __init__(self, program):
        ends = [f"cli:{name}:{kind}" for name, (kind, _, _) in SERVICES.items()]
        ends += [f"{how}:{name}:{kind}" for name, (how, kind, _) in TOPICS.items()]
        self.process = subprocess.Popen(
            [program, str(DOMAIN), *ends], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.got = {name: queue.Queue() for name in [*SERVICES, *TOPICS]}
        self.matched, self.sent = set(), queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            word, name, *rest = line.split()
            if word == "match":
                self.matched.add(name)
            elif word == "sent":
                self.sent.put(int(rest[0]))
            else:
                self.got[name].put((int(rest[0]), rest[1]))

    def wait_for_all(self):
        end = time.monotonic() + PATIENCE
        while self.matched != set(self.got):
            assert time.monotonic() < end, f"no match: {set(self.got) - self.matched}"
            time.sleep(0.01)
        # The other side may find us a moment later.
        time.sleep(1.0)

    def read(self, name, patience=PATIENCE):
        kind = TOPICS[name][2]
        return TYPES.deserialize_cdr(bytes.fromhex(self.got[name].get(timeout=patience)[1]), kind)

    def newest(self, name):
        while self.got[name].qsize() > 1:
            self.got[name].get()
        return self.read(name)

    def call(self, service, **fields):
        _, request, answer = SERVICES[service]
        kind = f"control_msgs/msg/{request}"
        message = TYPES.types[kind](**fields)
        self.process.stdin.write(f"{service} {bytes(TYPES.serialize_cdr(message, kind)).hex()}\n")
        self.process.stdin.flush()
        number = self.sent.get(timeout=PATIENCE)
        kind = f"control_msgs/msg/{answer}" if answer else "std_srvs/msg/TriggerResponse"
        while True:
            got, text = self.got[service].get(timeout=PATIENCE)
            if got == number:
                return TYPES.deserialize_cdr(bytes.fromhex(text), kind)

    def hear(self, words):
        end = time.monotonic() + 20
        while time.monotonic() < end:
            line = self.read("rt/rosout", 20).msg
            if words in line:
                return line
        raise AssertionError(f"{words!r} is not in the log")


def span(seconds):
    whole = int(seconds // 1)
    return TYPES.types["builtin_interfaces/msg/Duration"](whole, round((seconds - whole) * 1e9))


def bend(state, step, seconds, parts):
    """A goal: a smooth motion of all joints by `step` rad, from rest to rest."""
    kinds = TYPES.types
    header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](0, 0), "")
    start = np.array(state.position)
    points = []
    for part in range(parts + 1):
        x = part / parts
        way = x**3 * (10 - 15 * x + 6 * x * x)
        speed = x * x * (30 - 60 * x + 30 * x * x) / seconds
        rise = x * (60 - 180 * x + 120 * x * x) / seconds**2
        one = np.ones_like(start)
        points.append(
            kinds["trajectory_msgs/msg/JointTrajectoryPoint"](
                start + step * way, one * step * speed, one * step * rise, np.array([]), span(seconds * x)
            )
        )
    return kinds["control_msgs/msg/Goal"](
        trajectory=kinds["trajectory_msgs/msg/JointTrajectory"](header, list(state.name), points),
        multi_dof_trajectory=kinds["trajectory_msgs/msg/MultiDOFJointTrajectory"](header, [], []),
        path_tolerance=[],
        component_path_tolerance=[],
        goal_tolerance=[],
        component_goal_tolerance=[],
        goal_time_tolerance=span(0.0),
    )


def send(peer, goal):
    name = np.frombuffer(os.urandom(16), dtype=np.uint8)
    return name, peer.call(f"{ACTION}/send_goal", goal_id=name, goal=goal).accepted


def at_rest(peer):
    while True:
        state = peer.newest("rt/joint_states")
        if np.abs(state.velocity).max() < 1e-3:
            return state


def scenario(peer):
    text = peer.read("rt/robot_description").data
    assert text == Path("robots/ur5e/robot.urdf").read_text(), f"{len(text)} bytes"
    start = at_rest(peer)
    name, accepted = send(peer, bend(start, 0.3, 1.5, 12))
    assert accepted
    result = peer.call(f"{ACTION}/get_result", goal_id=name)
    assert (result.status, result.result.error_code) == (SUCCEEDED, 0), result
    end = at_rest(peer)
    assert np.abs(end.position - start.position - 0.3).max() < 2e-3
    feedback = peer.read(f"rt/{ACTION}/feedback")
    assert bytes(feedback.goal_id) == bytes(name) and len(feedback.feedback.actual.positions) == 6
    print("Fast DDS: followed")

    name, accepted = send(peer, bend(end, -0.6, 4.0, 20))
    assert accepted
    time.sleep(1.5)
    zero = TYPES.types["builtin_interfaces/msg/Time"](0, 0)
    answer = peer.call(f"{ACTION}/cancel_goal", goal_id=name, stamp=zero)
    assert answer.return_code == 0 and bytes(answer.goals_canceling[0].goal_id) == bytes(name)
    result = peer.call(f"{ACTION}/get_result", goal_id=name)
    assert (result.status, result.result.error_code) == (CANCELED, 0), result
    gone = at_rest(peer).position - end.position
    assert -0.59 < gone[0] < -0.05 and np.ptp(gone) < 2e-3, gone
    print(f"Fast DDS: canceled, {result.result.error_string}")

    _, accepted = send(peer, bend(at_rest(peer), 1.0, 0.3, 10))
    assert not accepted
    print("Fast DDS:", peer.hear("goal rejected"))
    assert peer.call("canter/stop", structure_needs_at_least_one_member=0).success
    count = int(os.environ.get("CANTER_ROS2_GOALS", "4"))
    for number in range(count):
        name, accepted = send(peer, bend(at_rest(peer), 0.05 if number % 2 else -0.05, 0.4, 4))
        assert accepted, number
        assert peer.call(f"{ACTION}/get_result", goal_id=name).status == SUCCEEDED
    print(f"Fast DDS: {count} goals in a row")


def main():
    program = str(Path(sys.argv[1]) / "fastdds_peer")
    source = str(HERE / "fastdds_peer.cpp")
    subprocess.run(["c++", "-std=c++17", source, "-o", program, "-lfastrtps", "-lfastcdr"], check=True)
    arm = f"fast{os.getpid()}/arm"
    canter, bridge = os.environ["CANTER_COMMAND"], os.environ["CANTER_ROS2_COMMAND"]
    started = []
    try:
        for command, words in [
            ([canter, "engine", "--robot", "ur5e", "--arm", arm], "engine of"),
            ([bridge, "--arm", arm, "--rmw", "fastdds", "--ros-domain", str(DOMAIN)], "serving ROS 2"),
        ]:
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            started.append(process)
            seen = ""
            for line in process.stderr:
                seen += line
                if words in line:
                    break
            assert words in seen, seen
            threading.Thread(target=process.stderr.read, daemon=True).start()
        peer = Peer(program)
        started.append(peer.process)
        peer.wait_for_all()
        scenario(peer)
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(20)


if __name__ == "__main__":
    main()
