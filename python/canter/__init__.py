"""Canter: plan, check and execute motions of robot arms.

Libraries: `Robot` (kinematics), `move` and `otg` (state to state), `time_path` and `timing` (time
laws), `smooth` (through poses), `plan` (programs), `verify` (recorded motions). Client of a running
engine: `engines`, `Arm`, `simulate`, `aio`. Driver kit: `canter.driver`.

Quantities are SI: m, rad, s. Joints are numpy arrays (dof,) or (n, dof); poses are homogeneous
matrices (4, 4) or (n, 4, 4) of the tool in the workstation.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from . import errors as errors

if TYPE_CHECKING:
    from . import aio as aio
    from . import otg as otg
    from . import timing as timing
    from ._arms import Arm as Arm
    from ._arms import Job as Job
    from ._arms import engines as engines
    from ._moves import dwell as dwell
    from ._moves import joints_to as joints_to
    from ._moves import move_to as move_to
    from ._moves import program as program
    from ._moves import smooth_to as smooth_to
    from ._moves import straight_to as straight_to
    from ._poses import pose as pose
    from ._poses import pose7 as pose7
    from ._programs import Plan as Plan
    from ._programs import check as check
    from ._programs import plan as plan
    from ._programs import plan_many as plan_many
    from ._programs import verify as verify
    from ._robots import Robot as Robot
    from ._robots import robots as robots
    from ._simulation import simulate as simulate
    from ._smoothing import SmoothMotion as SmoothMotion
    from ._smoothing import smooth as smooth
    from .errors import ConnectionFailed as ConnectionFailed
    from .errors import Error as Error
    from .errors import Fault as Fault
    from .errors import IkError as IkError
    from .errors import InternalError as InternalError
    from .errors import NoEngine as NoEngine
    from .errors import OtgError as OtgError
    from .errors import PlanError as PlanError
    from .errors import ProgramError as ProgramError
    from .errors import Refused as Refused
    from .errors import RobotError as RobotError
    from .errors import SmoothError as SmoothError
    from .errors import Stopped as Stopped
    from .errors import TimingError as TimingError
    from .otg import move as move
    from .timing import time_path as time_path

__version__ = "0.1.0"

# Loaded when they are used: the driver kit needs neither the extension module nor numpy.
_WHERE = {
    "Arm": "_arms",
    "Job": "_arms",
    "engines": "_arms",
    "pose": "_poses",
    "pose7": "_poses",
    "Plan": "_programs",
    "check": "_programs",
    "plan": "_programs",
    "plan_many": "_programs",
    "verify": "_programs",
    "dwell": "_moves",
    "joints_to": "_moves",
    "move_to": "_moves",
    "program": "_moves",
    "smooth_to": "_moves",
    "straight_to": "_moves",
    "move": "otg",
    "Robot": "_robots",
    "robots": "_robots",
    "simulate": "_simulation",
    "SmoothMotion": "_smoothing",
    "smooth": "_smoothing",
    "time_path": "timing",
}
_MODULES = ("aio", "driver", "otg", "timing")
_ERRORS = tuple(errors.__all__)

__all__ = [*_WHERE, *_ERRORS, "aio", "errors", "otg", "timing"]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if name in _ERRORS:
        return getattr(errors, name)
    if name in _WHERE:
        found = getattr(importlib.import_module(f".{_WHERE[name]}", __name__), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_MODULES, "__version__"])
