"""Attach a robot to Canter from Python: implement `Robot`, call `run`.

The kit does the protocol: handshake, sessions, watchdog, going on and stopping by itself, the
latch. The robot only measures and moves. Needs the `iceoryx2` wheel of version 0.9.3.
"""

import math
import time

import iceoryx2 as iox2

from . import domain
from . import messages as m

__all__ = ["Robot", "run"]

# How many times lock-step looks for a setpoint before it sleeps between looks, and how long it
# waits until the arm counts as left alone.
SPINS = 200
LOCK_STEP_PATIENCE_NS = 2_000_000_000


class Robot:
    """What a robot must be able to do. Lists have one number a joint, in rad and seconds."""

    name = "python"
    lower = []
    upper = []
    velocity = []
    acceleration = []
    jerk = []

    def measure(self):
        """The positions and the velocities now."""
        raise NotImplementedError

    def move(self, position, velocity, acceleration, period):
        """Follow this for `period` seconds."""
        raise NotImplementedError

    def tool(self, tool, action):
        """Begin an action (messages.OPEN or CLOSE) of tool 0 (gripper) or 1 (tool changer)."""

    def tool_status(self, tool):
        """How a tool is: one of the messages.TOOL_ numbers."""
        return m.TOOL_UNKNOWN


class Link:
    """The driver's end of shared memory."""

    def __init__(self, arm):
        iox2.set_log_level(iox2.LogLevel.Fatal)
        config = iox2.config.default()
        place = domain.directory()
        config.global_cfg.root_path = iox2.Path.new(place)
        config.global_cfg.prefix = iox2.FileName.new(domain.prefix(place))
        self.node = (
            iox2.NodeBuilder.new()
            .name(iox2.NodeName.new(f"driver of {arm}"))
            .config(config)
            .signal_handling_mode(iox2.SignalHandlingMode.Disabled)
            .create(iox2.ServiceType.Ipc)
        )
        self.states = self._topic(arm, "state", m.State).publisher_builder()
        self.states = self.states.backpressure_strategy(
            iox2.BackpressureStrategy.DiscardData
        ).create()
        self.setpoints = self._topic(arm, "setpoint", m.Setpoint).subscriber_builder().create()
        exchange = self.node.service_builder(iox2.ServiceName.new(f"{arm}/hello"))
        self.hello = (
            exchange.request_response(m.Hello, m.HelloAck)
            .enable_safe_overflow_for_requests(True)
            .enable_safe_overflow_for_responses(True)
            .max_active_requests_per_client(2)
            .max_response_buffer_size(2)
            .max_servers(1)
            .max_clients(8)
            .max_nodes(16)
            .open_or_create()
            .server_builder()
            .create()
        )

    def _topic(self, arm, kind, payload):
        return (
            self.node.service_builder(iox2.ServiceName.new(f"{arm}/{kind}"))
            .publish_subscribe(payload)
            .payload_alignment(iox2.Alignment.new(64))
            .enable_safe_overflow(True)
            .history_size(0)
            .subscriber_max_buffer_size(16)
            .subscriber_max_borrowed_samples(2)
            .max_publishers(1)
            .max_subscribers(8)
            .max_nodes(16)
            .open_or_create()
        )

    def send(self, state):
        self.states.send_copy(state)

    def next_setpoint(self):
        sample = self.setpoints.receive()
        if sample is None:
            return None
        setpoint = m.Setpoint.from_buffer_copy(sample.payload().contents)
        sample.delete()
        return setpoint


def next_rate(value, rate, bound, change, period):
    """The rate after a period on the way of `value` to rest at zero; see `realtime::next_rate`."""
    missing = -value - rate * period / 2
    step = change * period
    if abs(missing) < 1e-12 and abs(rate) <= step:
        return 0.0
    ramp = math.ceil((math.sqrt(1 + 8 * abs(missing) / (step * period)) - 1) / 2)
    wanted = 2 * missing / (period * (1 + max(ramp, 1)))
    wanted = min(max(wanted, -bound), bound)
    return min(max(wanted, rate - step), rate + step)


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
        self.received_ns = self.heard_ns = 0
        position, _ = robot.measure()
        self.reference = [list(position), [0.0] * self.joints, [0.0] * self.joints]
        self.target = self.reference
        self.orders = [0] * m.MAX_TOOLS
        # The state to send, written anew in every period.
        self.out = m.State(protocol=m.PROTOCOL, joints=self.joints)
        self.feedback = [self.out.tools[tool] for tool in range(m.MAX_TOOLS)]

    @property
    def lock_step(self):
        return self.hello is not None and self.hello.clock == m.LOCK_STEP

    def objection(self, hello):
        """Why there can be no session, as verdict and reason."""
        if hello.protocol != m.PROTOCOL:
            return m.WRONG_PROTOCOL, f"protocol {hello.protocol} where {m.PROTOCOL} is spoken"
        if hello.schema != m.schema_checksum():
            return m.WRONG_SCHEMA, "another message layout"
        if hello.joints != self.joints:
            return m.WRONG_JOINTS, f"{hello.joints} joints where the arm has {self.joints}"
        if not 100_000 <= hello.period_ns <= hello.watchdog_ns <= 10_000_000_000:
            return m.WRONG_PERIOD, f"period {hello.period_ns} ns, watchdog {hello.watchdog_ns} ns"
        if hello.clock not in (m.WALL, m.LOCK_STEP):
            return m.WRONG_CLOCK, f"clock {hello.clock}"
        if self.state in (m.ARMED, m.ACTIVE) and self.hello.process != hello.process:
            return m.BUSY, f"driven by process {self.hello.process}"
        if any(abs(speed) > 1e-6 for speed in self.reference[1]):
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
        self.reference = [list(position), [0.0] * self.joints, [0.0] * self.joints]
        self.state, self.fault, self.fault_joint = m.SYNCED, m.NO_FAULT, 0xFFFFFFFF
        self.last, self.fresh, self.missed = m.Setpoint(), False, 0
        self.orders = [0] * m.MAX_TOOLS
        self.heard_ns = time.monotonic_ns()
        self.received_ns = 0 if self.lock_step else self.heard_ns
        return ack

    def receive(self, setpoint, now_ns):
        """Takes a setpoint; what makes no sense stops the arm."""
        following = self.state in (m.SYNCED, m.ARMED, m.ACTIVE)
        if setpoint.session != self.session or not following:
            return
        if setpoint.sequence <= self.last.sequence:
            return
        n = self.joints
        target = [setpoint.position[:n], setpoint.velocity[:n], setpoint.acceleration[:n]]
        sane = setpoint.protocol == m.PROTOCOL and setpoint.joints == n
        # A sum is finite only if all its parts are.
        if not (sane and math.isfinite(sum(map(sum, target)))):
            return self.stop(m.BAD_SETPOINT)
        joint = self.unreachable(target, setpoint.tick, now_ns)
        if joint is not None:
            return self.stop(m.OUT_OF_RANGE, joint)
        self.last, self.target, self.received_ns, self.fresh = setpoint, target, now_ns, True
        flags = setpoint.flags
        if flags & m.FLAG_STOP_REQUEST:
            self.stop(m.STOP_REQUEST)
        elif flags & m.FLAG_GOODBYE:
            self.state, self.session, self.hello = m.DISCONNECTED, 0, None
        else:
            self.state = m.ARMED if self.state == m.SYNCED else m.ACTIVE

    def unreachable(self, target, tick, now_ns):
        """The first joint whose setpoint is out of range, too fast, or too far from the last."""
        first = self.state == m.SYNCED
        before = self.reference[0] if first else self.target[0]
        # After a stall setpoints come together: then the time between them is that of their ticks.
        hello = self.hello
        planned = min((tick - self.last.tick) * hello.period_ns, hello.watchdog_ns)
        elapsed = max(now_ns - self.received_ns, planned, hello.period_ns) * 1e-9
        room, grows = (1e-3, 0.0) if first else (2e-3, elapsed)
        robot = self.robot
        ends = zip(target[0], target[1], before, robot.lower, robot.upper, robot.velocity)
        for joint, (at, speed, last, lower, upper, most) in enumerate(ends):
            near = -room - most * grows <= at - last <= room + most * grows
            slow = -most * 1.001 <= speed <= most * 1.001
            if not (near and slow and lower - 2e-3 <= at <= upper + 2e-3):
                return joint
        return None

    def stop(self, fault, joint=0xFFFFFFFF):
        self.state, self.fault, self.fault_joint = m.STOPPING, fault, joint

    def step(self, now_ns, period):
        """One period: returns the state to send, then moves the robot."""
        if self.state in (m.ARMED, m.ACTIVE):
            self.missed += 0 if self.fresh else 1
            if now_ns - self.received_ns > self.hello.watchdog_ns:
                self.stop(m.WATCHDOG)
        if self.state == m.STOPPING and all(abs(speed) < 1e-9 for speed in self.reference[1]):
            self.state = m.FAULT
        state = self.report(now_ns)
        if self.fresh:
            self.take_orders()
        self.refer(period)
        self.robot.move(*self.reference, period)
        return state

    def sign_of_life(self, setpoint):
        """In lock-step, the answer to a setpoint of the period that was before; or None."""
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
        """What the robot follows: the setpoint, or what the driver makes up without one."""
        if self.fresh and self.state in (m.ARMED, m.ACTIVE):
            self.reference = [list(values) for values in self.target]
        elif self.state in (m.ARMED, m.ACTIVE, m.STOPPING):
            position, velocity, acceleration = self.reference
            for joint in range(self.joints):
                p, v, a = position[joint], velocity[joint], acceleration[joint]
                jerk = self.robot.jerk[joint]
                if self.state == m.STOPPING:
                    after = next_rate(v, a, self.robot.acceleration[joint], jerk, period)
                else:
                    after = a - math.copysign(min(jerk * period, abs(a)), a)
                position[joint] = p + (v + (2 * a + after) / 6 * period) * period
                velocity[joint] = v + (a + after) / 2 * period
                acceleration[joint] = after
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


def run(arm, robot, stop=lambda: False, ready=lambda: None):
    """Drives `robot` as the arm `cell/arm` until `stop()` is true; `ready()` when it is there."""
    link, driver = Link(arm), Driver(robot)
    ready()
    turns = 0
    while not stop():
        if not driver.lock_step or turns % 64 == 63:
            answer_greeting(link, driver)
        if driver.lock_step:
            turns = lock_step(link, driver, turns + 1)
        else:
            wall_period(link, driver)


def answer_greeting(link, driver):
    request = link.hello.receive()
    if request is not None:
        ack = driver.greet(request.payload().contents)
        request.send_copy(ack)
        request.delete()
        if driver.lock_step and ack.verdict == m.WELCOME:
            link.send(driver.step(0, driver.hello.period_ns * 1e-9))


def wall_period(link, driver):
    """One period by the clock, 0.4 periods after the engine's."""
    period = driver.hello.period_ns if driver.hello else 2_000_000
    phase = driver.last.tick_ns + period * 2 // 5 if driver.last.tick_ns else 0
    now = time.monotonic_ns()
    time.sleep((period - (now - phase) % period) * 1e-9)
    now = time.monotonic_ns()
    while (setpoint := link.next_setpoint()) is not None:
        driver.receive(setpoint, now)
    link.send(driver.step(now, period * 1e-9))


def lock_step(link, driver, turns):
    """A period if the engine asks for one; returns for how many turns it has not."""
    setpoint = link.next_setpoint()
    if setpoint is None:
        if turns > SPINS:
            time.sleep(20e-6)
        if time.monotonic_ns() - driver.heard_ns > LOCK_STEP_PATIENCE_NS:
            if driver.state in (m.ARMED, m.ACTIVE):
                driver.stop(m.WATCHDOG)
        if driver.state == m.STOPPING:
            link.send(driver.step(driver.received_ns, driver.hello.period_ns * 1e-9))
        return turns
    driver.heard_ns = time.monotonic_ns()
    if setpoint.session != driver.session:
        # One that was under way when the session began releases no state.
        return turns
    answer = driver.sign_of_life(setpoint)
    if answer is not None:
        link.send(answer)
        return 0
    now = setpoint.tick * driver.hello.period_ns
    driver.receive(setpoint, now)
    if driver.hello is not None:
        link.send(driver.step(now, driver.hello.period_ns * 1e-9))
    return 0
