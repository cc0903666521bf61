"""What a robot is told to follow by the kit, in virtual time; as drivers/kit/tests/laws.rs.

    python tests/laws.py [CASES]

Needs nothing but Python. Whatever comes and whoever stalls, no joint leaves its range, its speed,
its acceleration or its jerk, in any period.
"""

import os
import random
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from canter_driver import NearEnds, Robot, messages as m  # noqa: E402
from canter_driver.driver import Driver  # noqa: E402

PERIOD, WATCHDOG = 1_000_000, 50_000_000
UPPER, SPEED, ACCELERATION, JERK = 1.0, 3.0, 15.0, 300.0
CASES = 60


class Strict(Robot):
    """A joint that is at once where it shall be, and checks what it is told."""

    lower, upper = [-UPPER], [UPPER]
    velocity, acceleration, jerk = [SPEED], [ACCELERATION], [JERK]

    def __init__(self):
        self.now = 0.0, 0.0, 0.0

    def measure(self):
        return [self.now[0]], [self.now[1]]

    def move(self, position, velocity, acceleration, at_ns, period):
        (p, v, a), (q, w, b) = self.now, (position[0], velocity[0], acceleration[0])
        said = f"{self.now} {q, w, b}"
        assert abs(q) <= UPPER + 1e-6, said
        assert abs(w) <= SPEED * (1 + 1e-6), said
        assert abs(b) <= ACCELERATION * (1 + 1e-6), said
        assert abs(b - a) <= JERK * period * (1 + 1e-6), said
        assert abs(q - p - (v + w) / 2 * period) <= JERK * period**3 / 12 + 1e-8, said
        self.now = q, w, b


def plan(goals, time):
    """Moves from rest to rest as quickly as a quintic keeps the limits, one after the other."""
    start = 0.0
    for goal in goals:
        d = goal - start
        far = abs(d)
        least = 1.875 * far / SPEED, (5.7736 * far / ACCELERATION) ** 0.5, (60 * far / JERK) ** (1 / 3)
        duration = max(*least, 1e-3)
        if time < duration:
            u, rest = time / duration, 1 - time / duration
            return (
                start + d * u**3 * (10 - 15 * u + 6 * u * u),
                d * 30 * u * u * rest * rest / duration,
                d * 60 * u * rest * (1 - 2 * u) / duration**2,
            )
        time -= duration
        start = goal
    return start, 0.0, 0.0


class Pair:
    """An engine with a plan, and the driver."""

    def __init__(self, goals):
        self.goals, self.driver = goals, Driver(Strict())
        self.begin = self.now = 10**18
        hello = m.Hello(
            protocol=m.PROTOCOL,
            joints=1,
            schema=m.schema_checksum(),
            period_ns=PERIOD,
            watchdog_ns=WATCHDOG,
        )
        ack = self.driver.greet(hello)
        assert ack.verdict == m.WELCOME, bytes(ack.reason)
        # The driver took the session's beginning from the real clock.
        self.driver.received_ns = self.driver.newest_ns = self.now
        self.hello, self.session = hello, ack.session
        self.sequence = self.planned = 0
        self.waiting = []

    def setpoint(self):
        self.sequence += 1
        setpoint = m.Setpoint(protocol=m.PROTOCOL, joints=1, session=self.session)
        setpoint.sequence, setpoint.tick = self.sequence, (self.now - self.begin) // PERIOD
        setpoint.published_ns = setpoint.tick_ns = self.now
        setpoint.period_ns, setpoint.watchdog_ns = PERIOD, WATCHDOG
        motion = plan(self.goals, self.planned * 1e-9)
        setpoint.position[0], setpoint.velocity[0], setpoint.acceleration[0] = motion
        return setpoint

    def engine(self):
        self.now += PERIOD
        self.planned += PERIOD
        self.waiting.append(self.setpoint())
        del self.waiting[:-16]

    def drive(self):
        for setpoint in self.waiting:
            self.driver.receive(setpoint, self.now + 400_000)
        self.waiting = []
        return self.driver.step(self.now + 400_000, PERIOD * 1e-9)

    def both(self, periods):
        for _ in range(periods):
            self.engine()
            self.drive()

    def engine_stands(self, periods, leaps):
        for _ in range(periods):
            self.now += PERIOD
            self.planned += PERIOD if leaps else 0
            self.drive()

    def driver_stands(self, periods):
        for _ in range(periods):
            self.engine()

    def assert_latched(self, *faults):
        self.both(1500)
        assert self.driver.state == m.FAULT, self.driver.state
        assert self.driver.fault in faults, self.driver.fault
        rest = self.driver.robot.now
        assert rest[1:] == (0.0, 0.0), rest
        self.both(50)
        assert self.driver.robot.now == rest


class Slow(Strict):
    """The same joint, slower near the ends of its range, which lie a little beyond it. Braking is compared
    with the limit at some places: half a percent is left for what lies between them."""

    near_ends = [NearEnds(-UPPER - 0.008, UPPER + 0.008, 2.585, 0.2)]

    def move(self, position, velocity, acceleration, at_ns, period):
        super().move(position, velocity, acceleration, at_ns, period)
        q, w = self.now[:2]
        room = max(UPPER + 0.008 - (q if w > 0 else -q), 0.0)
        allowed = max((2 * 2.585 * room) ** 0.5 - 0.2, 0.0)
        assert abs(w) <= allowed * 1.005 + 1e-3, f"{q} {w} {allowed}"


class NearTheEnds(unittest.TestCase):
    def test_what_is_followed_is_slower_there(self):
        """References that jump from end to end."""
        for goals in ([0.99, -0.99], [0.5, 0.99, 0.2, -0.98]):
            limiter = Driver(Slow()).limiters[0]
            robot, reference, fastest = Slow(), (0.0, 0.0, 0.0), 0.0
            for goal in goals:
                for _ in range(3000):
                    reference = limiter.approach(reference, (goal, 0.0, 0.0), PERIOD * 1e-9)
                    robot.move(*([value] for value in reference), 0, PERIOD * 1e-9)
                    fastest = max(fastest, abs(reference[1]))
                self.assertAlmostEqual(reference[0], goal, 6)
            self.assertGreater(fastest, 1.0)

    def test_a_stop_is_slow_enough_too(self):
        limiter = Driver(Slow()).limiters[0]
        for moment in range(100, 1500, 70):
            robot, reference = Slow(), (-0.9, 0.0, 0.0)
            robot.now = reference
            for period in range(3000):
                if period < moment:
                    reference = limiter.approach(reference, (0.99, 0.0, 0.0), PERIOD * 1e-9)
                else:
                    reference = limiter.go_on(reference, PERIOD * 1e-9)
                robot.move(*([value] for value in reference), 0, PERIOD * 1e-9)

    def test_a_setpoint_that_is_too_fast_there_is_refused(self):
        for position, speed, refused in (0.9, 0.7, True), (0.9, 0.5, False), (-0.9, 0.7, False):
            driver = Driver(Slow())
            driver.state, driver.hello = m.ACTIVE, m.Hello(period_ns=PERIOD, watchdog_ns=WATCHDOG)
            driver.last.position[0] = position
            joint = driver.unreachable([(position, speed, 0.0)], 1, driver.received_ns)
            self.assertEqual(joint == 0, refused)

    def test_there_is_one_for_each_joint(self):
        robot = Slow()
        robot.near_ends = robot.near_ends * 2
        with self.assertRaises(ValueError):
            Driver(robot)


class Laws(unittest.TestCase):
    def test_undisturbed_setpoints_are_followed_bit_for_bit(self):
        pair = Pair([1.0, -1.0, 0.9, 0.9001, -0.3])
        for _ in range(6000):
            pair.engine()
            sent = pair.waiting[0]
            pair.drive()
            wanted = sent.position[0], sent.velocity[0], sent.acceleration[0]
            self.assertEqual(pair.driver.robot.now, wanted)

    def test_a_stall_of_the_driver_latches(self):
        pair = Pair([1.0, -1.0, 1.0])
        pair.both(400)
        pair.driver_stands(1000)
        pair.drive()
        self.assertEqual(pair.driver.state, m.STOPPING)
        pair.assert_latched(m.STALLED)

    def test_a_kill_while_braking_at_the_end_of_the_range(self):
        for moment in range(10, 900, 23):
            pair = Pair([1.0, -1.0])
            pair.both(moment)
            pair.engine_stands(320, True)
            self.assertEqual(pair.driver.state, m.FAULT)
            pair.assert_latched(m.WATCHDOG)

    def test_an_acceleration_beyond_the_limit_is_refused(self):
        for value, refused in (1e6, True), (-15.1, True), (15.0, False):
            pair = Pair([0.8])
            pair.both(200)
            bad = pair.setpoint()
            bad.acceleration[0] = value
            pair.driver.receive(bad, pair.now)
            self.assertEqual(pair.driver.fault == m.OUT_OF_RANGE, refused)
            self.assertEqual(pair.driver.fault_joint == 0, refused)
            pair.engine_stands(1000, True)
            self.assertEqual(pair.driver.state, m.FAULT)

    def test_the_age_of_a_setpoint_is_its_own(self):
        for change, fault in (-200_000_000, m.WATCHDOG), (60_000_000, m.BAD_SETPOINT):
            pair = Pair([0.8])
            pair.both(200)
            for _ in range(60):
                pair.engine()
                pair.waiting[0].published_ns += change
                pair.drive()
            pair.assert_latched(fault)

    def test_a_session_waits_until_the_arm_rests(self):
        pair = Pair([1.0, -1.0])
        pair.both(300)
        pair.engine_stands(WATCHDOG // PERIOD + 2, False)
        self.assertEqual(pair.driver.greet(pair.hello).verdict, m.WAIT)
        pair.engine_stands(1000, False)
        self.assertEqual(pair.driver.greet(pair.hello).verdict, m.WELCOME)

    def test_an_engine_after_one_that_was_killed_waits(self):
        ended = subprocess.Popen(["true"])
        ended.wait()
        for owner, verdict in (1, m.BUSY), (ended.pid, m.WAIT):
            pair = Pair([1.0, -1.0])
            pair.driver.hello.process = owner
            pair.both(20)
            another = m.Hello.from_buffer_copy(pair.hello)
            another.process = os.getpid()
            ack = pair.driver.greet(another)
            self.assertEqual(ack.verdict, verdict)
            self.assertIn(f"process {owner}".encode(), bytes(ack.reason))

    def test_a_driver_that_leaves_brakes_first(self):
        pair = Pair([1.0, -1.0])
        pair.both(300)
        self.assertTrue(pair.driver.leave())
        pair.assert_latched(m.ENDED)
        self.assertFalse(pair.driver.leave())
        self.assertEqual(pair.driver.greet(pair.hello).verdict, m.NOT_READY)

    def test_the_plan_is_joined_again(self):
        for stall, leaps in (5, True), (5, False), (40, True), (40, False):
            for moment in 100, 400:
                pair = Pair([0.9, -0.9, 0.5])
                pair.both(moment)
                pair.engine_stands(stall, leaps)
                pair.both(4000)
                self.assertEqual(pair.driver.state, m.ACTIVE)
                self.assertEqual(pair.driver.robot.now, (0.5, 0.0, 0.0))

    def test_limits_hold_whatever_comes(self):
        for seed in range(CASES):
            self.limits_hold(random.Random(seed))

    def limits_hold(self, some):
        goals = [some.choice([1.0, -1.0, some.uniform(-1, 1)]) for _ in range(6)]
        pair = Pair(goals)
        pair.both(5)
        for _ in range(some.randint(1, 4)):
            pair.both(some.randint(1, 600))
            following = pair.driver.state == m.ACTIVE
            silence = some.choice([some.randint(1, 49), some.randint(51, 1000)])
            what = some.randrange(3)
            if what == 0:
                pair.engine_stands(silence, some.random() < 0.5)
            elif what == 1:
                pair.driver_stands(silence)
                pair.drive()
            else:
                bad = pair.setpoint()
                bad.position[0] += some.uniform(-4e-3, 4e-3)
                bad.velocity[0] = some.choice([some.uniform(-SPEED, SPEED), 1e300, float("nan")])
                bad.acceleration[0] = some.uniform(-1.1, 1.1) * ACCELERATION
                pair.waiting.append(bad)
                pair.drive()
            if what < 2 and silence > 50 and following:
                pair.assert_latched(m.WATCHDOG, m.STALLED)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        CASES = int(sys.argv.pop())
    unittest.main()
