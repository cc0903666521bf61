"""The limiter of a joint: its reference keeps the limits, whatever setpoint is received.

The same law as `drivers/kit/src/limiter.rs`, where it is explained. A reference is position (rad),
velocity (rad/s) and acceleration (rad/s2) of one joint.
"""

from math import copysign, sqrt

# Tolerance for rounding: as a fraction of a limit, in rad and rad/s, and at an end of the range in rad.
ROUNDING, SMALL, AT_END = 1e-3, 1e-9, 1e-6

# Fraction of the jerk limit, and least fraction of the acceleration limit, used to approach the
# target; the rest is for the motion of the target itself.
CLOSING = 0.3, 0.2

# Places at which braking is compared with the speed that is allowed near an end, in each of its two parts.
PARTS = 8

# Bisection steps for an end of the range; steps for a target, and its precision (rad).
COARSE, STEPS, CLOSE = 16, 12, 1e-11


def after(reference, time, jerk):
    """A reference after `time` (s) with a constant `jerk` (rad/s3)."""
    p, v, a = reference
    return (
        p + (v + (a / 2 + jerk * time / 6) * time) * time,
        v + (a + jerk * time / 2) * time,
        a + jerk * time,
    )


def ramp(reference, speed, acceleration, jerk):
    """The fastest motion to a constant speed: three phases, each a time (s) and a jerk (rad/s3)."""
    _, v, a = reference
    toward = 1.0 if speed >= v + a * abs(a) / (2 * jerk) else -1.0
    missing, now = toward * (speed - v), toward * a
    peak, hold = sqrt(max(jerk * missing + now * now / 2, 0.0)), 0.0
    if peak > acceleration:
        peak = acceleration
        gained = abs(peak * peak - now * now) / (2 * jerk)
        hold = max((missing - gained) / peak - peak / (2 * jerk), 0.0)
    first = jerk if peak >= now else -jerk
    return (
        (abs(peak - now) / jerk, toward * first),
        (hold, 0.0),
        (peak / jerk, -toward * jerk),
    )


def sample(reference, speed, acceleration, jerk, time):
    """State of the joint `time` (s) after the start of the fastest motion to a constant speed."""
    for duration, change in ramp(reference, speed, acceleration, jerk):
        if time <= duration:
            return after(reference, time, change)
        reference = after(reference, duration, change)
        time -= duration
    return reference[0] + speed * time, speed, 0.0


def end(reference, acceleration, jerk):
    """Position (rad) at which the joint rests if it stops as fast as it can."""
    for duration, change in ramp(reference, 0.0, acceleration, jerk):
        reference = after(reference, duration, change)
    return reference[0]


def top(reference, speed, acceleration, jerk):
    """The highest position (rad) of the fastest motion to a constant speed."""
    highest = reference[0]
    for duration, change in ramp(reference, speed, acceleration, jerk):
        _, v, a = reference
        turns = ()
        if change:
            square = a * a - 2 * change * v
            if square >= 0:
                root = sqrt(square)
                turns = ((-root - a) / change, (root - a) / change)
        elif a:
            turns = (-v / a,)
        for time in turns:
            if 0 < time < duration:
                highest = max(highest, after(reference, time, change)[0])
        reference = after(reference, duration, change)
        highest = max(highest, reference[0])
    return highest


def mixed(low, high, share):
    """A mixture of two references: `share` of `high`, the rest of `low`."""
    return tuple(a + (b - a) * share for a, b in zip(low, high))


def zero_share(beyond):
    """The share in 0..1 at which `beyond`, which grows, is zero, or the nearest to that.

    The Illinois method, which needs a few steps where halving needs dozens: a period is short.
    """
    low, high = 0.0, 1.0
    under, over = beyond(low), beyond(high)
    if under >= 0:
        return low
    if over <= 0:
        return high
    side = 0
    for _ in range(STEPS):
        share = (low * over - high * under) / (over - under)
        found = beyond(share)
        if abs(found) < CLOSE:
            return share
        if found > 0:
            high, over = share, found
            under *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, under = share, found
            over *= 0.5 if side < 0 else 1.0
            side = -1
    return low


def before_share(is_beyond):
    """The largest share in 0..1 for which `is_beyond` is false; above it, it is true."""
    low, high = 0.0, 1.0
    for _ in range(COARSE):
        middle = (low + high) / 2
        if is_beyond(middle):
            high = middle
        else:
            low = middle
    return low


class NearEnds:
    """Less speed near the ends of the range of one joint: towards an end (rad) at the distance `x` it may
    have the speed `sqrt(2 deceleration x) - offset` (rad/s2, rad/s). The ends may lie beyond the range."""

    def __init__(self, lower, upper, deceleration, offset):
        self.lower, self.upper = lower, upper
        self.deceleration, self.offset = deceleration, offset

    def upwards(self, position):
        """The largest speed (rad/s) upwards at a position (rad)."""
        return self.allowed(self.upper - position)

    def downwards(self, position):
        """The largest speed (rad/s) downwards at a position (rad)."""
        return self.allowed(position - self.lower)

    def allowed(self, room):
        """The largest speed (rad/s) towards an end that is `room` (rad) away; at least 0."""
        return max(sqrt(2 * self.deceleration * max(room, 0.0)) - self.offset, 0.0)


class Limiter:
    """The limits of one joint."""

    def __init__(self, lower, upper, velocity, acceleration, jerk, near_ends=None):
        self.lower, self.upper = lower, upper
        self.near_ends = near_ends
        self.velocity, self.acceleration, self.jerk = velocity, acceleration, jerk

    def speed(self, position, velocity):
        """The largest speed (rad/s) at a position (rad) in the direction of `velocity`."""
        if self.near_ends is None:
            return self.velocity
        near = self.near_ends
        allowed = near.downwards(position) if velocity < 0 else near.upwards(position)
        return min(self.velocity, allowed)

    def approach(self, reference, target, period):
        """One period (s) towards `target`, the wanted state at its end."""
        if self.follows(reference, target, period):
            return target
        low, high = self.extremes(reference, period)
        closing = max(self.acceleration - abs(target[2]), CLOSING[1] * self.acceleration)
        jerk = CLOSING[0] * self.jerk

        def beyond(share):
            """The distance beyond the target at which its rate, braked from now on, reaches zero."""
            now = mixed(low, high, share)
            return end(tuple(a - b for a, b in zip(now, target)), closing, jerk)

        return self.within_range(low, high, zero_share(beyond))

    def go_on(self, reference, period):
        """One period (s) without a new setpoint: braking continues, a constant speed is kept, and
        the joint brakes early enough to rest within the range."""
        _, v, a = reference
        if a * v < 0:
            force = min(abs(a), self.acceleration)
            following = sample(reference, 0.0, force, self.jerk, period)
        else:
            speed = v + copysign(a * a / (2 * self.jerk), a)
            speed = min(max(speed, -self.velocity), self.velocity)
            following = sample(reference, speed, self.acceleration, self.jerk, period)
        rest = end(following, self.acceleration, self.jerk)
        if rest < self.lower or rest > self.upper:
            return self.stop(reference, period)
        return self.or_brake(reference, following, period)

    def stop(self, reference, period):
        """One period (s) of the fastest stop within the range."""
        following = sample(reference, 0.0, self.acceleration, self.jerk, period)
        return self.or_brake(reference, following, period)

    def or_brake(self, reference, following, period):
        """`following`, or the hardest braking if only that stays within the range."""
        if not self.stays_below(following, AT_END):
            return self.extremes(reference, period)[0]
        if not self.stays_above(following, AT_END):
            return self.extremes(reference, period)[1]
        return following

    def extremes(self, reference, period):
        """The lowest and the highest that can be reached in a period (s)."""
        a, j = self.acceleration, self.jerk
        return [sample(reference, v, a, j, period) for v in (-self.velocity, self.velocity)]

    def follows(self, reference, target, period):
        """Whether `target` is a motion of one period (s) from `reference` within all limits, after
        which they can still be kept."""
        (p, v, a), (q, w, b) = reference, target
        room = 1 + ROUNDING
        jerk, most = self.jerk * room * period, self.acceleration * room * period
        return (
            abs(w) <= self.velocity * room
            and abs(b) <= self.acceleration * room
            and abs(b - a) <= jerk + SMALL
            and abs(w - v - (a + b) * period / 2) <= jerk * period / 4 + SMALL
            and abs(q - p - (v + w) * period / 2) <= jerk * period * period / 12 + SMALL
            # Differences of positions keep the acceleration limit too: a controller may measure these.
            and abs(w - v) <= most + SMALL
            and abs(q - p - v * period) <= most * period / 2 + SMALL
            and abs(q - p - w * period) <= most * period / 2 + SMALL
            and self.stays_below(target, AT_END)
            and self.stays_above(target, AT_END)
        )

    def within_range(self, low, high, share):
        """The mixture that is nearest to `share` and can stay within the range."""
        wanted = mixed(low, high, share)
        if not self.stays_below(wanted, 0.0):
            passes = lambda part: not self.stays_below(mixed(low, high, part * share), 0.0)
            return mixed(low, high, before_share(passes) * share)
        if not self.stays_above(wanted, 0.0):
            rest = 1 - share
            passes = lambda part: not self.stays_above(mixed(low, high, 1 - part * rest), 0.0)
            return mixed(low, high, 1 - before_share(passes) * rest)
        return wanted

    def most(self, v, a):
        """The largest distance (rad) that fading and braking together take."""
        speed = abs(v) + a * a / (2 * self.jerk)
        return speed * (speed / (2 * self.acceleration) + 2 * self.acceleration / self.jerk)

    def stays_below(self, reference, room):
        """Whether the hardest braking stays below the upper end plus `room` (rad), and slow enough before it."""
        p, v, a = reference
        most = self.most(v, a)
        inside = p + most <= self.upper or (
            top(reference, -self.velocity, self.acceleration, self.jerk) <= self.upper + room
        )
        near = self.near_ends
        return inside and (near is None or self.slow_enough(reference, most, near.upwards))

    def stays_above(self, reference, room):
        """Whether the hardest braking stays above the lower end minus `room` (rad), and slow enough before it."""
        p, v, a = reference
        most, mirror = self.most(v, a), (-p, -v, -a)
        inside = p - most >= self.lower or (
            top(mirror, -self.velocity, self.acceleration, self.jerk) <= room - self.lower
        )
        near = self.near_ends
        return inside and (near is None or self.slow_enough(mirror, most, lambda p: near.downwards(-p)))

    def slow_enough(self, reference, most, allowed):
        """Whether the hardest braking, which goes no farther than `most` (rad), keeps the speed that is
        `allowed` (rad/s) at each place above."""
        p, v, a = reference
        speed = abs(v) + a * a / (2 * self.jerk)
        if speed <= allowed(p + most):
            return True
        turns = 2 * self.acceleration / self.jerk
        braked = turns + speed / self.acceleration
        # First where the braking builds up, then where it lasts.
        times = [turns * part / PARTS for part in range(PARTS)]
        times += [turns + (braked - turns) * part / PARTS for part in range(PARTS + 1)]
        bounds = -self.velocity, self.acceleration, self.jerk
        for time in times:
            q, w, _ = sample(reference, *bounds, time)
            if w > allowed(q) + SMALL:
                return False
        return True
