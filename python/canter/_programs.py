"""Programs: checked, planned, and recorded motions verified."""

from __future__ import annotations

import json
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Iterable, Mapping, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _canter
from ._arrays import Array, Numbers, array, joints
from ._moves import Move, program as from_moves
from ._poses import matrix
from ._robots import Robot
from .errors import ProgramError

Program = Union[str, "os.PathLike[str]", Iterable[Move]]


def text_of(program: Program) -> tuple[str, str]:
    """Name and text of a program: a list of moves, a file, or a text (which has a bracket)."""
    if isinstance(program, str) and any(sign in program for sign in "(<{["):
        return "program", program
    if isinstance(program, (str, os.PathLike)):
        path = os.fspath(program)
        return path, Path(path).read_text(encoding="utf-8")
    return "moves", from_moves(program)


def _robot(robot: Union[Robot, str]) -> Robot:
    return robot if isinstance(robot, Robot) else Robot(robot)


def check(program: Program, *, length: str = "mm") -> list[dict[str, Any]]:
    """All findings about a program, without a robot: dictionaries with line, column, severity, code,
    message, expected, found and help. Empty if it is right."""
    name, text = text_of(program)
    found: list[dict[str, Any]] = json.loads(_canter.check(name, text, length))
    return found


class Samples(NamedTuple):
    """A planned motion at the times of a servo clock."""

    t: Array
    """Times (n,), s."""
    command: npt.NDArray[np.int64]
    """Number of the command (n,), from 0."""
    q: Array
    """Joints (n, dof), rad or m."""
    dq: Array
    """Velocities."""
    ddq: Array
    """Accelerations."""
    dddq: Array
    """Jerks."""
    pose7: Array
    """Tool in the workstation (n, 7): x, y, z, qw, qx, qy, qz."""


class Plan:
    """A planned program. Its arrays are computed when they are asked for.

    >>> import canter
    >>> plan = canter.plan([canter.straight_to(canter.Robot("ur5e").fk([0, -1.2, 1.5, -1.8, -1.6, 0]))],
    ...                    "ur5e", start=[0.1, -1.2, 1.5, -1.8, -1.6, 0])
    >>> plan.q.shape == (len(plan.t), 6), plan.commands[5]["name"]
    (True, 'MoveStraightTo')
    """

    def __init__(self, own: _canter.Plan, robot: Robot, given: tuple[str, str, str], rate: float):
        self._own, self._given = own, given
        self._report: dict[str, Any] | None = None
        self._samples: Samples | None = None
        self.robot = robot
        self.rate = rate

    def __repr__(self) -> str:
        return f"Plan(robot={self.robot.name!r}, duration={self.duration})"

    @property
    def duration(self) -> float:
        """How long the program takes, s."""
        return self._own.duration

    @property
    def report(self) -> dict[str, Any]:
        """The plan as `canter plan --json` prints it."""
        if self._report is None:
            self._report = json.loads(self._own.report())
        return self._report

    @property
    def commands(self) -> list[dict[str, Any]]:
        """The commands: index, line, name, start_s, duration_s, and of a move its `certificate`."""
        found: list[dict[str, Any]] = self.report["commands"]
        return found

    @property
    def refusals(self) -> list[dict[str, Any]]:
        """Commands that were skipped because they cannot be executed (`on_refusal="skip"`)."""
        found: list[dict[str, Any]] = self.report.get("refusals", [])
        return found

    def samples(self, rate: float | None = None) -> Samples:
        """The motion at `rate` Hz; at the servo rate unless given."""
        t, command, (q, dq, ddq, dddq), pose7 = self._own.samples(1.0 / (rate or self.rate))
        return Samples(t, command, q, dq, ddq, dddq, pose7)

    def _all(self) -> Samples:
        if self._samples is None:
            self._samples = self.samples()
        return self._samples

    @property
    def t(self) -> Array:
        """Times (n,) at the servo rate, s."""
        return self._all().t

    @property
    def q(self) -> Array:
        """Joints (n, dof), rad or m."""
        return self._all().q

    @property
    def dq(self) -> Array:
        """Joint velocities (n, dof), per s."""
        return self._all().dq

    @property
    def ddq(self) -> Array:
        """Joint accelerations (n, dof), per s2."""
        return self._all().ddq

    @property
    def dddq(self) -> Array:
        """Joint jerks (n, dof), per s3."""
        return self._all().dddq

    @property
    def pose7(self) -> Array:
        """Tool in the workstation (n, 7): x, y, z (m), qw, qx, qy, qz."""
        return self._all().pose7

    @property
    def pose(self) -> Array:
        """Tool in the workstation (n, 4, 4)."""
        return matrix(self._all().pose7)

    def to_pandas(self) -> Any:
        """The samples as a data frame, with the column names of `canter plan --samples`."""
        import pandas  # type: ignore[import-untyped, import-not-found, unused-ignore]

        found = self._all()
        dof = self.robot.dof
        columns: dict[str, Any] = {"t_s": found.t, "command": found.command}
        for name, values in (("q", found.q), ("dq", found.dq), ("ddq", found.ddq), ("dddq", found.dddq)):
            columns.update({f"{name}{joint + 1}": values[:, joint] for joint in range(dof)})
        names = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
        columns.update({name: found.pose7[:, k] for k, name in enumerate(names)})
        return pandas.DataFrame(columns)


def plan(
    program: Program,
    robot: Union[Robot, str],
    *,
    rate: float = 1000.0,
    start: Numbers | None = None,
    length: str = "mm",
    on_refusal: str = "abort",
) -> Plan:
    """Plans a program: a text, a file (canonical text, JSON or CRCL's XML) or a list of moves.

    `start` (dof,) are the joints at the start; the robot's home unless given. `length` is the unit
    until the program sets one: "mm", "m" or "inch". Every limit holds for all times, and the motion
    is the one that `canter run` executes.

    Raises `ProgramError` (the text is wrong) with all findings, or `PlanError` (the robot cannot do
    it) with line, column and reason; with `on_refusal="skip"` the plan has the `refusals` instead.
    """
    arm = _robot(robot)
    if on_refusal not in ("abort", "skip"):
        raise ValueError(f'on_refusal: expected "abort" or "skip", got {on_refusal!r}')
    first = None
    if start is not None:
        first = joints(start, arm.dof, "start")
        if first.ndim != 1:
            raise ValueError(f"start: expected ({arm.dof},), got shape {first.shape}")
    name, text = text_of(program)
    given = (name, text, length)
    choices = {"rate": float(rate), "start": first, "skip": on_refusal == "skip"}
    own = _canter.plan(arm._own, given, choices)
    return Plan(own, arm, given, float(rate))


def plan_many(
    jobs: Iterable[tuple[Program, Union[Robot, str]]], *, threads: int | None = None, **options: Any
) -> list[Plan]:
    """Plans many programs, each for its own robot, on all processors; options as for `plan`.

    Raises what the first of them that fails raises.
    """
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        return list(pool.map(lambda job: plan(job[0], job[1], **options), list(jobs)))


class Verdict:
    """What a recorded motion proves."""

    def __init__(self, programs: list[dict[str, Any]]) -> None:
        self.programs = programs

    def __bool__(self) -> bool:
        return self.holds

    def __repr__(self) -> str:
        return f"Verdict(holds={self.holds}, findings={len(self.findings)})"

    @property
    def holds(self) -> bool:
        """Whether nothing is wrong anywhere."""
        return all(bool(verdict["holds"]) for verdict in self.programs)

    @property
    def findings(self) -> list[str]:
        """What is wrong, each with its rule, time, value and limit."""
        found: list[str] = []
        for verdict in self.programs:
            found += verdict["findings"]
            for command in verdict["commands"]:
                found += command["findings"]
        return found

    @property
    def commands(self) -> list[dict[str, Any]]:
        """The commands with their passes, straightness and peaks."""
        return [command for verdict in self.programs for command in verdict["commands"]]


def verify(
    recording: Union[Plan, str, "os.PathLike[str]", Mapping[str, Any]],
    program: Program | None = None,
    robot: Union[Robot, str, None] = None,
    *,
    length: str = "mm",
) -> Verdict:
    """Checks a recorded motion against its program, from the samples alone: limits, tolerances, lines,
    order, rest. Nothing is planned, and its kinematics are not the planner's.

    `recording` is a `Plan`; a CSV file of `canter plan --samples` or `canter run --samples`; columns
    as a dictionary (t, command, q, dq, ddq, pose7; of a run also path_time, measured_q,
    measured_point); or an MCAP file, which has its own program and robot and is read by the command
    `canter`.
    """
    if isinstance(recording, Plan):
        samples = recording._all()
        columns = samples._asdict()
        return _verdict(recording.robot, recording._given, columns)
    if isinstance(recording, Mapping):
        if program is None or robot is None:
            raise TypeError("expected program and robot with columns")
        return _verdict(_robot(robot), (*text_of(program), length), recording)
    path = Path(os.fspath(recording))
    if path.suffix == ".mcap":
        return _verify_file(path, program, robot)
    if program is None or robot is None:
        raise TypeError("expected program and robot with a CSV file")
    arm = _robot(robot)
    return _verdict(arm, (*text_of(program), length), _columns(path, arm.dof))


def _columns(path: Path, dof: int) -> dict[str, Array]:
    """The columns of a CSV file of samples."""
    with path.open(encoding="utf-8") as file:
        names = [name.strip() for name in file.readline().split(",")]
        table = np.loadtxt(file, delimiter=",", ndmin=2)

    def some(*wanted: str) -> Array:
        missing = [name for name in wanted if name not in names]
        if missing:
            raise ValueError(f"{path}, line 1: there is no column {missing[0]}")
        return np.ascontiguousarray(table[:, [names.index(name) for name in wanted]])

    def each(name: str) -> Array:
        return some(*(f"{name}{joint}" for joint in range(1, dof + 1)))

    found = {
        "t": some("t_s")[:, 0],
        "command": some("command")[:, 0],
        "q": each("q"),
        "dq": each("dq"),
        "ddq": each("ddq"),
        "pose7": some("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"),
    }
    if "path_time_s" in names:
        found["path_time"] = some("path_time_s")[:, 0]
        found["measured_q"] = each("measured_q")
        found["measured_point"] = some("measured_x_m", "measured_y_m", "measured_z_m")
    return found


def _verdict(robot: Robot, given: tuple[str, str, str], columns: Mapping[str, Any]) -> Verdict:
    for needed in ("t", "command", "q", "dq", "ddq", "pose7"):
        if needed not in columns:
            raise ValueError(f"there is no column {needed}")
    run = None
    if "path_time" in columns:
        run = tuple(array(columns[k], k) for k in ("path_time", "measured_q", "measured_point"))
    command = np.asarray(columns["command"])
    if np.any(command < 0) or np.any(command != np.floor(command)):
        raise ValueError("command: expected numbers of commands, from 0")
    rows = {
        "t": array(columns["t"], "t"),
        "command": command.astype(np.int64).tolist(),
        "q": array(columns["q"], "q"),
        "dq": array(columns["dq"], "dq"),
        "ddq": array(columns["ddq"], "ddq"),
        "pose": array(columns["pose7"], "pose7"),
        "run": run,
    }
    return Verdict([json.loads(_canter.verify(robot._own, given, rows))])


def _verify_file(path: Path, program: Program | None, robot: Union[Robot, str, None]) -> Verdict:
    """A recording with its own program and robot, by the command `canter`."""
    from ._simulation import command

    if program is not None or robot is not None:
        raise TypeError("a recording has its own program and robot")
    ran = subprocess.run(
        [command(), "verify", str(path), "--json"], capture_output=True, text=True, check=False
    )
    found, rest = [], ran.stdout.strip()
    while rest:
        verdict, end = json.JSONDecoder().raw_decode(rest)
        found.append(verdict)
        rest = rest[end:].strip()
    if not found:
        raise ProgramError(ran.stderr.strip() or f"{path}: cannot be verified", findings=[])
    return Verdict(found)
