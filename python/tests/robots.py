"""Robots and their kinematics: laws, errors with fields, Ctrl-C, the interpreter's lock."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import canter

ROOT = Path(__file__).resolve().parents[2]


def positions(robot, count, seed=1):
    """Random joints in the middle half of the ranges."""
    limits = robot.limits
    low = np.where(np.isfinite(limits.lower), limits.lower, -np.pi)
    high = np.where(np.isfinite(limits.upper), limits.upper, np.pi)
    share = np.random.default_rng(seed).uniform(0.25, 0.75, (count, robot.dof))
    return low + share * (high - low)


class Kinematics(unittest.TestCase):
    def test_every_shipped_robot_reaches_its_own_poses(self):
        for name in canter.robots():
            robot = canter.Robot(name)
            q = positions(robot, 20)
            poses = robot.fk(q)
            found = robot.ik_batch(poses, near=q)
            self.assertTrue(found.success.all(), name)
            self.assertLess(abs(robot.fk(found.q) - poses).max(), 1e-7, name)
            self.assertTrue((found.q >= robot.limits.lower).all())
            self.assertTrue((found.q <= robot.limits.upper).all())
            one = robot.ik(poses[3], near=q[3])
            self.assertEqual(one.tolist(), found.q[3].tolist(), name)

    def test_the_jacobian_is_the_derivative(self):
        for point in ("tool", "flange"):
            robot = canter.Robot("ur5e")
            q, h = positions(robot, 1)[0], 1e-6
            jacobian = robot.jacobian(q, point=point)
            self.assertEqual(jacobian.shape, (6, 6))
            for joint in range(robot.dof):
                step = h * np.eye(robot.dof)[joint]
                before, after = robot.fk(np.stack([q - step, q + step]), point=point)
                moved = (after - before) / (2 * h)
                turn = moved[:3, :3] @ robot.fk(q, point=point)[:3, :3].T
                angular = [turn[2, 1], turn[0, 2], turn[1, 0]]
                measured = np.concatenate([moved[:3, 3], angular])
                self.assertLess(abs(measured - jacobian[:, joint]).max(), 1e-7)

    def test_all_branches_reach_the_pose(self):
        robot = canter.Robot("ur5e")
        pose = robot.fk([0.3, -1.2, 1.4, -1.5, -1.4, 0.2])
        branches = robot.ik_all(pose)
        self.assertGreater(len(branches), 3)
        self.assertLess(abs(robot.fk(branches) - pose).max(), 1e-9)
        iiwa = canter.Robot("iiwa14")
        pose = iiwa.fk(iiwa.home)
        ways = [iiwa.ik_all(pose, swivel=swivel) for swivel in iiwa.swivels(8)]
        ways = np.concatenate(ways)
        self.assertGreater(len(ways), 8)
        self.assertLess(abs(iiwa.fk(ways) - pose).max(), 1e-9)

    def test_the_number_of_threads_changes_nothing(self):
        robot = canter.Robot("panda")
        poses = robot.fk(positions(robot, 1000))
        one, all_ = robot.ik_batch(poses, threads=1), robot.ik_batch(poses)
        self.assertEqual(one.q.tobytes(), all_.q.tobytes())

    def test_shapes_are_kept(self):
        robot = canter.Robot("ur5e")
        self.assertEqual(robot.fk(np.zeros((2, 3, 6))).shape, (2, 3, 4, 4))
        self.assertEqual(robot.jacobian(np.zeros((0, 6))).shape, (0, 6, 6))
        self.assertEqual(robot.ik_batch(np.zeros((0, 4, 4))).q.shape, (0, 6))
        for bad in ([1, 2], np.zeros((3, 7)), 5.0):
            with self.assertRaises(ValueError):
                robot.fk(bad)
        with self.assertRaises(TypeError):
            robot.fk("home")
        with self.assertRaises(ValueError):
            robot.ik(np.zeros((4, 4)))
        with self.assertRaisesRegex(ValueError, "pose 1"):
            robot.ik_batch(np.stack([np.eye(4), 2 * np.eye(4)]))

    def test_poses_in_all_forms(self):
        rng = np.random.default_rng(3)
        rows = np.concatenate([rng.uniform(-1, 1, (50, 3)), rng.normal(size=(50, 4))], axis=1)
        rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
        rows[:, 3:] *= np.where(rows[:, 3:4] < 0, -1, 1)
        from canter._poses import matrix

        self.assertLess(abs(canter.pose7(matrix(rows)) - rows).max(), 1e-12)
        turned = canter.pose([1, 2, 3], rpy=[0.1, 0.2, 0.3])
        axes = canter.pose([1, 2, 3], z_axis=turned[:3, 2], x_axis=turned[:3, 0])
        self.assertLess(abs(turned - axes).max(), 1e-12)
        again = canter.pose([1, 2, 3], quaternion=canter.pose7(turned)[3:])
        self.assertLess(abs(turned - again).max(), 1e-12)
        with self.assertRaises(ValueError):
            canter.pose(z_axis=[0, 0, 1], x_axis=[0, 0, 1])


class Errors(unittest.TestCase):
    def test_a_pose_out_of_reach_says_how_far(self):
        robot = canter.Robot("ur5e")
        with self.assertRaises(canter.IkError) as caught:
            robot.ik(canter.pose([2.0, 0, 0.3]))
        error = caught.exception
        self.assertEqual(error.reason, "out of reach")
        self.assertGreater(error.value, 0.5)
        self.assertEqual(len(error.nearest), 6)
        self.assertIsNone(error.joint)
        found = robot.ik_batch(np.stack([canter.pose([2.0, 0, 0.3]), robot.fk(robot.home)]))
        self.assertEqual(found.success.tolist(), [False, True])
        self.assertTrue(np.isnan(found.q[0]).all())
        self.assertAlmostEqual(found.position_error[0], error.position_error)

    def test_robots_that_cannot_be_used_name_the_place(self):
        with self.assertRaisesRegex(canter.RobotError, "ur5e"):
            canter.Robot("ur55e")
        with tempfile.TemporaryDirectory() as folder:
            robot = canter.Robot("ur5e")
            (Path(folder) / "robot.urdf").write_text(robot.urdf)
            (Path(folder) / "robot.toml").write_text(robot.toml + "\nmounted = 3\n")
            with self.assertRaises(canter.RobotError) as caught:
                canter.Robot(folder)
            self.assertTrue(caught.exception.file.endswith("robot.toml"))
            self.assertGreater(caught.exception.line, 1)
            (Path(folder) / "robot.toml").write_text(robot.toml)
            self.assertEqual(canter.Robot(folder).dof, 6)
            own = Path(folder) / "own.urdf"
            own.write_text(robot.urdf)
            self.assertEqual(canter.Robot(own).joint_names, robot.joint_names)
            made = canter.Robot.import_urdf(own, Path(folder) / "made")
            self.assertEqual(made.name, "made")
            own.write_text("<robot name='x'>")
            with self.assertRaises(canter.RobotError) as caught:
                canter.Robot(own)
            self.assertEqual(caught.exception.line, 1)


class LongCalls(unittest.TestCase):
    def test_other_threads_run_while_rust_works(self):
        robot = canter.Robot("xarm6")
        poses = robot.fk(positions(robot, 20_000))
        turns, ends = 0, threading.Event()

        def count():
            nonlocal turns
            while not ends.is_set():
                turns += 1
                time.sleep(1e-4)

        counter = threading.Thread(target=count)
        counter.start()
        time.sleep(0.01)
        before = turns
        robot.ik_batch(poses, threads=1)
        during = turns - before
        ends.set()
        counter.join()
        # With the lock held it would not have run once.
        self.assertGreater(during, 3)

    def test_control_c_ends_a_long_call(self):
        code = (
            "import canter, numpy as np, sys\n"
            "robot = canter.Robot('gantry')\n"
            "pose = np.broadcast_to(canter.pose([9, 9, 9]), (2_000_000, 4, 4))\n"
            "robot.ik_batch(pose[:2])\n"
            "print('begins', flush=True)\n"
            "try:\n"
            "    robot.ik_batch(pose)\n"
            "except KeyboardInterrupt:\n"
            "    sys.exit(42)\n"
        )
        child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
        self.assertEqual(child.stdout.readline(), b"begins\n")
        time.sleep(0.5)
        self.assertIsNone(child.poll(), "the call was over too soon to be interrupted")
        os.kill(child.pid, signal.SIGINT)
        self.assertEqual(child.wait(timeout=60), 42)
        child.stdout.close()


if __name__ == "__main__":
    unittest.main()
