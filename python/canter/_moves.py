"""Programs from a list of moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable

import numpy as np

from ._arrays import Array, Numbers, array, poses


@dataclass(frozen=True)
class Move:
    """One step of a program, as canonical commands in metres and radians."""

    text: str


def _number(value: float) -> str:
    if not np.isfinite(value):
        raise ValueError(f"expected a finite number, got {value}")
    return repr(float(value))


def _list(values: Array) -> str:
    return "{" + ", ".join(_number(value) for value in values) + "}"


def _pose(pose: Array) -> str:
    return "{" + ", ".join([_list(pose[:3, 3]), _list(pose[:3, 2]), _list(pose[:3, 0])]) + "}"


def _one(pose: Numbers) -> Array:
    found = poses(pose, "pose")
    if found.ndim != 2:
        raise ValueError(f"expected one pose, got shape {found.shape}")
    return found


def move_to(pose: Numbers) -> Move:
    """To a pose (4, 4) or (7,) in joint space, in the shortest time."""
    return Move(f"MoveTo({_pose(_one(pose))})")


def straight_to(pose: Numbers) -> Move:
    """To a pose (4, 4) or (7,) along a straight line."""
    return Move(f"MoveStraightTo({_pose(_one(pose))})")


def smooth_to(through: Numbers, tolerance: float) -> Move:
    """Near all poses (n, 4, 4) or (n, 7) but the last, each within `tolerance` (m), without stopping;
    stops at the last."""
    found = poses(through, "through")
    if found.ndim != 3 or len(found) == 0:
        raise ValueError(f"through: expected (n, 4, 4) or (n, 7), got shape {found.shape}")
    listed = ", ".join(_pose(pose) for pose in found)
    return Move(
        f"SetIntermediatePointTolerance({_number(tolerance)})\n"
        f"MoveSmoothlyTo({{{listed}}}, {len(found)})"
    )


def joints_to(q: Numbers) -> Move:
    """All joints to `q` (dof,), rad (m where a joint slides)."""
    found = array(q, "q")
    if found.ndim != 1:
        raise ValueError(f"q: expected (dof,), got shape {found.shape}")
    goals = (f"{{{joint}, {_number(value)}}}" for joint, value in enumerate(found, 1))
    return Move(f"ActuateJoints({{{', '.join(goals)}}})")


def dwell(seconds: float) -> Move:
    """The arm stays motionless for this time, s."""
    return Move(f"Dwell({_number(seconds)})")


def program(
    moves: Iterable[Move], *, speed: float = 1.0, acceleration: float = 1.0
) -> str:
    """The canonical program that makes these moves. `speed` and `acceleration` are shares, 0 to 1, of
    the robot's largest.

    >>> import canter
    >>> print(canter.program([canter.dwell(0.5)], speed=0.5))
    InitCanon()
    SetLengthUnits("meter")
    SetAngleUnits("radian")
    SetRelativeSpeed(50.0)
    SetRelativeAcceleration(100.0)
    Dwell(0.5)
    EndCanon(0)
    <BLANKLINE>
    """
    lines = [
        "InitCanon()",
        'SetLengthUnits("meter")',
        'SetAngleUnits("radian")',
        f"SetRelativeSpeed({_number(100 * speed)})",
        f"SetRelativeAcceleration({_number(100 * acceleration)})",
    ]
    for move in moves:
        if not isinstance(move, Move):
            raise TypeError(
                "expected moves of canter.move_to, straight_to, smooth_to, joints_to or dwell, "
                f"got {type(move).__name__}"
            )
        lines.append(move.text)
    lines.append("EndCanon(0)")
    return "\n".join(lines) + "\n"
