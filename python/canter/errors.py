"""Exceptions of the package. Each has the numbers of its message as fields; a field that a case does
not have is None."""

from __future__ import annotations

from typing import Any

__all__ = [
    "Error",
    "InternalError",
    "RobotError",
    "IkError",
    "OtgError",
    "TimingError",
    "SmoothError",
    "ProgramError",
    "PlanError",
    "ConnectionFailed",
    "NoEngine",
    "Refused",
    "Stopped",
    "Fault",
]


class Error(Exception):
    """Base of all exceptions of Canter."""

    _fields: tuple[str, ...] = ()

    def __init__(self, message: str = "", **fields: Any) -> None:
        super().__init__(message)
        for name in self._fields:
            setattr(self, name, None)
        for name, value in fields.items():
            setattr(self, name, value)

    def __reduce__(self) -> Any:
        # Fields are kept when an exception comes from another process.
        return (_again, (type(self), str(self), dict(self.__dict__)))


def _again(kind: type[Error], message: str, fields: dict[str, Any]) -> Error:
    return kind(message, **fields)


class InternalError(Error):
    """An error of Canter itself, whatever the arguments were. Please report it."""


class RobotError(Error):
    """A robot cannot be used: `file`, `line`, `column` (from 1)."""

    _fields = ("file", "line", "column")
    file: str | None
    line: int | None
    column: int | None


class IkError(Error):
    """A pose is not reached.

    `reason` is "out of reach" (`value`: m), "orientation" (`value`: rad), "joint limit" (`joint` from
    0, `value`: rad or m beyond it), "singular" (`value`: smallest singular value) or "not finite".
    `nearest` are the joints of the nearest pose found, which is off by `position_error` (m) and
    `rotation_error` (rad).
    """

    _fields = ("reason", "joint", "value", "position_error", "rotation_error", "nearest")
    reason: str | None
    joint: int | None
    value: float | None
    position_error: float
    rotation_error: float
    nearest: list[float]


class OtgError(Error):
    """No state-to-state motion: `joint` (from 0), `quantity`, `value`, `limit`; `index` of the motion
    in a batch."""

    _fields = ("joint", "quantity", "value", "limit", "index")
    joint: int | None
    quantity: str | None
    value: float | None
    limit: float | None
    index: int | None


class TimingError(Error):
    """No time law along a path: `joint` (from 0), `quantity`, `value`, path parameter `u`."""

    _fields = ("joint", "quantity", "value", "u")
    joint: int | None
    quantity: str | None
    value: float | None
    u: float | None


class SmoothError(Error):
    """No smooth motion: index of the `pose`, or `quantity`, with its `value`."""

    _fields = ("pose", "quantity", "value")
    pose: int | None
    quantity: str | None
    value: float | None


class ProgramError(Error):
    """A program has errors. `findings` is a list of dictionaries with file, line, column, severity,
    code, message, expected, found and help; `line` and `column` (from 1) are those of the first."""

    _fields = ("findings", "line", "column")
    findings: list[dict[str, Any]]
    line: int
    column: int


class PlanError(Error):
    """A command cannot be executed by this robot: `line`, `column` (from 1), `index` of the command
    (from 0), its name `command`, `reason` (the class of the error) and `help`."""

    _fields = ("line", "column", "index", "command", "reason", "help")
    line: int
    column: int
    index: int
    command: str
    reason: str
    help: str


class ConnectionFailed(Error, ConnectionError):
    """Shared memory cannot be used, or not by this process."""


class NoEngine(ConnectionFailed):
    """No engine of this arm answered in time."""


class Refused(Error):
    """The engine refuses a request or a command: `arm`; for a command of a program also `line`,
    `command` and `reason`. Nothing of it moved."""

    _fields = ("arm", "line", "command", "reason", "help")
    arm: str | None
    line: int | None
    command: str | None
    reason: str | None
    help: str | None


class Stopped(Error):
    """The arm was stopped before the program was done; `dropped` commands were not executed."""

    _fields = ("arm", "dropped")
    arm: str
    dropped: int


class Fault(Error):
    """A fault ended the program. It stays until `Arm.recover`. `blame` is "guard" (a limit) or
    "driver"; `dropped` commands were not executed."""

    _fields = ("arm", "blame", "dropped", "tick")
    arm: str
    blame: str | None
    dropped: int | None
    tick: int | None
