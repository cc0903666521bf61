"""State-to-state motions: the fastest from any state to any other within limits of velocity,
acceleration and jerk.

`move` is the plain function. The classes have the names and fields of Ruckig, so that its programs
run with another import:

    from canter.otg import InputParameter, OutputParameter, Result, Ruckig, Trajectory

What differs: errors are exceptions (`canter.OtgError`) with joint, quantity, value and limit, not
numbers to compare; an arm has at most eight joints; there is no control of intermediate waypoints.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Any, Iterable, NamedTuple, Sequence

import numpy as np

from . import _canter
from ._arrays import Array, Numbers, array, per_joint
from .errors import OtgError

__all__ = [
    "ControlInterface",
    "InputParameter",
    "Motion",
    "OutputParameter",
    "Result",
    "Ruckig",
    "State",
    "Synchronization",
    "Trajectory",
    "durations",
    "move",
    "states_at",
]


class State(NamedTuple):
    """Position, velocity, acceleration and jerk, each (dof,) or (n, dof): rad, rad/s, rad/s2, rad/s3."""

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array


class Motion:
    """A planned motion from state to state."""

    def __init__(self, own: _canter.Motion) -> None:
        self._own = own

    def __repr__(self) -> str:
        return f"Motion(dof={self.dof}, duration={self.duration})"

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._own.dof

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self._own.duration

    @property
    def arrivals(self) -> Array:
        """When each joint arrives (dof,), s."""
        return self._own.arrivals

    @property
    def is_straight(self) -> bool:
        """Whether it is a straight line in joint space."""
        return self._own.is_straight

    def at(self, time: Numbers) -> State:
        """The state at a time (s), or at many times (n,). After the end the joints go on with the
        target's velocity and acceleration."""
        times = array(time, "time")
        found = self._own.sample(times.reshape(-1))
        shape = (4, *times.shape, self.dof)
        return State(*found.reshape(shape))

    def pieces(self) -> tuple[Array, Array]:
        """Durations (k,) of its pieces of constant jerk and their coefficients (k, dof, 6), lowest
        power first, each over the time since the start of its piece."""
        return self._own.pieces()


def _limits(
    dof: int,
    velocity: Numbers,
    acceleration: Numbers,
    jerk: Numbers | None,
    position: Any,
    lowest: tuple[Numbers | None, Numbers | None] = (None, None),
) -> Array:
    top = per_joint(velocity, dof, "velocity", np.inf)
    push = per_joint(acceleration, dof, "acceleration", np.inf)
    lower, upper = (None, None) if position is None else position
    return np.stack(
        [
            per_joint(lower, dof, "position", -np.inf),
            per_joint(upper, dof, "position", np.inf),
            -top if lowest[0] is None else per_joint(lowest[0], dof, "min_velocity", -np.inf),
            top,
            -push if lowest[1] is None else per_joint(lowest[1], dof, "min_acceleration", -np.inf),
            push,
            per_joint(jerk, dof, "jerk", np.inf),
        ]
    )


def _choices(
    dof: int,
    synchronisation: str,
    minimum_duration: float,
    period: float | None,
    velocity_only: Sequence[bool] | None = None,
    enabled: Sequence[bool] | None = None,
) -> dict[str, Any]:
    return {
        "synchronisation": synchronisation,
        "velocity_only": [False] * dof if velocity_only is None else list(velocity_only),
        "enabled": [True] * dof if enabled is None else list(enabled),
        "minimum_duration": float(minimum_duration),
        "period": None if period is None else float(period),
        "at": None,
        "threads": 0,
    }


def move(
    start: Numbers,
    target: Numbers,
    *,
    velocity: Numbers,
    acceleration: Numbers,
    jerk: Numbers | None = None,
    start_velocity: Numbers | None = None,
    start_acceleration: Numbers | None = None,
    target_velocity: Numbers | None = None,
    target_acceleration: Numbers | None = None,
    position: tuple[Numbers, Numbers] | None = None,
    synchronisation: str = "time",
    minimum_duration: float = 0.0,
    period: float | None = None,
) -> Motion:
    """The fastest motion from `start` to `target`, both (dof,), rad.

    Limits are numbers or (dof,): `velocity` rad/s, `acceleration` rad/s2, `jerk` rad/s3 (none: not
    limited), `position` (lowest, highest) rad. Velocities and accelerations of start and target are 0
    unless given. `synchronisation` is "time" (all joints arrive together), "phase" (along a straight
    line, `OtgError` where there is none), "phase-if-possible" or "none". With `period` (s) the
    duration is a whole number of periods.

    >>> import canter
    >>> motion = canter.move([0, 0], [1, 0.5], velocity=1, acceleration=5, jerk=50)
    >>> round(motion.duration, 6), motion.at(motion.duration).position
    (1.3, array([1. , 0.5]))
    """
    begin = array(start, "start")
    if begin.ndim != 1:
        raise ValueError(f"start: expected (dof,), got shape {begin.shape}")
    dof = len(begin)
    states = np.stack(
        [
            begin,
            per_joint(start_velocity, dof, "start_velocity", 0.0),
            per_joint(start_acceleration, dof, "start_acceleration", 0.0),
            per_joint(target, dof, "target", 0.0),
            per_joint(target_velocity, dof, "target_velocity", 0.0),
            per_joint(target_acceleration, dof, "target_acceleration", 0.0),
        ]
    )
    limits = _limits(dof, velocity, acceleration, jerk, position)
    choices = _choices(dof, synchronisation, minimum_duration, period)
    return Motion(_canter.otg(states, limits, choices))


def _batch(
    states: Numbers, at: float | None, threads: int | None, given: dict[str, Any]
) -> tuple[Array, Array | None]:
    rows = array(states, "states")
    if rows.ndim != 3 or rows.shape[1] != 6:
        raise ValueError(f"states: expected (n, 6, dof), got shape {rows.shape}")
    dof = rows.shape[2]
    limits = _limits(dof, given["velocity"], given["acceleration"], given["jerk"], given["position"])
    choices = _choices(dof, given["synchronisation"], 0.0, given["period"])
    choices.update(at=at, threads=threads or 0)
    return _canter.otg_batch(rows, limits, choices)


def durations(
    states: Numbers,
    *,
    velocity: Numbers,
    acceleration: Numbers,
    jerk: Numbers | None = None,
    position: tuple[Numbers, Numbers] | None = None,
    synchronisation: str = "time",
    period: float | None = None,
    threads: int | None = None,
) -> Array:
    """Durations (n,), s, of many motions within the same limits, on all processors.

    `states` (n, 6, dof) are position, velocity and acceleration of each start, then of each target.
    Raises `OtgError` with the `index` of the first motion that does not exist.
    """
    return _batch(states, None, threads, locals())[0]


def states_at(
    states: Numbers,
    time: float,
    *,
    velocity: Numbers,
    acceleration: Numbers,
    jerk: Numbers | None = None,
    position: tuple[Numbers, Numbers] | None = None,
    synchronisation: str = "time",
    period: float | None = None,
    threads: int | None = None,
) -> tuple[Array, State]:
    """As `durations`, and the state of each motion at `time` (s) after its start, each (n, dof)."""
    durations, found = _batch(states, float(time), threads, locals())
    assert found is not None
    return durations, State(*np.moveaxis(found, 1, 0))


class Result(IntEnum):
    """What a step of `Ruckig.update` gives. Errors are exceptions, so there are no negative ones."""

    Working = 0
    Finished = 1


class ControlInterface(Enum):
    """What of the target has to be reached."""

    Position = "position"
    Velocity = "velocity"


class Synchronization(Enum):
    """How the joints share time."""

    Time = "time"
    TimeIfNecessary = "time-if-necessary"
    Phase = "phase-if-possible"
    No = "none"


class InputParameter:
    """A problem with the fields of Ruckig's class: lists or arrays with one number for each joint."""

    def __init__(self, dofs: int) -> None:
        self.degrees_of_freedom = dofs
        self.control_interface = ControlInterface.Position
        self.synchronization = Synchronization.Time
        self.current_position: Any = [0.0] * dofs
        self.current_velocity: Any = [0.0] * dofs
        self.current_acceleration: Any = [0.0] * dofs
        self.target_position: Any = [0.0] * dofs
        self.target_velocity: Any = [0.0] * dofs
        self.target_acceleration: Any = [0.0] * dofs
        self.max_velocity: Any = [0.0] * dofs
        self.max_acceleration: Any = [0.0] * dofs
        self.max_jerk: Any = [np.inf] * dofs
        self.min_velocity: Any = None
        self.min_acceleration: Any = None
        self.max_position: Any = None
        self.min_position: Any = None
        self.enabled: Any = [True] * dofs
        self.minimum_duration: float | None = None

    def _states(self) -> Array:
        rows = (
            self.current_position,
            self.current_velocity,
            self.current_acceleration,
            self.target_position,
            self.target_velocity,
            self.target_acceleration,
        )
        found = np.array(rows, dtype=np.float64)
        if found.shape != (6, self.degrees_of_freedom):
            raise ValueError(f"expected {self.degrees_of_freedom} numbers in each state")
        return found

    def _motion(self, period: float | None) -> Motion:
        dof = self.degrees_of_freedom
        only_velocity = self.control_interface is ControlInterface.Velocity
        if self.synchronization is not Synchronization.TimeIfNecessary:
            # Plain numbers are read as they are; anything else goes through arrays, and errors too.
            kind = (self.synchronization._value_, only_velocity)
            own = _canter.otg_of(self.__dict__, dof, kind, period)
            if own is not None:
                return Motion(own)
        limits = _limits(
            dof,
            self.max_velocity,
            self.max_acceleration,
            self.max_jerk,
            (self.min_position, self.max_position),
            (self.min_velocity, self.min_acceleration),
        )
        if self.synchronization is Synchronization.TimeIfNecessary:
            raise OtgError(
                "synchronization TimeIfNecessary: expected Time, Phase or No",
                quantity="synchronization",
            )
        choices = _choices(
            dof,
            self.synchronization.value,
            self.minimum_duration or 0.0,
            period,
            [only_velocity] * dof,
            self.enabled,
        )
        return Motion(_canter.otg(self._states(), limits, choices))


class Trajectory:
    """A trajectory with the methods of Ruckig's class. `Ruckig.calculate` fills it."""

    def __init__(self, dofs: int) -> None:
        self.degrees_of_freedom = dofs
        self._motion: Motion | None = None

    @property
    def motion(self) -> Motion:
        """The motion; `OtgError` before `Ruckig.calculate`."""
        if self._motion is None:
            raise OtgError("the trajectory has not been calculated")
        return self._motion

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        motion = self._motion
        return self.motion.duration if motion is None else motion._own.duration

    @property
    def independent_min_durations(self) -> list[float]:
        """When each joint arrives, s."""
        return list(self.motion.arrivals)

    def at_time(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Positions, velocities and accelerations at `time` (s)."""
        state = self.motion.at(time)
        return state.position.tolist(), state.velocity.tolist(), state.acceleration.tolist()


class OutputParameter:
    """The state of one control cycle, with the fields of Ruckig's class."""

    def __init__(self, dofs: int) -> None:
        self.degrees_of_freedom = dofs
        self.trajectory = Trajectory(dofs)
        self.new_position: Any = [0.0] * dofs
        self.new_velocity: Any = [0.0] * dofs
        self.new_acceleration: Any = [0.0] * dofs
        self.time = 0.0
        self.new_calculation = False

    def pass_to_input(self, inp: InputParameter) -> None:
        """Makes this state the start of the next cycle."""
        inp.current_position = list(self.new_position)
        inp.current_velocity = list(self.new_velocity)
        inp.current_acceleration = list(self.new_acceleration)


class Ruckig:
    """Plans offline (`calculate`) and in every control cycle (`update`), as Ruckig does."""

    def __init__(self, dofs: int, delta_time: float | None = None) -> None:
        self.degrees_of_freedom = dofs
        self.delta_time = delta_time
        self._planned: tuple[Any, ...] | None = None

    def calculate(self, inp: InputParameter, trajectory: Trajectory) -> Result:
        """Plans the motion into `trajectory`. Raises `OtgError` where there is none."""
        trajectory._motion = inp._motion(None)
        return Result.Working

    def validate_input(self, inp: InputParameter) -> bool:
        """True if there is a motion. Raises `OtgError` with the reason if not."""
        inp._motion(None)
        return True

    def reset(self) -> None:
        """Plans anew in the next cycle."""
        self._planned = None

    def update(self, inp: InputParameter, out: OutputParameter) -> Result:
        """One control cycle: plans if target, limits or state are new, and steps `delta_time` on."""
        if not self.delta_time or self.delta_time <= 0:
            raise ValueError("expected Ruckig(dofs, delta_time) with the period of the cycle in s")
        problem = _problem(inp)
        on_the_way = (out.new_position, out.new_velocity, out.new_acceleration)
        present = (inp.current_position, inp.current_velocity, inp.current_acceleration)
        same = all(list(a) == list(b) for a, b in zip(on_the_way, present))
        out.new_calculation = not (self._planned == problem and same)
        if out.new_calculation:
            out.trajectory._motion = inp._motion(None)
            out.time = 0.0
            self._planned = problem
        out.time += self.delta_time
        state = out.trajectory.at_time(out.time)
        out.new_position, out.new_velocity, out.new_acceleration = state
        return Result.Finished if out.time > out.trajectory.duration else Result.Working


def _problem(inp: InputParameter) -> tuple[Any, ...]:
    """Everything but the present state, to be compared."""

    def plain(value: Any) -> Any:
        return tuple(value) if isinstance(value, Iterable) else value

    skipped = ("current_position", "current_velocity", "current_acceleration")
    return tuple(plain(value) for name, value in vars(inp).items() if name not in skipped)
