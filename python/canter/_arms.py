"""A running arm, from outside: the engine that moves it is a process of its own."""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any, Iterator, Union

import numpy as np

from . import _canter
from ._arrays import Array, Numbers, array
from ._programs import Program, text_of
from ._robots import Robot
from .errors import ConnectionFailed, Fault, NoEngine, Refused, Stopped

Directory = Union[str, "os.PathLike[str]", None]


def _check_process() -> None:
    """Two copies of iceoryx2 in one process take each other's nodes for those of a dead process: the
    locks by which they tell belong to the process."""
    if "iceoryx2" in sys.modules:
        raise ConnectionFailed(
            "this process has loaded the package iceoryx2 of the driver kit: a driver and a client of "
            "engines must be two processes"
        )


# How often an engine is asked what has happened, and how long it may take to answer.
POLL = 0.01
PATIENCE = 3.0


def engines(*, domain: Directory = None) -> list[str]:
    """Names ("cell/arm") of the arms whose engine runs, for this user.

    `domain` is the directory in which engines, drivers and clients find each other: the user's own
    unless given or named by CANTER_DOMAIN.
    """
    _check_process()
    return _canter.engines(None if domain is None else os.fspath(domain))


class Job:
    """A program that the engine has accepted."""

    def __init__(self, arm: Arm, first: int, last: int, seen: int) -> None:
        self.arm, self.first, self.last = arm, first, last
        self._seen = seen
        self._over: BaseException | bool = False

    def __repr__(self) -> str:
        return f"Job(commands={self.last - self.first + 1}, done={self.done})"

    @property
    def done(self) -> bool:
        """Whether it is over, in whatever way. Asks the engine."""
        if self._over is False:
            self.look()
        return self._over is not False

    def look(self) -> list[dict[str, Any]]:
        """What has happened since the last look; does not wait."""
        found = []
        for event in self.arm.events_since(self._seen):
            if self._over is not False:
                break
            self._seen = event["number"]
            found.append(event)
            self._over = self._end(event)
        return found

    def _end(self, event: dict[str, Any]) -> BaseException | bool:
        """How the program ends with this event; False if it goes on."""
        kind, name = event["event"], self.arm.name
        is_last = event.get("id") == self.last
        if kind == "done":
            return is_last
        if kind == "refused" and (is_last or event["dropped"] > 0):
            error = event["error"]
            text = f"line {event['line']}: {event['name']} refused: {error['message']}"
            return Refused(
                text,
                arm=name,
                line=event["line"],
                command=event["name"],
                reason=error["class"],
                help=error.get("help"),
            )
        if kind == "aborted":
            dropped = event["dropped"]
            return Stopped(f"{name} was stopped, {dropped} commands dropped", arm=name, dropped=dropped)
        if kind == "faulted":
            return Fault(
                event["reason"],
                arm=name,
                blame=event["blame"],
                dropped=event["dropped"],
                tick=event["tick"],
            )
        if kind == "closed":
            return NoEngine(f"{name}: the engine has ended")
        return False

    def result(self) -> None:
        """Nothing where the program is done; raises what ended it otherwise."""
        if isinstance(self._over, BaseException):
            raise self._over

    def events(self) -> Iterator[dict[str, Any]]:
        """What happens, until the program is over: dictionaries with `number`, `event` (started,
        done, refused, message, ended, stopped, aborted, faulted, ...) and its fields. Then as
        `wait`."""
        while self._over is False:
            seen = self.look()
            yield from seen
            if not seen:
                time.sleep(POLL)
        self.result()

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until the program is done; False if `timeout` (s) is over first. Ctrl-C ends the wait;
        the arm goes on.

        Raises `Refused`, `Stopped`, `Fault` or `NoEngine`.
        """
        end = None if timeout is None else time.monotonic() + timeout
        while self._over is False:
            if not self.look():
                if end is not None and time.monotonic() >= end:
                    return False
                time.sleep(POLL)
        self.result()
        return True


class Arm:
    """A running arm by its name "cell/arm".

    Any number of programs may look on; one at a time commands. Nothing here is a safety function: use
    the robot's own emergency stop.
    """

    def __init__(self, name: str = "canter/arm", *, domain: Directory = None) -> None:
        """Nothing is opened yet: `NoEngine` comes with the first request."""
        _check_process()
        self._link = _canter.Link(name, None if domain is None else os.fspath(domain), "python")
        self.name = name

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r})"

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def _ask(self, verb: str, **fields: Any) -> Any:
        return json.loads(self._link.ask(json.dumps({"verb": verb, **fields}), PATIENCE))

    # What is going on.

    @property
    def status(self) -> dict[str, Any]:
        """The engine's report: state, command, queued, idle, held, fault, joints, setpoint,
        position_m, orientation_wxyz, settings, cycles."""
        found: dict[str, Any] = self._ask("status")["status"]
        return found

    @property
    def robot(self) -> Robot:
        """The robot that the engine moves, by the engine's own files."""
        name = self.status["robot"]
        return Robot.from_text(name, self._text("urdf"), self._text("robot"))

    def _text(self, of: str) -> str:
        text = b""
        while True:
            part = self._ask("text", of=of, **{"from": len(text)})
            text += str(part["text"]).encode()
            if not part["text"] or part["length"] <= len(text):
                return text.decode()

    @property
    def q(self) -> Array:
        """Joints (dof,) that the driver measured last, rad or m."""
        found: Array = self.state["q"]
        return found

    @property
    def setpoint(self) -> dict[str, Any]:
        """The latest setpoint: arrays `q`, `dq`, `ddq` (dof,), and `tick`, `command`, `path_time` (s),
        `time_scaling`."""
        return self._latest()[0]

    @property
    def state(self) -> dict[str, Any]:
        """The latest state of the driver: arrays `q`, `dq`, `effort` (dof,), and `sequence`."""
        return self._latest()[1]

    def _latest(self) -> tuple[dict[str, Any], dict[str, Any]]:
        setpoint, state = self._link.latest()
        if not setpoint or not state:
            raise NoEngine(f"{self.name}: no setpoint or no state came within 500 ms")
        return setpoint, state

    def events_since(self, number: int) -> list[dict[str, Any]]:
        """What has happened after the event of this number; does not wait."""
        found = self._ask("notes", since=number)["notes"]
        return [{"number": note["number"], **note["note"]} for note in found]

    def events(self) -> Iterator[dict[str, Any]]:
        """What happens from now on, without end; `break` ends it."""
        seen = self._ask("status")["last_note"]
        while True:
            found = self.events_since(seen)
            for event in found:
                seen = event["number"]
                yield event
            if not found:
                time.sleep(POLL)

    # Programs.

    def submit(self, program: Program) -> Job:
        """Hands a program over and returns at once: a text, a file, or a list of moves.

        Raises `Refused` where the engine does not take it; nothing moved then.
        """
        name, text = text_of(program)
        first = text.lstrip()[:1]
        form = "xml" if first == "<" else "json" if first in ("{", "[") else "text"
        seen = self._ask("status")["last_note"]
        answer = self._ask("submit", format=form, name=name, program=text)
        if answer["last"] is None:
            raise Refused(f"{name}: it has no command", arm=self.name)
        return Job(self, answer["first"], answer["last"], seen)

    def run(self, program: Program) -> None:
        """Hands a program over and waits until it is done. Ctrl-C stops the arm on its path and drops
        the rest.

        Raises `Refused`, `Stopped`, `Fault` or `NoEngine`.
        """
        job = self.submit(program)
        try:
            job.wait()
        except KeyboardInterrupt:
            self.abort()
            raise

    # The motion under way. Each acts in the next servo period.

    def _control(self, kind: str, share: float = 0.0, rest: bool = False) -> dict[str, Any]:
        reached = self._link.control(kind, share, PATIENCE)
        end = time.monotonic() + PATIENCE
        while rest and not reached["resting"] and time.monotonic() < end:
            time.sleep(0.002)
            reached = self._link.control("look", 0.0, PATIENCE)
        return reached

    def pause(self) -> dict[str, Any]:
        """Comes to rest on the path, until `resume`; waits for the rest. Gives `resting`, `held`,
        `idle`, `fault`, `tick`, `time_scaling`."""
        return self._control("pause", rest=True)

    def resume(self) -> dict[str, Any]:
        """Goes on along the path after `pause` or `stop`."""
        return self._control("resume")

    def override(self, share: float) -> dict[str, Any]:
        """Sets the speed along the path to a share, 0 to 1, of the planned one."""
        return self._control("override", float(share))

    def stop(self, *, fast: bool = False) -> dict[str, Any]:
        """Comes to rest on the path, `fast` with all that the joints have; waits for the rest.
        `resume` goes on, `abort` drops the program."""
        return self._control("stop-fast" if fast else "stop", rest=True)

    def abort(self) -> dict[str, Any]:
        """Comes to rest on the path and drops all commands; waits for the rest."""
        return self._control("abort", rest=True)

    def recover(self) -> dict[str, Any]:
        """Clears a fault and opens a new session with the driver."""
        return self._control("recover")

    # By hand.

    def jog(
        self,
        *,
        joints: Numbers | None = None,
        tool: Numbers | None = None,
        workstation: Numbers | None = None,
        seconds: float,
        timeout: float = 0.3,
    ) -> None:
        """Moves by hand for `seconds`, then stops. One of: shares -1 to 1 of the largest speed of each
        of the `joints` (dof,), or along and about x, y, z (6,) of the `tool` or the `workstation`.

        The arm stops by itself when this process gives no sign for `timeout` s. No program may run.
        """
        given = {"joint": joints, "tool": tool, "workstation": workstation}
        named = {space: array(speeds, space) for space, speeds in given.items() if speeds is not None}
        if len(named) != 1:
            raise TypeError("expected one of joints, tool or workstation")
        ((space, speeds),) = named.items()

        def ask(shares: Array) -> None:
            self._ask("jog", space=space, speeds=shares.tolist(), timeout_ms=int(1000 * timeout))

        end = time.monotonic() + seconds
        try:
            while time.monotonic() < end:
                ask(speeds)
                time.sleep(max(0.0, min(timeout / 6, end - time.monotonic())))
        finally:
            ask(np.zeros(speeds.shape))

    def shutdown(self) -> None:
        """Stops the arm on its path and ends the engine."""
        self._ask("shutdown")
