"""The driver's side of the protocol, without a channel: it gets times and returns states."""

import ctypes
import math
import os
import time

from . import messages as m
from .limiter import Limiter

# How far the first setpoint of a session may be from the measured position, and the tolerance of
# a setpoint beyond what speed and time allow (rad).
FIRST, ROOM = 1e-3, 2e-3

# How long a robot that is getting ready waits for the next request of its engine (ns).
BEGINNING_NS = 2_000_000_000

# Tolerance of a setpoint's speed where little is allowed (rad/s).
SLOW = 1e-3

# Largest velocity and acceleration of a setpoint, as a multiple of the limit.
MARGIN = 1.001

# A driver that is behind by so much (s) asks for less speed; by so much more again for half of it, and
# never for less than this share.
BEHIND, HALF, LEAST = 0.006, 0.02, 0.2


def sign(value):
    return (value > 0.0) - (value < 0.0)


class Driver:
    """The driver's side of the protocol."""

    def __init__(self, robot):
        self.robot = robot
        self.joints = len(robot.lower)
        self.state, self.fault, self.fault_joint = m.DISCONNECTED, m.NO_FAULT, 0xFFFFFFFF
        self.fault_code, self.fault_text = 0, ""
        # The arm does not follow any more: the references follow the arm.
        self.lost = False
        # When the robot was asked to get ready; None if it was not, or has ended.
        self.begun_ns = None
        self.session, self.hello = 0, None
        self.sequence = self.missed = 0
        self.last = m.Setpoint()
        self.fresh = False
        # Times: a setpoint arrived, the newest was sent (its time stamp), the last period.
        self.received_ns = self.heard_ns = self.newest_ns = self.stepped_ns = 0
        self.leaving = False
        limits = robot.lower, robot.upper, robot.velocity, robot.acceleration, robot.jerk
        near_ends = robot.near_ends or [None] * self.joints
        if len(near_ends) != self.joints:
            raise ValueError(f"near_ends has {len(near_ends)} entries, the robot has {self.joints} joints")
        self.limiters = [Limiter(*values) for values in zip(*limits, near_ends)]
        self.at_ns = 0
        self.rest()
        self.forget_orders()
        # The state to send, written in every period.
        self.sensor_names = []
        self.out = m.State(protocol=m.PROTOCOL, joints=self.joints)
        self.feedback = [self.out.tools[tool] for tool in range(m.MAX_TOOLS)]

    def rest(self):
        """Sets reference and setpoints to rest where the arm's controller holds it."""
        position = self.robot.commanded() or self.robot.measure()[0]
        self.reference = self.target = [(at, 0.0, 0.0) for at in position]
        self.at_ns = 0

    def forget_orders(self):
        """Every order of a new session is new."""
        self.orders, self.payload, self.outputs = [0] * m.MAX_TOOLS, 0, None

    def close(self):
        """The robot need not be ready any more."""
        if self.begun_ns is not None:
            self.begun_ns = None
            self.robot.end()

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
            found = f"protocol {hello.protocol}, expected {m.PROTOCOL}"
            return m.WRONG_PROTOCOL, f"{found}; build engine and driver from the same version"
        if hello.schema != m.schema_checksum():
            return m.WRONG_SCHEMA, "another message layout"
        if hello.joints != self.joints:
            return m.WRONG_JOINTS, f"{hello.joints} joints, expected {self.joints}"
        if not 100_000 <= hello.period_ns <= hello.watchdog_ns <= 10_000_000_000:
            return m.WRONG_PERIOD, f"period {hello.period_ns} ns, watchdog {hello.watchdog_ns} ns"
        if hello.clock not in (m.WALL, m.LOCK_STEP):
            return m.WRONG_CLOCK, f"clock {hello.clock}"
        if hello.clock == m.LOCK_STEP and not self.robot.lock_step:
            return m.WRONG_CLOCK, "a real arm has its own time: it cannot be driven in lock-step"
        least, most = self.robot.periods
        if not least <= hello.period_ns * 1e-9 <= most:
            period = f"a period of {hello.period_ns * 1e-6:g} ms"
            return m.WRONG_PERIOD, f"{period}; this arm needs {least * 1e3:g} to {most * 1e3:g} ms"
        if self.following and self.hello.process != hello.process:
            process = self.hello.process
            if os.path.exists(f"/proc/{process}"):
                return m.BUSY, f"driven by process {process}"
            # It was killed; the watchdog ends its session.
            return m.WAIT, f"process {process} is gone: the arm comes to rest"
        if self.leaving:
            return m.NOT_READY, "the driver ends"
        if not self.resting:
            return m.WAIT, "the arm comes to rest"
        return None

    def answer(self, verdict, reason=""):
        """An answer with what the driver can do and where the arm is."""
        robot = self.robot
        ack = m.HelloAck(protocol=m.PROTOCOL, joints=self.joints, schema=m.schema_checksum())
        ack.verdict = verdict
        fill(ack.name, robot.name)
        fill(ack.reason, reason)
        ack.features = m.HAS_WALL | (m.HAS_LOCK_STEP if robot.lock_step else 0)
        ack.features |= m.IS_REAL if robot.real else 0
        ack.periods_ns[:] = [round(period * 1e9) for period in robot.periods]
        n = self.joints
        position, _ = robot.measure()
        ack.position[:n], ack.commanded[:n] = position, [at for at, _, _ in self.reference]
        ack.lower[:n], ack.upper[:n], ack.velocity[:n] = robot.lower, robot.upper, robot.velocity
        ack.acceleration[:n], ack.jerk[:n] = robot.acceleration, robot.jerk
        return ack

    def greet(self, hello):
        """Answers a request for a session."""
        objection = self.objection(hello)
        if objection:
            return self.answer(*objection)
        self.begun_ns = time.monotonic_ns()
        ready, reason = self.robot.begin()
        if ready == m.NOT_READY:
            self.close()
        if ready != m.WELCOME:
            return self.answer(ready, reason)
        self.hello = m.Hello.from_buffer_copy(hello)
        self.rest()
        ack = self.answer(m.WELCOME)
        self.session = ack.session = time.monotonic_ns() | 1
        ack.watchdog_ns = hello.watchdog_ns
        self.lost, self.fault_code, self.fault_text = False, 0, ""
        self.state, self.fault, self.fault_joint = m.SYNCED, m.NO_FAULT, 0xFFFFFFFF
        self.last, self.fresh, self.missed = m.Setpoint(), False, 0
        self.forget_orders()
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
            self.close()
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
            most = min(most, limits.speed(at, speed) * MARGIN + SLOW)
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
        self.watch_robot(now_ns)
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
            self.close()
        self.stepped_ns = now_ns
        state = self.report(now_ns)
        if self.fresh:
            self.take_orders()
        self.refer(now_ns, period)
        self.robot.move(*map(list, zip(*self.reference)), self.at_ns or now_ns, period)
        return state

    def watch_robot(self, now_ns):
        """A fault of the robot, and a robot that gets ready for nobody."""
        fault = self.robot.fault()
        if fault and self.session and not self.lost and self.state != m.FAULT:
            self.lost = True
            joint, self.fault_code, self.fault_text = fault
            if self.state != m.STOPPING:
                self.stop(m.HARDWARE, 0xFFFFFFFF if joint is None else joint)
        waits = not self.session or self.state == m.FAULT
        if waits and self.begun_ns is not None and now_ns - self.begun_ns > BEGINNING_NS:
            self.close()

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
        """Passes on orders to tools, payload and outputs that are new."""
        last = self.last
        for tool, order in enumerate(last.tools):
            if order.order != self.orders[tool]:
                self.orders[tool] = order.order
                if order.action != m.NO_ACTION:
                    self.robot.tool(tool, order)
        if last.payload.number != self.payload:
            self.payload = last.payload.number
            self.robot.carry(last.payload)
        outputs = last.digital_outputs, last.digital_mask, last.analogue_mask
        outputs += tuple(last.analogue_outputs)
        if any((last.digital_mask, last.analogue_mask)) and outputs != self.outputs:
            self.outputs = outputs
            self.robot.set_outputs(last)

    def label(self, now_ns, period):
        """The time of this period's reference (ns)."""
        step = round(period * 1e9)
        if not self.following and self.state not in (m.STOPPING, m.DISCONNECTED):
            return 0
        label = self.at_ns + step if self.at_ns else now_ns
        if self.fresh and self.following:
            said = self.last.tick_ns
            if not self.lock_step:
                watchdog = self.hello.watchdog_ns
                said = min(max(said, now_ns - watchdog), now_ns + watchdog)
            if self.at_ns == 0 or said > self.at_ns + step // 2:
                label = said
        return label

    def refer(self, now_ns, period):
        """The reference: the setpoint, its extrapolation, or a stop; always within the limits of the
        joints."""
        limiters = self.limiters
        self.at_ns = self.label(now_ns, period)
        if self.lost:
            position = self.robot.commanded() or self.robot.measure()[0]
            self.reference = [(at, 0.0, 0.0) for at in position]
        elif self.following:
            if not self.fresh:
                self.target = [l.go_on(at, period) for l, at in zip(limiters, self.target)]
            pairs = zip(limiters, self.reference, self.target)
            self.reference = [l.approach(at, to, period) for l, at, to in pairs]
        elif self.state in (m.STOPPING, m.DISCONNECTED):
            self.reference = [l.stop(at, period) for l, at in zip(limiters, self.reference)]
        else:
            self.reference = [(at, 0.0, 0.0) for at, _, _ in self.reference]
        self.fresh = False

    def speed_share(self):
        """The share of the planned speed that is asked for after a stall of the driver, until the
        references are at the setpoints again."""
        if not self.following or self.lock_step:
            return 1.0
        joints = zip(self.reference, self.target, self.limiters)
        behind = [(to[0] - at[0]) * sign(to[1]) / limits.velocity for at, to, limits in joints]
        lag = max(behind)
        return max(HALF / (HALF + max(lag - BEHIND, 0.0)), LEAST)

    def report(self, now_ns):
        self.sequence += 1
        n, state, last = self.joints, self.out, self.last
        position, velocity = self.robot.measure()
        state.session, state.sequence = self.session, self.sequence
        state.published_ns = now_ns
        measured_ns = self.robot.measured_ns()
        known = 0 if measured_ns is None else m.STATE_UNKNOWN if measured_ns <= 0 else 0
        if measured_ns is None or measured_ns > 0:
            state.measured_ns = measured_ns or now_ns
        commanded = self.robot.commanded()
        state.commanded[:n] = commanded or [at for at, _, _ in self.reference]
        state.flags = known | (m.STATE_COMMANDED if commanded else 0)
        state.setpoint_sequence = last.sequence
        state.setpoint_published_ns = last.published_ns
        state.setpoint_received_ns = self.received_ns
        state.driver_state, state.fault = self.state, self.fault
        state.fault_joint, state.missed = self.fault_joint, self.missed
        if state.fault_code != self.fault_code or self.fault_text or self.lost:
            state.fault_code = self.fault_code
            ctypes.memset(state.text, 0, len(state.text))
            fill(state.text, self.fault_text)
        state.speed_scaling = min(max(self.robot.speed_scaling(), 0.0), self.speed_share())
        self.sense(state)
        state.position[:n], state.velocity[:n] = position, velocity
        for tool, feedback in enumerate(self.feedback):
            feedback.order = self.orders[tool]
            feedback.status = self.robot.tool_status(tool)
            more = self.robot.tool_feedback(tool)
            if more is not None:
                feedback.position, feedback.force, feedback.flags = more
        return state

    def sense(self, state):
        """Inputs and named sensor values."""
        sensors = list(self.robot.sensors().items())[: m.MAX_SENSORS]
        if [name for name, _ in sensors] != self.sensor_names:
            self.sensor_names = [name for name, _ in sensors]
            for place, name in zip(state.sensors, self.sensor_names):
                ctypes.memset(place.name, 0, len(place.name))
                fill(place.name, name)
        state.sensor_count = len(sensors)
        for place, (_, value) in zip(state.sensors, sensors):
            place.value = value
        inputs = self.robot.inputs()
        if inputs is not None:
            state.digital_inputs = inputs[0]
            state.analogue_inputs[: len(inputs[1])] = inputs[1]


def fill(field, text):
    """Writes a text into a field of bytes, cut to its length."""
    data = text.encode()[: len(field)].decode(errors="ignore").encode()
    field[: len(data)] = list(data)
