"""The client of running engines, on simulated arms: programs, control, jog, asyncio, Ctrl-C, faults."""

import asyncio
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import canter

ROOT = Path(__file__).resolve().parents[2]
PICK = ROOT / "examples/pick_and_place.canon"


def there_and_back(robot, share=0.3):
    """A program of joint moves of some seconds."""
    far = robot.home + np.array([1.5, 0.3, -0.3, 0, 0, 0])
    return canter.program([canter.joints_to(far), canter.joints_to(robot.home)], speed=share)


def wait_until(true, seconds=20.0):
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise AssertionError("it did not happen in time")
        time.sleep(0.005)


class Arms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.arm = canter.simulate("ur5e")
        cls.robot = cls.arm.robot

    @classmethod
    def tearDownClass(cls):
        cls.arm.close()

    def setUp(self):
        if self.arm.status["fault"]:
            # A machine that stalls: the test that saw it has failed; the others go on.
            self.arm.recover()
            wait_until(lambda: not self.arm.status["fault"])
        if not self.arm.status["idle"]:
            self.arm.abort()
            wait_until(lambda: self.arm.status["idle"])
        self.arm.override(1.0)
        self.arm.resume()

    def moving(self):
        return abs(self.arm.setpoint["dq"]).max() > 0.05

    def test_an_engine_is_found_and_described(self):
        self.assertIn(self.arm.name, canter.engines())
        self.assertEqual(self.robot.name, "ur5e")
        self.assertEqual(self.robot.urdf, canter.Robot("ur5e").urdf)
        self.assertEqual(self.arm.status["robot"], "ur5e")

    def test_a_program_runs_and_tells_its_events(self):
        job = self.arm.submit(there_and_back(self.robot))
        kinds = [event["event"] for event in job.events()]
        self.assertTrue(job.done)
        self.assertEqual(kinds.count("started"), 2)
        self.assertIn("ended", kinds)
        self.assertLess(abs(self.arm.q - self.robot.home).max(), 1e-2)
        self.assertLess(abs(self.arm.setpoint["q"] - self.robot.home).max(), 1e-9)

    def test_a_file_runs(self):
        with canter.simulate("ur5e", options=["--lock-step"]) as arm:
            arm.run(PICK)
            end = canter.plan(PICK, "ur5e").q[-1]
            self.assertLess(abs(arm.setpoint["q"] - end).max(), 1e-9)

    def test_a_driver_in_the_same_process_is_refused(self):
        code = "import sys; sys.modules['iceoryx2'] = sys; import canter; canter.engines()"
        ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertIn("must be two processes", ran.stderr)

    def test_pause_override_stop_and_abort(self):
        job = self.arm.submit(there_and_back(self.robot, 0.2))
        wait_until(self.moving)
        self.assertFalse(job.wait(timeout=0.01))
        reached = self.arm.pause()
        self.assertTrue(reached["resting"] and reached["held"])
        # The last setpoints of the way to rest may still be read.
        time.sleep(0.1)
        held = self.arm.setpoint["q"]
        time.sleep(0.1)
        self.assertEqual(self.arm.setpoint["q"].tolist(), held.tolist())
        self.arm.override(0.25)
        self.arm.resume()
        wait_until(lambda: abs(self.arm.setpoint["time_scaling"] - 0.25) < 1e-6)
        self.assertTrue(self.arm.stop(fast=True)["resting"])
        self.arm.abort()
        with self.assertRaises(canter.Stopped) as caught:
            job.wait(timeout=20)
        self.assertEqual(caught.exception.arm, self.arm.name)
        self.assertGreater(caught.exception.dropped, 0)

    def test_refusals_have_fields_and_nothing_moves(self):
        before = self.arm.setpoint["q"]
        with self.assertRaises(canter.Refused) as caught:
            self.arm.run("InitCanon()\nMoveTo({{9000,0,0},{0,0,1},{1,0,0}})\nEndCanon(0)\n")
        self.assertEqual((caught.exception.line, caught.exception.command), (2, "MoveTo"))
        self.assertEqual(caught.exception.reason, "motion")
        with self.assertRaises(canter.Refused):
            self.arm.submit("InitCanon(\n")
        with self.assertRaises(canter.Refused):
            self.arm.override(2)
        self.assertEqual(self.arm.setpoint["q"].tolist(), before.tolist())

    def test_jog(self):
        before = self.arm.setpoint["q"]
        self.arm.jog(joints=[0.2, 0, 0, 0, 0, 0], seconds=0.4)
        wait_until(lambda: not self.moving())
        moved = self.arm.setpoint["q"] - before
        self.assertGreater(moved[0], 0.02)
        self.assertLess(abs(moved[1:]).max(), 1e-9)
        self.arm.jog(tool=[0, 0, -0.1, 0, 0, 0], seconds=0.3)
        with self.assertRaises(TypeError):
            self.arm.jog(seconds=1)
        with self.assertRaises(canter.Refused):
            self.arm.jog(joints=[0.1], seconds=0.1)
        wait_until(lambda: self.arm.status["idle"])
        self.arm.run(canter.program([canter.joints_to(self.robot.home)]))

    def test_asyncio(self):
        async def run():
            async with canter.aio.Arm(self.arm.name) as arm:
                job = await arm.submit(there_and_back(self.robot))
                kinds = [event["event"] async for event in job.events()]
                self.assertIn("done", kinds)
                task = asyncio.create_task(arm.run(there_and_back(self.robot, 0.2)))
                await asyncio.sleep(0.5)
                task.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await task
                wait_until(lambda: self.arm.status["idle"])
                self.assertEqual((await arm.status())["command"], None)
                await arm.run(canter.program([canter.joints_to(self.robot.home)]))

        asyncio.run(run())

    def test_control_c_stops_the_arm(self):
        code = (
            "import canter, sys\n"
            f"arm = canter.Arm({self.arm.name!r})\n"
            f"program = {there_and_back(self.robot, 0.1)!r}\n"
            "try:\n"
            "    arm.run(program)\n"
            "except KeyboardInterrupt:\n"
            "    sys.exit(42 if arm.setpoint['time_scaling'] == 0 or arm.status['idle'] else 1)\n"
        )
        child = subprocess.Popen([sys.executable, "-c", code])
        wait_until(self.moving)
        os.kill(child.pid, signal.SIGINT)
        self.assertEqual(child.wait(timeout=60), 42)
        wait_until(lambda: self.arm.status["idle"])
        self.arm.run(canter.program([canter.joints_to(self.robot.home)]))

    def test_many_threads_ask_one_arm(self):
        failures = []

        def ask():
            try:
                for _ in range(20):
                    self.arm.status
                    self.arm.setpoint
            except BaseException as error:
                failures.append(error)

        threads = [threading.Thread(target=ask) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_a_forked_process_is_refused(self):
        self.arm.status
        if "fork" not in multiprocessing.get_all_start_methods():
            self.skipTest("there is no fork")
        child = os.fork()
        if child == 0:
            try:
                self.arm.status
            except canter.ConnectionFailed as error:
                os._exit(42 if "spawn" in str(error) else 2)
            os._exit(1)
        _, status = os.waitpid(child, 0)
        self.assertEqual(os.waitstatus_to_exitcode(status), 42)


class Deaths(unittest.TestCase):
    def test_without_an_engine(self):
        with self.assertRaises(canter.NoEngine):
            canter.Arm("nobody/there").status
        with self.assertRaises(ConnectionError):
            canter.Arm("nobody/there").run("InitCanon()\nEndCanon(0)\n")
        with self.assertRaises(ValueError):
            canter.Arm("no slash")
        with self.assertRaisesRegex(canter.NoEngine, "ur55"):
            canter.simulate("ur55")

    def test_an_engine_that_dies(self):
        with canter.simulate("ur5e") as arm:
            job = arm.submit(there_and_back(arm.robot, 0.2))
            wait_until(lambda: abs(arm.setpoint["dq"]).max() > 0.05)
            arm._process.kill()
            arm._process.wait()
            with self.assertRaises(canter.NoEngine):
                job.wait(timeout=30)

    def test_a_driver_that_dies_is_a_fault(self):
        with canter.simulate("ur5e") as arm:
            job = arm.submit(there_and_back(arm.robot, 0.2))
            wait_until(lambda: abs(arm.setpoint["dq"]).max() > 0.05)
            subprocess.run(["pkill", "-9", "-P", str(arm._process.pid)], check=True)
            with self.assertRaises(canter.Fault) as caught:
                job.wait(timeout=30)
            self.assertEqual(caught.exception.blame, "driver")
            self.assertIsNotNone(arm.status["fault"])
            with self.assertRaises(canter.Error):
                arm.run(there_and_back(arm.robot))

    def test_the_simulation_leaves_nothing(self):
        with canter.simulate("ur5e", arm="gone/soon") as arm:
            process = arm._process
            self.assertEqual(arm.name, "gone/soon")
        self.assertIsNotNone(process.poll())
        self.assertNotIn("gone/soon", canter.engines())


if __name__ == "__main__":
    unittest.main()
