"""Attach a robot to Canter from Python: implement `Robot`, call `run`.

The kit implements the protocol: handshake, sessions, watchdog, continuing and stopping without
setpoints, latched faults. The reference keeps range, speed, acceleration and jerk limits of each
joint. The robot only measures and moves. `run` needs the `iceoryx2` wheel of version 0.9.3.
"""

import signal
import sys
import threading
import time

from . import messages as m
from .driver import Driver
from .limiter import NearEnds

__all__ = ["READY", "NearEnds", "Robot", "not_ready", "run", "wait"]

# How many times lock-step polls for a setpoint before it sleeps between polls, and how long it
# waits until the engine counts as gone.
SPINS = 200
LOCK_STEP_PATIENCE_NS = 2_000_000_000

# For how many periods a driver that ends reports it.
FAREWELL = 20


class Robot:
    """The interface of a robot. Lists have one number per joint, in rad and seconds."""

    name = "python"
    # Range, and limits of speed, acceleration and jerk: setpoints beyond them are refused, and the
    # kit's own stop uses them.
    lower = []
    upper = []
    velocity = []
    acceleration = []
    jerk = []
    # Less speed near the ends of the range, where the arm asks for it: a `NearEnds` for each joint.
    near_ends = None

    # Whether it can be driven in lock-step (simulations can, a real arm cannot), the shortest and
    # longest period that it can serve (s), and whether it is a real arm.
    lock_step = True
    periods = 1e-4, 1.0
    real = False

    def begin(self):
        """An engine wants to move the arm: switch on, open brakes, clear errors. Asked again and
        again until the answer is `READY` or `not_ready(reason)`; `wait(reason)` asks for time."""
        return READY

    def end(self):
        """No engine moves the arm any more."""

    def measure(self):
        """Returns the last known positions and velocities."""
        raise NotImplementedError

    def measured_ns(self):
        """When they were measured (time.monotonic_ns); None: now; 0: the arm sends nothing."""
        return None

    def commanded(self):
        """Positions that the arm's own controller commands now, or None if it does not say so."""
        return None

    def move(self, position, velocity, acceleration, at_ns, period):
        """Follow this for `period` seconds; the joints shall be there at `at_ns`."""
        raise NotImplementedError

    def speed_scaling(self):
        """Share of the planned speed that the arm asks for: the engine slows down along the path."""
        return 1.0

    def fault(self):
        """A fault of the hardware, as long as it lasts: joint from 0 or None, the maker's number,
        and its name. None without a fault."""
        return None

    def tool(self, tool, order):
        """Begin an order (`order.action` is messages.OPEN, CLOSE, MOVE or HOME; it has position,
        velocity, force and tolerance) of tool 0 (gripper) or 1 (tool changer)."""

    def tool_status(self, tool):
        """Status of a tool: one of the messages.TOOL_ numbers."""
        return m.TOOL_UNKNOWN

    def tool_feedback(self, tool):
        """Opening (m), force (N) and flags (messages.TOOL_OBJECT and others) of a tool, or None."""
        return None

    def carry(self, payload):
        """The arm carries something else now (messages.Payload)."""

    def set_outputs(self, setpoint):
        """Set outputs: those of `digital_mask` and `analogue_mask`."""

    def inputs(self):
        """Digital inputs as bits, and a list of analogue inputs; None without any."""
        return None

    def sensors(self):
        """Named values of sensors (at most 16, names of at most 24 bytes); NaN is unknown."""
        return {}


READY = m.WELCOME, ""


def wait(reason):
    """An answer of `Robot.begin`: it is getting ready; what it waits for."""
    return m.WAIT, reason


def not_ready(reason):
    """An answer of `Robot.begin`: the arm cannot be moved, and what the operator must do."""
    return m.NOT_READY, reason


def run(arm, robot, stop=lambda: False, ready=lambda: None):
    """Drives `robot` as the arm `cell/arm` until `stop()` is true or SIGINT, SIGTERM or SIGHUP comes;
    calls `ready()` when the driver runs. If the arm moves at the end, it is first braked."""
    from .link import Link

    asked = threading.Event()
    if threading.current_thread() is threading.main_thread():
        # A second signal has no effect, so that it does not interrupt the braking.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, lambda *_: asked.set())
    link, driver = Link(arm), Driver(robot)
    ready()
    turns = 0
    while not (asked.is_set() or stop()):
        if not driver.lock_step or turns % 64 == 63:
            answer_greeting(link, driver)
        if driver.lock_step:
            turns = lock_step(link, driver, turns + 1)
        else:
            wall_period(link, driver)
    leave(link, driver)


def leave(link, driver):
    """Brings the arm to rest, informs the engine, and prints a message if the arm moved."""
    more = FAREWELL if driver.hello else 0
    period = driver.hello.period_ns * 1e-9 if driver.hello else 2e-3
    periods, moves = 0, driver.leave()
    while not driver.resting or more > 0:
        if driver.resting:
            more -= 1
        else:
            periods += 1
        answer_greeting(link, driver)
        if driver.lock_step:
            # Nothing sets the pace any more; the last states get time to be read.
            link.send(driver.step(0, period))
            time.sleep(1e-3 if driver.resting else 0)
        else:
            wall_period(link, driver)
    driver.close()
    if moves:
        print(
            "told to end while the arm moved: braked to rest within the joint limits in "
            f"{periods * period * 1e3:.0f} ms",
            file=sys.stderr,
            flush=True,
        )


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
    while (setpoint := link.next_setpoint()) is not None:
        driver.receive(setpoint, time.monotonic_ns())
    link.send(driver.step(time.monotonic_ns(), period * 1e-9))


def lock_step(link, driver, turns):
    """A period if the engine asks for one; returns the number of turns without a request."""
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
        # A setpoint that was sent before the session began releases no state.
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
