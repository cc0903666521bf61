"""Robots: description, limits, kinematics."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _canter
from ._arrays import Array, Numbers, joints, poses


@dataclass(frozen=True)
class JointLimits:
    """Limits of the joints, arrays (dof,): rad, rad/s, rad/s2, rad/s3 (m where a joint slides)."""

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array


@dataclass(frozen=True)
class ToolLimits:
    """Limits of the controlled point: m/s, m/s2, m/s3, rad/s, rad/s2, rad/s3."""

    speed: float
    acceleration: float
    jerk: float
    angular_speed: float
    angular_acceleration: float
    angular_jerk: float


class IkBatch(NamedTuple):
    """Inverse kinematics of many poses."""

    q: Array
    """Joints (n, dof); a row is NaN where its pose is not reached."""
    success: npt.NDArray[np.bool_]
    """Which poses are reached (n,)."""
    position_error: Array
    """Distance of the nearest pose found (n,), m; 0 where the pose is reached."""
    rotation_error: Array
    """Its angle (n,), rad."""


def robots() -> list[str]:
    """Names of the robots that come with Canter."""
    return _canter.Robot.shipped()


class Robot:
    """A robot by the name of a shipped one, by its folder, or by a URDF file.

    Poses are those of the tool in the workstation: of the tool centre point of the end effector that
    is mounted at the start (`point="tool"`), or of the end of the arm (`point="flange"`).

    >>> import canter
    >>> robot = canter.Robot("ur5e")
    >>> robot.dof
    6
    >>> bool(abs(robot.ik(robot.fk(robot.home), near=robot.home) - robot.home).max() < 1e-9)
    True
    """

    def __init__(self, robot: Union[str, "os.PathLike[str]"], *, tip: str | None = None) -> None:
        """A shipped name such as "ur5e", a folder with robot.urdf and robot.toml, or a .urdf file.

        A URDF file alone gets Canter's defaults for acceleration, jerk and tool limits: check them
        before the robot moves. `tip` names the link at the end of the arm where several could be it.

        Raises `RobotError` with file, line and column.
        """
        name = os.fspath(robot)
        if name.endswith(".urdf"):
            text = Path(name).read_text(encoding="utf-8")
            self._own = _canter.Robot.parse(Path(name).stem, text, None, tip)
        else:
            self._own = _canter.Robot.load(name)

    @classmethod
    def from_text(cls, name: str, urdf: str, toml: str | None = None, *, tip: str | None = None) -> Robot:
        """A robot from the text of its URDF and of its robot.toml, if there is one."""
        made = cls.__new__(cls)
        made._own = _canter.Robot.parse(name, urdf, toml, tip)
        return made

    @classmethod
    def import_urdf(
        cls,
        urdf_file: Union[str, "os.PathLike[str]"],
        folder: Union[str, "os.PathLike[str]"],
        *,
        tip: str | None = None,
    ) -> Robot:
        """Makes a robot folder from a URDF file; its robot.toml has Canter's defaults."""
        made = cls.__new__(cls)
        made._own = _canter.Robot.import_urdf(Path(urdf_file), Path(folder), tip)
        return made

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, dof={self.dof})"

    @property
    def name(self) -> str:
        """Short name."""
        return self._own.name

    @property
    def description(self) -> str:
        """One line for people."""
        return self._own.description

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._own.dof

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, root first."""
        return self._own.joint_names

    @property
    def sliding(self) -> list[bool]:
        """Whether each joint slides."""
        return self._own.sliding

    @property
    def home(self) -> Array:
        """A ready position (dof,), rad or m."""
        return self._own.home

    @property
    def urdf(self) -> str:
        """Text of the URDF."""
        return self._own.urdf

    @property
    def toml(self) -> str:
        """Text of robot.toml."""
        return self._own.toml

    @property
    def family(self) -> str:
        """Closed form of the inverse kinematics, or "numeric"."""
        return self._own.family

    @property
    def limits(self) -> JointLimits:
        """Limits of the joints."""
        return JointLimits(*(np.array(row) for row in self._own.joint_limits()))

    @property
    def tool_limits(self) -> ToolLimits:
        """Limits of the controlled point."""
        return ToolLimits(*self._own.tool_limits())

    def fk(self, q: Numbers, *, point: str = "tool") -> Array:
        """Forward kinematics: joints (..., dof) to poses (..., 4, 4)."""
        rows = joints(q, self.dof, "q")
        found = self._own.fk(rows.reshape(-1, self.dof), point)
        return found.reshape(*rows.shape[:-1], 4, 4)

    def jacobian(self, q: Numbers, *, point: str = "tool") -> Array:
        """Geometric Jacobian: joints (..., dof) to (..., 6, dof).

        Rows 0 to 2 are the velocity of the point (m), rows 3 to 5 its angular velocity (rad), both
        for one unit of a joint, in the axes of the workstation.
        """
        rows = joints(q, self.dof, "q")
        found = self._own.jacobian(rows.reshape(-1, self.dof), point)
        return found.reshape(*rows.shape[:-1], 6, self.dof)

    def ik(self, pose: Numbers, *, near: Numbers | None = None, point: str = "tool") -> Array:
        """Inverse kinematics of one pose (4, 4) or (7,): the joints (dof,) nearest to `near` (dof,),
        or to the middle of the joint ranges; always inside the limits.

        Raises `IkError` with the reason where the pose is not reached.
        """
        target = poses(pose, "pose")
        if target.ndim != 2:
            raise ValueError(f"expected one pose, got shape {target.shape}; ik_batch takes many")
        seed = None if near is None else joints(near, self.dof, "near")
        if seed is not None and seed.ndim != 1:
            raise ValueError(f"near: expected ({self.dof},), got shape {seed.shape}")
        return self._own.ik(target, seed, point)

    def ik_batch(
        self,
        pose: Numbers,
        *,
        near: Numbers | None = None,
        point: str = "tool",
        threads: int | None = None,
    ) -> IkBatch:
        """Inverse kinematics of many poses (n, 4, 4) or (n, 7), on all processors.

        `near` is one position (dof,) or one for each pose (n, dof). `threads` limits the processors.
        A pose that is not reached does not raise: see `IkBatch`.
        """
        target = poses(pose, "pose")
        if target.ndim != 3:
            raise ValueError(f"pose: expected (n, 4, 4) or (n, 7), got shape {target.shape}")
        seed = None if near is None else joints(near, self.dof, "near")
        if threads is not None and threads < 1:
            raise ValueError(f"threads: expected 1 or more, got {threads}")
        q, success, off = self._own.ik_batch(
            target, seed, {"point": point, "threads": threads or 0}
        )
        return IkBatch(q, success, off[:, 0], off[:, 1])

    def ik_all(self, pose: Numbers, *, swivel: float | None = None, point: str = "tool") -> Array:
        """All branches of one pose inside the limits: (k, dof), k = 0 where there is none.

        An arm with seven joints has a free parameter: `swivel` (rad) sets it, and `swivels` gives
        values over its range.
        """
        target = poses(pose, "pose")
        if target.ndim != 2:
            raise ValueError(f"pose: expected (4, 4) or (7,), got shape {target.shape}")
        return self._own.ik_all(target, swivel, point)

    def swivels(self, count: int) -> Array:
        """`count` values (rad) of the free parameter of an arm with seven joints, evenly spaced; one
        value if there is none."""
        return self._own.parameters(count)
