"""Programs: arrays equal those of the command, findings are exceptions, recordings are checked."""

import os
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import canter

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.canon"))
PICK = ROOT / "examples/pick_and_place.canon"


def canter_command(*words):
    words = [os.environ["CANTER_COMMAND"], *map(str, words)]
    return subprocess.run(words, capture_output=True, text=True, check=False)


class Plans(unittest.TestCase):
    def test_arrays_are_those_of_the_command_bit_by_bit(self):
        planned = 0
        for example in EXAMPLES:
            for robot in ("ur5e", "panda"):
                with tempfile.TemporaryDirectory() as folder:
                    path = Path(folder) / "samples.csv"
                    ran = canter_command("plan", example, "--robot", robot, "--samples", path)
                    if ran.returncode != 0:
                        with self.assertRaises(canter.Error):
                            canter.plan(example, robot)
                        continue
                    plan = canter.plan(example, robot)
                    table = np.loadtxt(path, delimiter=",", skiprows=1)
                    with path.open() as file:
                        names = file.readline().strip().split(",")
                    dof = plan.robot.dof
                    for name, values in (("q", plan.q), ("dq", plan.dq), ("ddq", plan.ddq)):
                        columns = [names.index(f"{name}{k + 1}") for k in range(dof)]
                        self.assertEqual(table[:, columns].tobytes(), values.tobytes(), (example, name))
                    first = names.index("x_m")
                    self.assertEqual(table[:, first : first + 7].tobytes(), plan.pose7.tobytes())
                    self.assertEqual(table[:, names.index("t_s")].tolist(), plan.t.tolist())
                    planned += 1
        self.assertGreater(planned, 6)

    def test_moves_are_a_program(self):
        robot = canter.Robot("ur5e")
        there = canter.pose([0.4, 0.1, 0.3], z_axis=[0, 0, -1], x_axis=[1, 0, 0])
        back = canter.pose([0.4, -0.1, 0.3], z_axis=[0, 0, -1], x_axis=[1, 0, 0])
        up = canter.pose([0.4, 0.0, 0.35], z_axis=[0, 0, -1], x_axis=[1, 0, 0])
        moves = [
            canter.move_to(there),
            canter.straight_to(back),
            canter.smooth_to([up, there], 0.02),
            canter.dwell(0.1),
            canter.joints_to(robot.home),
        ]
        plan = canter.plan(moves, robot)
        names = [command["name"] for command in plan.commands]
        self.assertIn("MoveSmoothlyTo", names)
        self.assertLess(abs(plan.q[-1] - robot.home).max(), 1e-9)
        straight = next(c for c in plan.commands if c["name"] == "MoveStraightTo")
        end = np.searchsorted(plan.t, straight["start_s"] + straight["duration_s"])
        self.assertLess(abs(plan.pose[end] - back).max(), 1e-7)
        self.assertEqual(plan.pose.shape, (len(plan.t), 4, 4))
        fine = plan.samples(rate=250)
        self.assertEqual(fine.q[1].tolist(), plan.q[4].tolist())
        slow = canter.plan(canter.program(moves, speed=0.2, acceleration=0.2), robot)
        self.assertGreater(slow.duration, plan.duration)
        with self.assertRaises(TypeError):
            canter.program(["MoveTo"])

    def test_several_arms_in_parallel(self):
        robots = ("ur5e", "panda", "irb120", "iiwa14")
        plans = canter.plan_many([(PICK, robot) for robot in robots])
        for plan, robot in zip(plans, robots):
            self.assertEqual(plan.duration, canter.plan(PICK, robot).duration)

    def test_a_plan_can_be_used_by_many_threads(self):
        plan = canter.plan(PICK, "ur5e")
        found = []

        def sample():
            found.append(plan.samples(500).q.tobytes())

        threads = [threading.Thread(target=sample) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(set(found)), 1)


class Errors(unittest.TestCase):
    def test_findings_have_their_place(self):
        text = "InitCanon()\nMoveTo({{1,2,3}, {0,0,1}})\nEndCanon(0)\n"
        with self.assertRaises(canter.ProgramError) as caught:
            canter.plan(text, "ur5e")
        error = caught.exception
        self.assertEqual(error.line, 2)
        self.assertEqual(error.findings[0]["severity"], "error")
        self.assertIn("program:2:", str(error))
        self.assertEqual(canter.check(text)[0]["line"], 2)
        self.assertEqual(canter.check(PICK), [])

    def test_what_the_robot_cannot_do(self):
        text = 'InitCanon()\nMoveTo({{9000, 0, 0}, {0,0,1}, {1,0,0}})\nDwell(0.2)\nEndCanon(0)\n'
        with self.assertRaises(canter.PlanError) as caught:
            canter.plan(text, "ur5e")
        error = caught.exception
        self.assertEqual((error.line, error.command, error.index), (2, "MoveTo", 1))
        self.assertEqual(error.reason, "motion")
        plan = canter.plan(text, "ur5e", on_refusal="skip")
        self.assertEqual(len(plan.refusals), 1)
        self.assertAlmostEqual(plan.duration, 0.2)

    def test_arguments(self):
        for bad in ({"rate": 0}, {"rate": np.nan}, {"start": [1]}, {"length": "mile"}):
            with self.assertRaises(ValueError):
                canter.plan(PICK, "ur5e", **bad)
        with self.assertRaises(FileNotFoundError):
            canter.plan("no_such_file.canon", "ur5e")


class Recordings(unittest.TestCase):
    def test_a_plan_holds_and_a_changed_one_does_not(self):
        plan = canter.plan(PICK, "ur5e")
        verdict = canter.verify(plan)
        self.assertTrue(verdict.holds, verdict.findings)
        columns = {k: v.copy() for k, v in plan.samples()._asdict().items()}
        columns["q"][len(plan.t) // 2, 2] += 1e-3
        verdict = canter.verify(columns, PICK, "ur5e")
        self.assertFalse(verdict)
        self.assertTrue(verdict.findings)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "samples.csv"
            canter_command("plan", PICK, "--robot", "ur5e", "--samples", path)
            self.assertTrue(canter.verify(path, PICK, "ur5e").holds)
            recording = Path(folder) / "run.mcap"
            words = (f"--record={recording}", "--lock-step", "--arm", f"python{os.getpid()}/record")
            ran = canter_command("run", PICK, "--robot", "ur5e", *words)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            verdict = canter.verify(recording)
            self.assertTrue(verdict.holds, verdict.findings)
            self.assertGreater(len(verdict.commands), 5)
            with self.assertRaises(canter.Error):
                canter.verify(Path(folder) / "missing.mcap")

    def test_columns_are_checked(self):
        plan = canter.plan(PICK, "ur5e")
        columns = plan.samples()._asdict()
        with self.assertRaisesRegex(ValueError, "ddq"):
            canter.verify({**columns, "ddq": columns["ddq"][:-1]}, PICK, "ur5e")
        with self.assertRaisesRegex(ValueError, "pose7"):
            canter.verify({k: v for k, v in columns.items() if k != "pose7"}, PICK, "ur5e")


if __name__ == "__main__":
    unittest.main()
