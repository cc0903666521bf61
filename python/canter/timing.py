"""Time laws: the fastest motion along a path within limits of velocity, acceleration and jerk.

`time_path` is the plain function. The classes have the names and methods of toppra, so that its
programs run with another import:

    from canter import timing as toppra          # toppra.SplineInterpolator, toppra.constraint, ...

What differs: `compute_trajectory` raises `canter.TimingError` with the reason instead of returning
None; jerk can be limited (`constraint.JointJerkConstraint`); the result is certified for all times.
Paths are natural cubic splines (toppra's `bc_type="natural"`).
"""

from __future__ import annotations

import json
from typing import Any, Iterable

import numpy as np

from . import _canter
from ._arrays import Array, Numbers, array, per_joint
from .otg import State

__all__ = ["SplineInterpolator", "TimedPath", "algorithm", "constraint", "time_path"]


class TimedPath:
    """A path with its time law."""

    def __init__(self, own: _canter.Timed) -> None:
        self._own = own

    def __repr__(self) -> str:
        return f"TimedPath(dof={self.dof}, duration={self.duration})"

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._own.dof

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self._own.duration

    @property
    def path_interval(self) -> Array:
        """First and last time (2,), s."""
        return np.array([0.0, self.duration])

    @property
    def certificate(self) -> dict[str, Any]:
        """What holds for all times: `holds`, `lower_bound_s`, `fit_error_rad` (distance from the
        path), `peaks` (each limit with its highest `ratio` and `time_s`)."""
        found: dict[str, Any] = json.loads(self._own.certificate())
        return found

    def at(self, time: Numbers) -> State:
        """Position, velocity, acceleration and jerk at a time (s), or at many times (n,)."""
        times = array(time, "time")
        found = self._own.sample(times.reshape(-1))
        return State(*found.reshape(4, *times.shape, self.dof))

    def __call__(self, time: Numbers, order: int = 0) -> Array:
        """The derivative of this order, 0 to 3, at a time or at many: toppra's form."""
        if order not in (0, 1, 2, 3):
            raise ValueError(f"order: expected 0 to 3, got {order}")
        return self.at(time)[order]

    def parameter(self, time: Numbers) -> tuple[Array, Array]:
        """Path parameter and its rate (1/s) at times."""
        times = array(time, "time")
        found = self._own.parameter(times.reshape(-1)).reshape(*times.shape, 2)
        return found[..., 0], found[..., 1]


def time_path(
    waypoints: Numbers,
    *,
    velocity: Numbers,
    acceleration: Numbers,
    jerk: Numbers | None = None,
    knots: Numbers | None = None,
    start_rate: float = 0.0,
    rate_cap: float | None = None,
    gap: float = 1e-3,
) -> TimedPath:
    """The fastest motion along the natural cubic spline through `waypoints` (n, dof), rad.

    Limits are numbers or (dof,): rad/s, rad/s2, rad/s3. Without `jerk`, accelerations build up within
    a millisecond: a jerk of 1000/s times the acceleration. The spline is at
    waypoint i where its parameter is `knots[i]`: 0, 1, 2 ... unless given. It starts with
    `start_rate` (parameter per s) and ends at rest. The search ends when the duration is within `gap`
    of the best.

    Raises `TimingError` with joint, quantity and value.

    >>> import canter
    >>> path = canter.time_path([[0, 0], [1, 0.5], [0, 1]], velocity=1, acceleration=5, jerk=50)
    >>> path.certificate["holds"]
    True
    """
    points = array(waypoints, "waypoints")
    if points.ndim != 2:
        raise ValueError(f"waypoints: expected (n, dof), got shape {points.shape}")
    dof = points.shape[1]
    at = np.arange(len(points), dtype=np.float64) if knots is None else array(knots, "knots")
    if at.shape != (len(points),):
        raise ValueError(f"knots: expected ({len(points)},), got shape {at.shape}")
    push = per_joint(acceleration, dof, "acceleration", np.inf)
    snap = 1000 * push if jerk is None else per_joint(jerk, dof, "jerk", np.inf)
    limits = np.stack([per_joint(velocity, dof, "velocity", np.inf), push, snap])
    choices = {
        "start_rate": float(start_rate),
        "start_acceleration": 0.0,
        "rate_cap": rate_cap,
        "fit": 1e-8,
        "gap": float(gap),
    }
    return TimedPath(_canter.time_path(points, at, limits, choices))


class SplineInterpolator:
    """The natural cubic spline through `waypoints` (n, dof) at path positions `ss_waypoints` (n,)."""

    def __init__(
        self, ss_waypoints: Numbers, waypoints: Numbers, bc_type: str = "natural"
    ) -> None:
        if bc_type != "natural":
            raise ValueError(f'bc_type: expected "natural", got {bc_type!r}')
        self._first = float(array(ss_waypoints, "ss_waypoints")[0])
        self.ss_waypoints = array(ss_waypoints, "ss_waypoints") - self._first
        self.waypoints = array(waypoints, "waypoints")

    @property
    def dof(self) -> int:
        """Number of joints."""
        return int(self.waypoints.shape[1])

    @property
    def path_interval(self) -> Array:
        """First and last path position (2,)."""
        return self._first + np.array([0.0, self.ss_waypoints[-1]])


class _Limits:
    """Limits of all joints, the same in both directions."""

    def __init__(self, limits: Numbers, quantity: str) -> None:
        found = array(limits, quantity)
        if found.ndim == 2 and found.shape[1] == 2:
            if not np.array_equal(found[:, 0], -found[:, 1]):
                raise ValueError(f"{quantity}: expected the same limit in both directions")
            found = np.ascontiguousarray(found[:, 1])
        if found.ndim != 1:
            raise ValueError(f"{quantity}: expected (dof,) or (dof, 2), got shape {found.shape}")
        self.quantity, self.limits = quantity, found


class constraint:
    """The constraints of `algorithm.TOPPRA`."""

    class JointVelocityConstraint(_Limits):
        """Velocities (dof,) or (dof, 2), rad/s."""

        def __init__(self, vlim: Numbers) -> None:
            super().__init__(vlim, "velocity")

    class JointAccelerationConstraint(_Limits):
        """Accelerations (dof,) or (dof, 2), rad/s2."""

        def __init__(self, alim: Numbers, **_: Any) -> None:
            super().__init__(alim, "acceleration")

    class JointJerkConstraint(_Limits):
        """Jerks (dof,) or (dof, 2), rad/s3. toppra has none."""

        def __init__(self, jlim: Numbers) -> None:
            super().__init__(jlim, "jerk")


class algorithm:
    """The algorithm, under toppra's name."""

    class TOPPRA:
        """A path with the limits along it."""

        def __init__(
            self, constraint_list: Iterable[_Limits], path: SplineInterpolator, **_: Any
        ) -> None:
            self.path = path
            self._limits = {limits.quantity: limits.limits for limits in constraint_list}
            for needed in ("velocity", "acceleration"):
                if needed not in self._limits:
                    raise ValueError(f"expected a constraint of the {needed}")

        def compute_trajectory(self, sd_start: float = 0.0, sd_end: float = 0.0) -> TimedPath:
            """The fastest motion; `sd_end` must be 0. Raises `TimingError` where there is none."""
            if sd_end != 0:
                raise ValueError("sd_end: expected 0, a motion ends at rest")
            return time_path(
                self.path.waypoints,
                knots=self.path.ss_waypoints,
                start_rate=sd_start,
                velocity=self._limits["velocity"],
                acceleration=self._limits["acceleration"],
                jerk=self._limits.get("jerk"),
            )
