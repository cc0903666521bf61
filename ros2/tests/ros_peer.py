"""A ROS 2 peer without ROS: topics, services and the action over Cyclone DDS, and the processes of
Canter that it talks to."""

import math
import os
import random
import subprocess
import threading
import time

import ros_types as ros
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PATIENCE = 60.0
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6

LOOPBACK = """<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"
multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>
<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""

RELIABLE = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.History.KeepLast(50),
    Policy.Durability.Volatile,
)
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
)


def wait(what, check, patience=PATIENCE):
    """What `check` gives once it gives something."""
    end = time.monotonic() + patience
    while True:
        found = check()
        if found:
            return found
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.002)


class Service:
    """A client of a service of rmw_cyclonedds."""

    def __init__(self, participant, name, request, response):
        self.request = request
        self.writer = DataWriter(participant, Topic(participant, f"rq/{name}Request", request), qos=RELIABLE)
        self.reader = DataReader(participant, Topic(participant, f"rr/{name}Reply", response), qos=RELIABLE)
        self.client = random.getrandbits(63)
        self.number = 0
        self.answers = {}

    def matched(self):
        pubs = self.writer.get_matched_subscriptions()
        return pubs and self.reader.get_matched_publications()

    def send(self, *fields):
        self.number += 1
        self.writer.write(self.request(self.client, self.number, *fields))
        return self.number

    def answer(self, number):
        for sample in self.reader.take(50):
            if sample.client == self.client:
                self.answers[sample.number] = sample
        return self.answers.pop(number, None)

    def call(self, *fields, patience=PATIENCE):
        number = self.send(*fields)
        return wait("an answer", lambda: self.answer(number), patience)


class Peer:
    """Everything that the bridge offers."""

    def __init__(self, domain, controller="joint_trajectory_controller", kilted=False):
        self.domain = Domain(domain, LOOPBACK)
        self.participant = participant = DomainParticipant(domain)
        action = f"{controller}/follow_joint_trajectory/_action"

        def reader(name, kind, qos):
            return DataReader(participant, Topic(participant, f"rt/{name}", kind), qos=qos)

        self.states = reader("joint_states", ros.JointState, RELIABLE)
        self.log = reader("rosout", ros.Log, RELIABLE)
        feedback = ros.KiltedFeedbackMessage if kilted else ros.FeedbackMessage
        self.feedback = reader(f"{action}/feedback", feedback, RELIABLE)
        self.status = reader(f"{action}/status", ros.GoalStatusArray, LATCHED)
        self.goals = Service(participant, f"{action}/send_goal", ros.SendGoalRequest, ros.SendGoalResponse)
        self.results = Service(participant, f"{action}/get_result", ros.GetResultRequest, ros.GetResultResponse)
        self.cancels = Service(participant, f"{action}/cancel_goal", ros.CancelRequest, ros.CancelResponse)
        self.stop = Service(participant, "canter/stop", ros.TriggerRequest, ros.TriggerResponse)
        self.said = []
        for service in (self.goals, self.results, self.cancels, self.stop):
            wait("a service", service.matched)
        wait("joint states", lambda: self.states.get_matched_publications())
        wait("the log", lambda: self.log.get_matched_publications())

    def program(self, name):
        service = Service(self.participant, f"canter/{name}", ros.TriggerRequest, ros.TriggerResponse)
        wait("a service", service.matched)
        return service

    def joints(self):
        """The newest joint state."""
        return wait("a joint state", lambda: self.states.take(100))[-1]

    def hear(self, words, start=""):
        """The line of the log that starts so and has these words in it."""

        def look():
            self.said += [entry.msg for entry in self.log.take(100)]
            found = (line for line in self.said if line.startswith(start) and words in line)
            return next(found, None)

        return wait(f"{words!r} in the log", look, 20)

    def send(self, goal):
        """Asks for a goal; its name, and whether it was accepted."""
        name = [random.getrandbits(8) for _ in range(16)]
        return name, self.goals.call(name, goal).accepted

    def result(self, name):
        return self.results.call(name)

    def cancel(self, name):
        return self.cancels.call(ros.GoalInfo(name, ros.Time()))

    def follow(self, goal):
        """Follows a goal to its end."""
        name, accepted = self.send(goal)
        if not accepted:
            time.sleep(0.3)
            raise AssertionError([entry.msg for entry in self.log.take(100)])
        return self.result(name)


def bend(start, step, seconds, parts, joints=None):
    """A goal: a smooth motion of all joints by `step` rad, from rest to rest."""
    points = []
    for part in range(parts + 1):
        t = seconds * part / parts
        x = part / parts
        way = x**3 * (10 - 15 * x + 6 * x * x)
        speed = x * x * (30 - 60 * x + 30 * x * x) / seconds
        rise = x * (60 - 180 * x + 120 * x * x) / seconds**2
        points.append(
            ros.Point(
                positions=[q + step * way for q in start],
                velocities=[step * speed for _ in start],
                accelerations=[step * rise for _ in start],
                time_from_start=ros.Duration.of(t),
            )
        )
    goal = ros.Goal()
    goal.trajectory = ros.Trajectory(joint_names=joints, points=points)
    return goal


class Processes:
    """An engine with a simulated arm and a bridge; ended with the block."""

    def __init__(self, arm, domain, *options, robot="ur5e"):
        self.arm = arm
        canter = os.environ["CANTER_COMMAND"]
        self.canter = canter
        self.engine = self._start([canter, "engine", "--robot", robot, "--arm", arm], "engine of")
        bridge = [os.environ["CANTER_ROS2_COMMAND"], "--arm", arm, "--rmw", "cyclone"]
        bridge += ["--ros-domain", str(domain), *options]
        self.bridge = self._start(bridge, "serving ROS 2")

    @staticmethod
    def _start(command, words):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        seen = []
        for line in process.stderr:
            seen.append(line)
            if words in line:
                # Read on, so that it has a reader for as long as it lives.
                threading.Thread(target=process.stderr.read, daemon=True).start()
                return process
        raise AssertionError(f"{command} ended: {''.join(seen)}")

    def run(self, *words):
        return subprocess.run([self.canter, *words, "--arm", self.arm], capture_output=True, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in (self.bridge, self.engine):
            process.terminate()
        for process in (self.bridge, self.engine):
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def near(a, b, most=2e-3):
    return all(math.isclose(x, y, abs_tol=most) for x, y in zip(a, b, strict=True))
