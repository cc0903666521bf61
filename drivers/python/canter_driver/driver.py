"""The driver's side of the protocol, without a channel: it gets times and returns states."""

import math
import time

from . import messages as m
from .limiter import Limiter

# How far the first setpoint of a session may be from the measured position, and the tolerance of
# a setpoint beyond what speed and time allow (rad).
FIRST, ROOM = 1e-3, 2e-3

# Largest velocity and acceleration of a setpoint, as a multiple of the limit.
MARGIN = 1.001


class Driver:
    """The driver's side of the protocol."""

    def __init__(self, robot):
        self.robot = robot
        self.joints = len(robot.lower)
        self.state, self.fault, self.fault_joint = m.DISCONNECTED, m.NO_FAULT, 0xFFFFFFFF
        self.session, self.hello = 0, None
        self.sequence = self.missed = 0
        self.last = m.Setpoint()
        self.fresh = False
        # Times: a setpoint arrived, the newest was sent (its time stamp), the last period.
        self.received_ns = self.heard_ns = self.newest_ns = self.stepped_ns = 0
        self.leaving = False
        limits = robot.lower, robot.upper, robot.velocity, robot.acceleration, robot.jerk
        self.limiters = [Limiter(*values) for values in zip(*limits)]
        self.rest()
        self.orders = [0] * m.MAX_TOOLS
        # The state to send, written in every period.
        self.out = m.State(protocol=m.PROTOCOL, joints=self.joints)
        self.feedback = [self.out.tools[tool] for tool in range(m.MAX_TOOLS)]

    def rest(self):
        """Sets reference and setpoints to rest at the measured position."""
        position, _ = self.robot.measure()
        self.reference = self.target = [(at, 0.0, 0.0) for at in position]

    @property
    def resting(self):
        """Whether the reference is at rest."""
        return all(abs(v) < 1e-9 and abs(a) < 1e-6 for _, v, a in self.reference)

    @property
    def following(self):
        return self.state in (m.ARMED, m.ACTIVE)

    @property
    def lock_step(self):
        return self.hello is not None and self.hello.clock == m.LOCK_STEP

    def objection(self, hello):
        """Why there can be no session, as verdict and reason."""
        if hello.protocol != m.PROTOCOL:
            return m.WRONG_PROTOCOL, f"protocol {hello.protocol}, expected {m.PROTOCOL}"
        if hello.schema != m.schema_checksum():
            return m.WRONG_SCHEMA, "another message layout"
        if hello.joints != self.joints:
            return m.WRONG_JOINTS, f"{hello.joints} joints, expected {self.joints}"
        if not 100_000 <= hello.period_ns <= hello.watchdog_ns <= 10_000_000_000:
            return m.WRONG_PERIOD, f"period {hello.period_ns} ns, watchdog {hello.watchdog_ns} ns"
        if hello.clock not in (m.WALL, m.LOCK_STEP):
            return m.WRONG_CLOCK, f"clock {hello.clock}"
        if self.following and self.hello.process != hello.process:
            return m.BUSY, f"driven by process {self.hello.process}"
        if self.leaving:
            return m.NOT_READY, "the driver ends"
        if not self.resting:
            return m.NOT_READY, "the arm still moves"
        return None

    def greet(self, hello):
        """Answers a request for a session."""
        ack = m.HelloAck(protocol=m.PROTOCOL, joints=self.joints, schema=m.schema_checksum())
        fill(ack.name, self.robot.name)
        objection = self.objection(hello)
        if objection:
            ack.verdict = objection[0]
            fill(ack.reason, objection[1])
            return ack
        self.hello = m.Hello.from_buffer_copy(hello)
        self.session = ack.session = time.monotonic_ns() | 1
        ack.watchdog_ns = hello.watchdog_ns
        position, _ = self.robot.measure()
        for joint in range(self.joints):
            ack.position[joint] = position[joint]
            ack.lower[joint], ack.upper[joint] = self.robot.lower[joint], self.robot.upper[joint]
            ack.velocity[joint] = self.robot.velocity[joint]
        self.rest()
        self.state, self.fault, self.fault_joint = m.SYNCED, m.NO_FAULT, 0xFFFFFFFF
        self.last, self.fresh, self.missed = m.Setpoint(), False, 0
        self.orders = [0] * m.MAX_TOOLS
        self.heard_ns = now_ns = time.monotonic_ns()
        self.received_ns = self.newest_ns = 0 if self.lock_step else now_ns
        self.stepped_ns = 0
        return ack

    def receive(self, setpoint, now_ns):
        """Receives a setpoint; an invalid one stops the arm."""
        following = self.state in (m.SYNCED, m.ARMED, m.ACTIVE)
        if setpoint.session != self.session or not following:
            return
        if setpoint.sequence <= self.last.sequence:
            return
        if self.stalled(now_ns):
            return self.stop(m.STALLED)
        n = self.joints
        lists = setpoint.position[:n], setpoint.velocity[:n], setpoint.acceleration[:n]
        sane = setpoint.protocol == m.PROTOCOL and setpoint.joints == n
        wall = not self.lock_step
        # Both sides read the same clock: a time far in the future is invalid.
        future = wall and setpoint.published_ns > now_ns + self.hello.watchdog_ns
        # A sum is finite only if all its parts are.
        if future or not (sane and math.isfinite(sum(map(sum, lists)))):
            return self.stop(m.BAD_SETPOINT)
        target = list(zip(*lists))
        joint = self.unreachable(target, setpoint.tick, now_ns)
        if joint is not None:
            return self.stop(m.OUT_OF_RANGE, joint)
        self.newest_ns = min(setpoint.published_ns, now_ns) if wall else now_ns
        self.last, self.target, self.received_ns, self.fresh = setpoint, target, now_ns, True
        flags = setpoint.flags
        if flags & m.FLAG_STOP_REQUEST:
            self.stop(m.STOP_REQUEST)
        elif flags & m.FLAG_GOODBYE:
            self.state, self.session, self.hello = m.DISCONNECTED, 0, None
        else:
            self.state = m.ARMED if self.state == m.SYNCED else m.ACTIVE

    def unreachable(self, target, tick, now_ns):
        """The first joint whose setpoint is out of range, too fast, accelerates too much, or is too
        far from the last."""
        first = self.state == m.SYNCED
        last = self.last.position
        # After a stall setpoints arrive together: then the time between them is that of their ticks.
        hello = self.hello
        planned = (tick - self.last.tick) * hello.period_ns
        elapsed = max(now_ns - self.received_ns, planned, hello.period_ns)
        elapsed = min(elapsed, hello.watchdog_ns) * 1e-9
        for joint, ((at, speed, rate), limits) in enumerate(zip(target, self.limiters)):
            most = limits.velocity * MARGIN
            before, room = last[joint], ROOM + most * elapsed
            if first:
                before, room = self.reference[joint][0], FIRST
            inside = limits.lower - ROOM <= at <= limits.upper + ROOM
            slow = abs(speed) <= most and abs(rate) <= limits.acceleration * MARGIN
            if not (inside and slow and abs(at - before) <= room):
                return joint
        return None

    def stop(self, fault, joint=0xFFFFFFFF):
        self.state, self.fault, self.fault_joint = m.STOPPING, fault, joint

    def leave(self):
        """Begins to end: the arm stops within its limits, and no new session is opened. Returns
        whether the arm moves."""
        self.leaving = True
        if self.following or self.state == m.SYNCED:
            self.stop(m.ENDED)
        return not self.resting

    def stalled(self, now_ns):
        """Whether the driver itself did not run for longer than the watchdog."""
        if not self.following or self.lock_step or self.stepped_ns == 0:
            return False
        return now_ns - self.stepped_ns > self.hello.watchdog_ns

    def step(self, now_ns, period):
        """One period: returns the state to send, then moves the robot."""
        if self.stalled(now_ns):
            self.stop(m.STALLED)
        # By its time stamp: a setpoint that waited while the driver did not run is not new.
        silence = now_ns - self.newest_ns
        if self.following:
            self.missed += 0 if self.fresh else 1
            if silence > self.hello.watchdog_ns:
                self.stop(m.WATCHDOG)
        elif self.state == m.SYNCED and not self.lock_step:
            if silence > max(self.hello.watchdog_ns, 1_000_000_000):
                self.stop(m.WATCHDOG)
        elif self.state == m.STOPPING and self.resting:
            self.state = m.FAULT
        self.stepped_ns = now_ns
        state = self.report(now_ns)
        if self.fresh:
            self.take_orders()
        self.refer(period)
        self.robot.move(*map(list, zip(*self.reference)), period)
        return state

    def sign_of_life(self, setpoint):
        """In lock-step, the answer to a setpoint that repeats the last period; or None."""
        last = self.last
        repeats = setpoint.tick == last.tick and 0 < last.sequence < setpoint.sequence
        if not repeats or setpoint.flags & (m.FLAG_GOODBYE | m.FLAG_STOP_REQUEST):
            return None
        last.sequence = setpoint.sequence
        self.sequence += 1
        self.out.sequence, self.out.setpoint_sequence = self.sequence, setpoint.sequence
        return self.out

    def take_orders(self):
        for tool, order in enumerate(self.last.tools):
            if order.order != self.orders[tool]:
                self.orders[tool] = order.order
                if order.action in (m.OPEN, m.CLOSE):
                    self.robot.tool(tool, order.action)

    def refer(self, period):
        """The reference: the setpoint, its extrapolation, or a stop; always within the limits of the
        joints."""
        limiters = self.limiters
        if self.following:
            if not self.fresh:
                self.target = [l.go_on(at, period) for l, at in zip(limiters, self.target)]
            pairs = zip(limiters, self.reference, self.target)
            self.reference = [l.approach(at, to, period) for l, at, to in pairs]
        elif self.state in (m.STOPPING, m.DISCONNECTED):
            self.reference = [l.stop(at, period) for l, at in zip(limiters, self.reference)]
        else:
            self.reference = [(at, 0.0, 0.0) for at, _, _ in self.reference]
        self.fresh = False

    def report(self, now_ns):
        self.sequence += 1
        n, state, last = self.joints, self.out, self.last
        position, velocity = self.robot.measure()
        state.session, state.sequence = self.session, self.sequence
        state.measured_ns = state.published_ns = now_ns
        state.setpoint_sequence = last.sequence
        state.setpoint_published_ns = last.published_ns
        state.setpoint_received_ns = self.received_ns
        state.driver_state, state.fault = self.state, self.fault
        state.fault_joint, state.missed = self.fault_joint, self.missed
        state.position[:n], state.velocity[:n] = position, velocity
        for tool, feedback in enumerate(self.feedback):
            feedback.order = self.orders[tool]
            feedback.status = self.robot.tool_status(tool)
        return state


def fill(field, text):
    """Writes a text into a field of bytes, cut to its length."""
    data = text.encode()[: len(field)]
    field[: len(data)] = list(data)
