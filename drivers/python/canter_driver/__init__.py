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

__all__ = ["Robot", "run"]

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

    def measure(self):
        """Returns the present positions and velocities."""
        raise NotImplementedError

    def move(self, position, velocity, acceleration, period):
        """Follow this for `period` seconds."""
        raise NotImplementedError

    def tool(self, tool, action):
        """Begin an action (messages.OPEN or CLOSE) of tool 0 (gripper) or 1 (tool changer)."""

    def tool_status(self, tool):
        """Status of a tool: one of the messages.TOOL_ numbers."""
        return m.TOOL_UNKNOWN


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
