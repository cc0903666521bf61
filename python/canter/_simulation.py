"""A simulated arm: an engine and its driver as processes of their own."""

from __future__ import annotations

import atexit
import itertools
import os
import shutil
import subprocess
import sysconfig
import tempfile
import time
from pathlib import Path
from typing import Any, Sequence, Union

from ._arms import Arm, _check_process
from .errors import ConnectionFailed, NoEngine

_numbers = itertools.count(1)


def command() -> str:
    """The command `canter`: the one that CANTER_COMMAND names, the one of this package, or the first
    on the search path."""
    named = os.environ.get("CANTER_COMMAND")
    if named:
        return named
    own = Path(sysconfig.get_path("scripts")) / "canter"
    found = str(own) if own.is_file() else shutil.which("canter")
    if found is None:
        raise ConnectionFailed(
            "there is no command canter: install the wheel of this package, or set CANTER_COMMAND"
        )
    return found


class Simulation(Arm):
    """A simulated arm. It ends with the block of its `with`, or with the interpreter."""

    def __init__(self, process: "subprocess.Popen[bytes]", log: Any, name: str, domain: Any) -> None:
        super().__init__(name, domain=domain)
        self._process, self._log = process, log
        atexit.register(self.close)

    def close(self) -> None:
        """Stops the arm on its path and ends engine and driver."""
        atexit.unregister(self.close)
        if self._process.poll() is None:
            try:
                self.shutdown()
                self._process.wait(timeout=10)
            except (ConnectionFailed, subprocess.TimeoutExpired):
                self._process.terminate()
                self._process.wait(timeout=10)
        self._log.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def simulate(
    robot: Union[str, "os.PathLike[str]"] = "ur5e",
    *,
    arm: str | None = None,
    domain: Union[str, "os.PathLike[str]", None] = None,
    options: Sequence[str] = (),
    timeout: float = 30.0,
) -> Simulation:
    """Starts an engine with simulated servos for a shipped robot or a folder, and gives its arm.

    Use it as `with canter.simulate("ur5e") as arm: ...`. Engine and driver are processes of their
    own, as with a real arm. `arm` is its name, "cell/arm"; `options` are further ones of `canter
    engine`. Raises `NoEngine` with the engine's own words when it does not start.
    """
    _check_process()
    name = arm or f"simulation/p{os.getpid()}n{next(_numbers)}"
    words = [command(), "engine", "--robot", os.fspath(robot), "--arm", name, *options]
    if domain is not None:
        words += ["--domain", os.fspath(domain)]
    log = tempfile.TemporaryFile()
    # A session of its own: Ctrl-C in a terminal goes to Python, which stops the arm.
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=log,
        start_new_session=True,
    )
    made = Simulation(process, log, name, domain)
    end = time.monotonic() + timeout
    try:
        while True:
            try:
                made.status
                return made
            except NoEngine:
                if process.poll() is not None or time.monotonic() > end:
                    break
            time.sleep(0.005)
    except BaseException:
        made.close()
        raise
    log.seek(0)
    said = log.read().decode(errors="replace").strip()
    made.close()
    raise NoEngine(f"the engine did not start: {said or 'it gave no answer'}")
