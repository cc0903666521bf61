"""The bridge against Cyclone DDS: a peer that knows DDS and the conventions of rmw_cyclonedds only.

`CANTER_ROS2_GOALS` is the number of goals that are followed one after the other (default 12).
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

import ros_types as ros
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros_peer import ABORTED, CANCELED, LATCHED, SUCCEEDED, Peer, Processes, bend, near, wait

DOMAIN = 40 + os.getpid() % 50
PROGRAM = "InitCanon()\nSetRelativeSpeed(50)\nDwell(0.2)\nMessage(\"hello\")\nEndCanon(0)\n"


def at_rest(peer):
    """The joints, once they rest."""

    def look():
        state = peer.joints()
        return state if max(map(abs, state.velocity)) < 1e-3 else None

    return wait("rest", look)


def joint_states(peer, urdf):
    """100 messages a second with the names of the joints and the time of the measurement."""
    peer.states.take(200)
    seen, end = [], time.monotonic() + 2.0
    while time.monotonic() < end:
        seen += peer.states.take(100)
        time.sleep(0.005)
    stamps = [state.header.stamp.sec + state.header.stamp.nanosec * 1e-9 for state in seen]
    assert all(a < b for a, b in zip(stamps, stamps[1:])), "stamps go back"
    rate = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    assert 90 < rate < 110, f"{rate} messages a second"
    assert abs(time.time() - stamps[-1]) < 0.5, "not the wall clock"
    names = seen[-1].name
    assert len(names) == 6 and all(f'"{name}"' in urdf for name in names), names
    assert len(seen[-1].position) == len(seen[-1].velocity) == 6
    print(f"joint_states: {rate:.1f} Hz, {names}")


def description(peer, urdf):
    """Who comes late gets the description."""
    topic = Topic(peer.participant, "rt/robot_description", ros.String)
    late = DataReader(peer.participant, topic, qos=LATCHED)
    text = wait("the description", lambda: late.take(1))[0].data
    assert text == urdf, f"{len(text)} bytes, {len(urdf)} expected"
    print(f"robot_description: {len(text)} bytes")


def followed(peer):
    """A goal is accepted, followed with feedback, and succeeds where it ends."""
    start = at_rest(peer)
    peer.feedback.take(100)
    goal = bend(start.position, 0.3, 1.5, 12, start.name)
    name, accepted = peer.send(goal)
    assert accepted, peer.said
    result = peer.result(name)
    assert (result.status, result.result.error_code) == (SUCCEEDED, 0), result
    end = [q + 0.3 for q in start.position]
    assert near(at_rest(peer).position, end), "not at the end"
    feedback = [message for message in peer.feedback.take(100) if list(message.goal_id) == name]
    assert len(feedback) >= 15, len(feedback)
    times = [message.desired.time_from_start.seconds() for message in feedback]
    assert times == sorted(times) and 0 <= times[0] < 0.3 and 1.2 < times[-1] <= 1.52, times
    for message in feedback:
        x = min(message.desired.time_from_start.seconds() / 1.5, 1)
        way = x**3 * (10 - 15 * x + 6 * x * x)
        wanted = [q + 0.3 * way for q in start.position]
        assert near(message.desired.positions, wanted, 1e-6), "not the trajectory"
        assert near(message.actual.positions, message.desired.positions, 0.05)
        errors = [d - a for d, a in zip(message.desired.positions, message.actual.positions)]
        assert near(message.error.positions, errors, 1e-12)
    statuses = wait("a status", lambda: peer.status.take(10))[-1].status_list
    mine = [entry.status for entry in statuses if list(entry.goal_info.goal_id) == name]
    assert mine == [SUCCEEDED], mine
    print(f"followed: {len(feedback)} feedbacks")


def canceled(peer):
    """A goal that is cancelled in the middle ends at rest on its path."""
    start = at_rest(peer)
    name, accepted = peer.send(bend(start.position, -0.6, 4.0, 20, start.name))
    assert accepted, peer.said
    time.sleep(1.5)
    asked = time.monotonic()
    answer = peer.cancel(name)
    assert answer.return_code == 0 and list(answer.goals_canceling[0].goal_id) == name, answer
    result = peer.result(name)
    took = time.monotonic() - asked
    assert (result.status, result.result.error_code) == (CANCELED, 0), result
    state = at_rest(peer)
    gone = [q - p for q, p in zip(state.position, start.position)]
    assert -0.59 < gone[0] < -0.05, gone
    assert max(gone) - min(gone) < 2e-3, f"off the path: {gone}"
    time.sleep(0.3)
    assert near(peer.joints().position, state.position, 1e-4), "it moves on"
    unknown = peer.cancel([7] * 16)
    assert unknown.return_code == 2 and not unknown.goals_canceling, unknown
    over = peer.cancel(name)
    assert over.return_code == 3, over
    print(f"canceled: at rest {took * 1e3:.0f} ms after the request, joints within {max(gone) - min(gone):.1e} rad")


def rejected(peer):
    """What cannot be followed is rejected with its reason before anything moves."""
    start = at_rest(peer)
    names = start.name

    def change(what):
        goal = bend(start.position, 0.3, 2.0, 10, list(names))
        what(goal)
        return goal

    def fast(goal):
        for point in goal.trajectory.points:
            seconds = point.time_from_start.seconds() / 8
            point.time_from_start = ros.Duration.of(seconds)
            point.velocities = [v * 8 for v in point.velocities]
            point.accelerations = [a * 64 for a in point.accelerations]

    def elsewhere(goal):
        for point in goal.trajectory.points:
            point.positions = [q + 0.05 for q in point.positions]

    def positions_only(goal):
        for point in goal.trajectory.points:
            point.velocities, point.accelerations = [], []

    def running_on(goal):
        goal.trajectory.points = goal.trajectory.points[:6]

    def other_names(goal):
        goal.trajectory.joint_names[2] = "knee_joint"

    def beyond(goal):
        goal.trajectory.points[5].positions[2] = 9.0

    reasons = [
        (fast, "times its limit"),
        (elsewhere, "away from where the arm stands"),
        (positions_only, "positions only"),
        (running_on, "begins and ends at rest"),
        (other_names, "no joint \"knee_joint\""),
        (beyond, "beyond its limit"),
    ]
    for what, words in reasons:
        _, accepted = peer.send(change(what))
        assert not accepted, words
        print(peer.hear(words, "goal rejected"))
    busy, accepted = peer.send(bend(start.position, 0.1, 1.0, 5, names))
    assert accepted
    _, second = peer.send(bend(start.position, 0.1, 1.0, 5, names))
    assert not second
    peer.hear("executing something else")
    assert peer.result(busy).status == SUCCEEDED
    back = at_rest(peer)
    moved = [q - p for q, p in zip(back.position, start.position)]
    assert near(moved, [0.1] * 6), moved


def tolerances(peer):
    """A joint that leaves its tolerance ends the goal at rest, and is named."""
    start = at_rest(peer)
    goal = bend(start.position, 0.5, 3.0, 10, start.name)
    goal.path_tolerance = [ros.Tolerance(start.name[1], 1e-7, 0.0, 0.0)]
    result = peer.follow(goal)
    assert (result.status, result.result.error_code) == (ABORTED, -4), result
    assert f"position of {start.name[1]}" in result.result.error_string, result
    # At once after a stop: the note of the stop comes when the next goal is being checked.
    goal = bend(peer.joints().position, 0.1, 1.0, 5, start.name)
    goal.goal_tolerance = [ros.Tolerance(name, 0.01, 0.1, 0.0) for name in start.name]
    result = peer.follow(goal)
    assert (result.status, result.result.error_code) == (SUCCEEDED, 0), result
    print("tolerances: kept and violated")


def stopped(peer):
    """The service stop ends a goal at rest on its path."""
    start = at_rest(peer)
    name, accepted = peer.send(bend(start.position, -0.4, 3.0, 10, start.name))
    assert accepted
    time.sleep(1.0)
    answer = peer.stop.call(0)
    assert answer.success, answer
    result = peer.result(name)
    assert (result.status, result.result.error_code) == (ABORTED, -4), result
    gone = [q - p for q, p in zip(at_rest(peer).position, start.position)]
    assert max(gone) - min(gone) < 2e-3, gone
    print(f"stopped: {answer.message}; {result.result.error_string}")


def held(peer, processes):
    """An operator's stop outlives the service stop: nothing moves until the operator resumes."""
    start = at_rest(peer)
    name, accepted = peer.send(bend(start.position, 0.4, 3.0, 10, start.name))
    assert accepted
    time.sleep(1.0)
    assert processes.run("stop").returncode == 0
    rest = at_rest(peer).position
    _, accepted = peer.send(bend(rest, 0.1, 1.0, 5, start.name))
    assert not accepted, peer.said
    peer.hear("a pause or stop holds the arm")
    answer = peer.stop.call(0)
    assert answer.success, answer
    result = peer.result(name)
    assert (result.status, result.result.error_code) == (ABORTED, -4), result
    rest = at_rest(peer).position
    _, accepted = peer.send(bend(rest, 0.1, 1.0, 5, start.name))
    assert not accepted, peer.said
    time.sleep(1.0)
    assert near(peer.joints().position, rest, 1e-4), "it moves although the operator stopped it"
    assert processes.run("resume").returncode == 0
    result = peer.follow(bend(at_rest(peer).position, 0.1, 1.0, 5, start.name))
    assert result.status == SUCCEEDED, result
    print("held: nothing moves until the operator resumes")


def program(peer):
    """A program that the operator has named is started by its service and answered at its end."""
    answer = peer.program("greet").call(0)
    assert answer.success, answer
    peer.hear("hello")
    print("program: done")


def goals_in_a_row(peer, processes):
    """Many goals, one after the other; the bridge does not grow."""
    count = int(os.environ.get("CANTER_ROS2_GOALS", "12"))
    names = at_rest(peer).name

    def resident():
        status = Path(f"/proc/{processes.bridge.pid}/status").read_text()
        line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1])

    sizes = []
    for number in range(count):
        start = peer.joints().position
        result = peer.follow(bend(start, 0.05 if number % 2 else -0.05, 0.4, 4, names))
        assert result.status == SUCCEEDED, (number, result)
        if number % max(count // 10, 1) == 0:
            sizes.append(resident())
    print(f"goals in a row: {count}, resident kB {sizes}")
    assert sizes[-1] - sizes[len(sizes) // 3] < 3000, f"it grows: {sizes} kB"


def fault(peer, processes):
    """A fault of the driver ends the goal with its sentence; the next goal is rejected with it."""
    start = at_rest(peer)
    name, accepted = peer.send(bend(start.position, 0.4, 3.0, 10, start.name))
    assert accepted
    time.sleep(0.8)
    children = Path(f"/proc/{processes.engine.pid}/task/{processes.engine.pid}/children").read_text()
    for child in children.split():
        os.kill(int(child), signal.SIGKILL)
    result = peer.result(name)
    assert (result.status, result.result.error_code) == (ABORTED, -4), result
    assert len(result.result.error_string) > 10
    print(f"fault: {result.result.error_string}")
    _, accepted = peer.send(bend(start.position, 0.1, 1.0, 5, start.name))
    assert not accepted
    peer.hear("a fault is latched", "goal rejected")


def killed(peer, processes):
    """Without the bridge the engine follows the trajectory to its end."""
    start = at_rest(peer)
    _, accepted = peer.send(bend(start.position, -0.3, 30.0, 10, start.name))
    assert accepted
    processes.bridge.kill()

    def look():
        status = json.loads(processes.run("status", "--json").stdout)
        return status if status["idle"] else None

    end = wait("rest", look)["setpoint"]
    assert near(end, [q - 0.3 for q in start.position]), end
    print("killed: the trajectory came to its end")


def other_distribution():
    """Feedback of Kilted has the number of the point; with --retime the time law is the engine's."""
    domain = DOMAIN + 1
    options = ["--distro", "kilted", "--retime"]
    with Processes(f"ros{os.getpid()}/kilted", domain, *options) as processes:
        peer = Peer(domain, kilted=True)
        start = at_rest(peer)
        name, accepted = peer.send(bend(start.position, 0.3, 30.0, 10, start.name))
        assert accepted, peer.said
        begun = time.monotonic()
        result = peer.result(name)
        took = time.monotonic() - begun
        assert result.status == SUCCEEDED and took < 10, (took, result)
        feedback = [message for message in peer.feedback.take(100) if list(message.goal_id) == name]
        assert feedback and all(message.multi_dof_index == 0 for message in feedback)
        assert all(list(message.joint_names) == list(start.name) for message in feedback)
        print(f"kilted, retimed: {took:.2f} s instead of 30 s, {len(feedback)} feedbacks")
        killed(peer, processes)


def main():
    folder = Path(sys.argv[1])
    program_file = folder / "greet.canon"
    program_file.write_text(PROGRAM)
    urdf = Path("robots/ur5e/robot.urdf").read_text()
    with Processes(f"ros{os.getpid()}/arm", DOMAIN, "--program", f"greet={program_file}") as processes:
        peer = Peer(DOMAIN)
        joint_states(peer, urdf)
        description(peer, urdf)
        followed(peer)
        canceled(peer)
        rejected(peer)
        tolerances(peer)
        stopped(peer)
        held(peer, processes)
        program(peer)
        goals_in_a_row(peer, processes)
        fault(peer, processes)
    other_distribution()


if __name__ == "__main__":
    main()
