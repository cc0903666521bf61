"""What the controller of the tests was told: the largest acceleration and jerk of the commands that it took, how
many cycles had no answer in time, how far a command was beyond the speed that is allowed where the arm is, and the last
commands before each error.

The numbers are the controller's own: it differences every command that it takes.
"""

import collections
import json
import sys
import threading
import time

from franka_sim.franka_protocol import SetLoadCommand
from franka_sim.limits import checker as limits
from franka_sim.limits.checker import MotionLimitChecker as Checker
from franka_sim.mujoco_franka_sim import MujocoFrankaSim as Arm

PERIOD = 1e-3

# Commands that are kept for the account of an error.
KEPT = 120

# Steps of the simulated arm before a measured speed beyond its limit. Where one of them came late, or took two commands, the
# arm's servo swings by that.
BEFORE = 60


class Record:
    """Listens at the controller's check of the motion; each connection has a new one."""

    def __init__(self, folder):
        self.folder, self.errors = folder, 0
        self.recent = collections.deque(maxlen=KEPT)
        self.steps = collections.deque(maxlen=BEFORE)
        self.told = 0
        self.clear()
        self.listen_to_steps()
        self.listen_to_loads()
        names = ("_record_locked", "extrapolate", "absorb_command", "start_motion", "check_measured_velocity")
        for name in names:
            setattr(Checker, name, getattr(self, name)(getattr(Checker, name)))

    def clear(self):
        self.acceleration, self.jerk = [0.0] * 7, [0.0] * 7
        self.taken = self.late = self.missed = 0
        self.loads, self.over, self.swings = [], -1.0, []

    def listen_to_loads(self):
        read = SetLoadCommand.from_bytes

        def listen(data):
            command = read(data)
            self.loads.append(command.m_load)
            return command

        SetLoadCommand.from_bytes = listen

    def listen_to_steps(self):
        step = Arm._apply_control

        def listen(arm):
            self.steps.append((time.perf_counter(), self.told))
            return step(arm)

        Arm._apply_control = listen

    def unsteady(self):
        """The longest of the last steps (periods), or the most commands that one of them took."""
        steps = list(self.steps)
        pairs = list(zip(steps, steps[1:]))
        longest = max(((b[0] - a[0]) / PERIOD for a, b in pairs), default=0.0)
        return max(longest, max((b[1] - a[1] for a, b in pairs), default=0))

    def _record_locked(self, original):
        def record(checker, command, *, clean=None):
            self.told += 1
            cycles = checker._cycles_since_applied_locked(command)
            first, joint = checker._first_command, checker._joint
            before = joint.second
            original(checker, command, clean=clean)
            self.taken += 1
            if not first:
                step = cycles * PERIOD
                pairs = zip(self.acceleration, joint.second)
                self.acceleration = [max(most, abs(now)) for most, now in pairs]
                rows = zip(self.jerk, before, joint.second)
                self.jerk = [max(most, abs(b - a) / step) for most, a, b in rows]

        return record

    def extrapolate(self, original):
        def extrapolate(checker, message_id):
            found = original(checker, message_id)
            self.missed += 1
            if found is not None:
                self.keep(checker, "missed", *found)
            return found

        return extrapolate

    def absorb_command(self, original):
        def absorb(checker, command, joints=None, *, fresh, enforce=False):
            outcome = original(checker, command, joints, fresh=fresh, enforce=enforce)
            self.late += not fresh
            self.keep(checker, "taken" if fresh else "late", command, outcome.violation)
            return outcome

        return absorb

    def start_motion(self, original):
        def start(checker, *words, **named):
            self.recent.clear()
            return original(checker, *words, **named)

        return start

    def check_measured_velocity(self, original):
        def check(checker, positions=None, velocities=None):
            found = original(checker, positions, velocities)
            if not checker._first_command:
                at, commanded = checker._joint_positions, checker._joint.first
                upper = zip(commanded, limits.upper_joint_velocity_limits(at))
                lower = zip(commanded, limits.lower_joint_velocity_limits(at))
                over = [speed - most for speed, most in upper] + [least - speed for speed, least in lower]
                self.over = max(self.over, *over)
            if found is not None and not checker.violated:
                self.swings.append(self.unsteady())
            return found

        return check

    def keep(self, checker, kind, command, violation):
        row = (checker._published_id, command["message_id"], kind, command["q_c"])
        self.recent.append(row)
        if violation is not None and not checker.violated:
            self.errors += 1
            told = {"error": violation.describe(), "commands": list(self.recent)}
            (self.folder / f"error-{self.errors}.json").write_text(json.dumps(told))

    def text(self):
        """One line: the peaks, and the counts since the last line."""
        told = {
            "acceleration": max(self.acceleration),
            "jerk": max(self.jerk),
            "taken": self.taken,
            "late": self.late,
            "missed": self.missed,
            "loads": self.loads,
            "errors": self.errors,
            "over": self.over,
            "swings": self.swings,
        }
        self.clear()
        return json.dumps(told)

    def answer(self):
        """Prints a line for each line of the standard input."""

        def serve():
            for _ in sys.stdin:
                print(self.text(), flush=True)

        threading.Thread(target=serve, daemon=True).start()
