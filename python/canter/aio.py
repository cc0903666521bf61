"""The client for asyncio: as `canter.Arm`, with methods to await.

    async with canter.aio.Arm("cell/arm") as arm:
        await arm.run([canter.move_to(pose)])

A task that is cancelled while it runs a program stops the arm on its path first.
"""

from __future__ import annotations

import asyncio
from typing import Any, AsyncIterator

from . import _arms
from ._arms import POLL, Directory
from ._arrays import Numbers
from ._programs import Program

__all__ = ["Arm", "Job"]


class Job:
    """A program that the engine has accepted."""

    def __init__(self, job: _arms.Job) -> None:
        self._job = job

    async def events(self) -> AsyncIterator[dict[str, Any]]:
        """What happens, until the program is over; then as `wait`."""
        while not isinstance(self._job._over, BaseException) and self._job._over is not True:
            seen = await asyncio.to_thread(self._job.look)
            for event in seen:
                yield event
            if not seen:
                await asyncio.sleep(POLL)
        self._job.result()

    async def wait(self) -> None:
        """Waits until the program is done. Raises as `canter.Job.wait`."""
        async for _ in self.events():
            pass


class Arm:
    """A running arm by its name "cell/arm". The methods are those of `canter.Arm`."""

    def __init__(self, name: str = "canter/arm", *, domain: Directory = None) -> None:
        self.sync = _arms.Arm(name, domain=domain)
        """The same arm without asyncio."""

    async def __aenter__(self) -> Arm:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    async def status(self) -> dict[str, Any]:
        """The engine's report."""
        return await asyncio.to_thread(lambda: self.sync.status)

    async def submit(self, program: Program) -> Job:
        """Hands a program over."""
        return Job(await asyncio.to_thread(self.sync.submit, program))

    async def run(self, program: Program) -> None:
        """Hands a program over and waits until it is done; stops the arm when it is cancelled."""
        job = await self.submit(program)
        try:
            await job.wait()
        except asyncio.CancelledError:
            await asyncio.shield(asyncio.to_thread(self.sync.abort))
            raise

    async def events(self) -> AsyncIterator[dict[str, Any]]:
        """What happens from now on, without end."""
        seen = await asyncio.to_thread(lambda: self.sync._ask("status")["last_note"])
        while True:
            found = await asyncio.to_thread(self.sync.events_since, seen)
            for event in found:
                seen = event["number"]
                yield event
            if not found:
                await asyncio.sleep(POLL)

    async def pause(self) -> dict[str, Any]:
        """As `canter.Arm.pause`."""
        return await asyncio.to_thread(self.sync.pause)

    async def resume(self) -> dict[str, Any]:
        """As `canter.Arm.resume`."""
        return await asyncio.to_thread(self.sync.resume)

    async def override(self, share: float) -> dict[str, Any]:
        """As `canter.Arm.override`."""
        return await asyncio.to_thread(self.sync.override, share)

    async def stop(self, *, fast: bool = False) -> dict[str, Any]:
        """As `canter.Arm.stop`."""
        return await asyncio.to_thread(lambda: self.sync.stop(fast=fast))

    async def abort(self) -> dict[str, Any]:
        """As `canter.Arm.abort`."""
        return await asyncio.to_thread(self.sync.abort)

    async def recover(self) -> dict[str, Any]:
        """As `canter.Arm.recover`."""
        return await asyncio.to_thread(self.sync.recover)

    async def jog(self, *, seconds: float, **axes: Numbers | None) -> None:
        """As `canter.Arm.jog`."""
        await asyncio.to_thread(lambda: self.sync.jog(seconds=seconds, **axes))  # type: ignore[arg-type]
