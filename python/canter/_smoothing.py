"""Smooth motions of a tool through poses."""

from __future__ import annotations

import json
from typing import Any, NamedTuple, Sequence, Union

from . import _canter
from ._arrays import Array, Numbers, array, poses
from ._robots import ToolLimits


class ToolStates(NamedTuple):
    """A tool at one time, or at many (n,): in front of the shapes below."""

    pose: Array
    """Poses (4, 4)."""
    linear: Array
    """Velocity, acceleration and jerk of the point (3, 3): m/s, m/s2, m/s3."""
    angular: Array
    """Angular velocity, acceleration and jerk (3, 3): rad/s, rad/s2, rad/s3."""


class SmoothMotion:
    """A certified motion through poses, at rest at both ends."""

    def __init__(self, own: _canter.Smooth) -> None:
        self._own = own

    def __repr__(self) -> str:
        return f"SmoothMotion(duration={self.duration}, method={self.method!r})"

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self._own.duration

    @property
    def exact_stop(self) -> float:
        """How long it would last with a stop at each pose, s."""
        return self._own.exact_stop

    @property
    def method(self) -> str:
        """How it was planned: "spline", "fit" (a dense list), "exact-stop" or "still"."""
        return self._own.method

    @property
    def certificate(self) -> dict[str, Any]:
        """What holds for all times: `holds`, `in_order`, `lower_bound_s`, and for `corridor`,
        `speed`, `acceleration`, `jerk` and the angular ones the highest `ratio` to the limit, for `jump`
        to what rounding may make of it."""
        found: dict[str, Any] = json.loads(self._own.certificate())
        return found

    @property
    def crossings(self) -> dict[str, Array]:
        """How each intermediate pose is passed, arrays (n,): `deviation` and `tolerance` (m), `angle`
        and `angular_tolerance` (rad), `time` (s)."""
        names = ("deviation", "tolerance", "angle", "angular_tolerance", "time")
        return dict(zip(names, self._own.crossings().T))

    def at(self, time: Numbers) -> ToolStates:
        """The tool at a time (s), or at many times (n,)."""
        times = array(time, "time")
        found = self._own.sample(times.reshape(-1))
        return ToolStates(*(part.reshape(*times.shape, *part.shape[1:]) for part in found))


def smooth(
    through: Numbers,
    tolerance: float,
    limits: Union[ToolLimits, Sequence[float]],
    *,
    corridor: float | None = None,
    angular_tolerance: float | None = None,
) -> SmoothMotion:
    """The fastest motion that can be certified from the first of the poses to the last, which passes
    those between in order, each within `tolerance` (m), without stopping.

    Poses are (n, 4, 4) or (n, 7). `limits` are those of `Robot.tool_limits`, or six numbers: speed,
    acceleration, jerk (m), angular speed, angular acceleration, angular jerk (rad). The tool stays
    within `corridor` (m; the tolerance unless given) of the straight legs. `angular_tolerance` (rad)
    is the tolerance / 50 mm, at most 0.2, unless given.

    >>> import canter
    >>> corner = [canter.pose([x, y, 0]) for x, y in [(0, 0), (0.1, 0), (0.1, 0.1)]]
    >>> motion = canter.smooth(corner, 0.001, [0.5, 5, 100, 2, 20, 400])
    >>> motion.certificate["holds"], bool(motion.crossings["deviation"][0] <= 0.001)
    (True, True)
    """
    found = poses(through, "through")
    if found.ndim != 3:
        raise ValueError(f"through: expected (n, 4, 4) or (n, 7), got shape {found.shape}")
    if isinstance(limits, ToolLimits):
        limits = [
            limits.speed,
            limits.acceleration,
            limits.jerk,
            limits.angular_speed,
            limits.angular_acceleration,
            limits.angular_jerk,
        ]
    numbers = array(limits, "limits")
    if numbers.shape != (6,):
        raise ValueError(f"limits: expected six numbers, got shape {numbers.shape}")
    choices = {
        "tolerance": float(tolerance),
        "limits": numbers.tolist(),
        "corridor": corridor,
        "angular_tolerance": angular_tolerance,
    }
    return SmoothMotion(_canter.smooth(found, choices))
