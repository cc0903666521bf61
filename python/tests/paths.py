"""Time laws of paths and smooth motions: toppra as a second opinion, certificates, errors."""

import logging
import unittest

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

import canter
from canter import timing

logging.getLogger("toppra").setLevel(logging.ERROR)


def waypoints(seed, count=8, dof=6):
    return np.random.default_rng(seed).uniform(-1, 1, (count, dof))


class TimeLaws(unittest.TestCase):
    def test_the_programs_of_toppra_run_and_their_times_are_met(self):
        def solve(module, points):
            """As in toppra's documentation."""
            ss = np.linspace(0, 1, len(points))
            path = module.SplineInterpolator(ss, points, bc_type="natural")
            limit = np.array([[-2.0, 2.0]] * points.shape[1])
            velocity = module.constraint.JointVelocityConstraint(limit)
            acceleration = module.constraint.JointAccelerationConstraint(5 * limit)
            return module.algorithm.TOPPRA([velocity, acceleration], path).compute_trajectory()

        for seed in range(5):
            points = waypoints(seed)
            theirs, mine = solve(toppra, points), solve(timing, points)
            # toppra's accelerations jump; ours build up within a millisecond.
            self.assertLess(mine.duration, 1.005 * theirs.duration)
            self.assertGreater(mine.duration, 0.995 * theirs.duration)
            self.assertTrue(mine.certificate["holds"])
            t = np.linspace(0, mine.duration, 1000)
            self.assertLessEqual(abs(mine(t, 1)).max(), 2 * (1 + 1e-9))
            self.assertLessEqual(abs(mine(t, 2)).max(), 10 * (1 + 1e-9))
            self.assertLess(abs(mine(0) - points[0]).max(), 1e-9)
            self.assertLess(abs(mine(mine.duration) - points[-1]).max(), 1e-7)

    def test_jerk_is_limited_and_the_path_is_kept(self):
        points = waypoints(3, dof=7)
        path = canter.time_path(points, velocity=2, acceleration=10, jerk=200)
        free = canter.time_path(points, velocity=2, acceleration=10)
        self.assertGreater(path.duration, free.duration)
        self.assertGreaterEqual(path.duration, path.certificate["lower_bound_s"])
        state = path.at(np.linspace(0, path.duration, 3000))
        self.assertLessEqual(abs(state.jerk).max(), 200 * (1 + 1e-9))
        u, rate = path.parameter(np.linspace(0, path.duration, 3000))
        self.assertTrue((np.diff(u) >= -1e-12).all())
        self.assertAlmostEqual(u[-1], len(points) - 1)
        spline = np.array([path._own.path(np.ascontiguousarray(u))])[0]
        self.assertLess(abs(spline - state.position).max(), 1e-6)

    def test_errors_have_fields(self):
        with self.assertRaises(canter.TimingError) as caught:
            canter.time_path([[0, 0], [1, 1]], velocity=[1, -1], acceleration=1)
        error = caught.exception
        self.assertEqual((error.joint, error.quantity, error.value), (1, "velocity", -1.0))
        with self.assertRaises(canter.TimingError):
            canter.time_path([[0.0], [np.nan]], velocity=1, acceleration=1)
        for knots in ([0, 0], [1, 2], [0]):
            with self.assertRaises(ValueError):
                canter.time_path([[0.0], [1.0]], knots=knots, velocity=1, acceleration=1)


LIMITS = canter.Robot("ur5e").tool_limits


class Smooth(unittest.TestCase):
    def test_poses_are_passed_within_the_tolerance(self):
        corners = [(0.4, -0.2, 0.3), (0.5, 0, 0.4), (0.4, 0.2, 0.3), (0.3, 0, 0.25)]
        poses = np.stack([canter.pose(xyz, rpy=[np.pi, 0, 0.1 * k]) for k, xyz in enumerate(corners)])
        motion = canter.smooth(poses, 0.01, LIMITS)
        self.assertTrue(motion.certificate["holds"])
        self.assertLess(motion.duration, motion.exact_stop)
        self.assertEqual(motion.crossings["deviation"].shape, (2,))
        self.assertTrue((motion.crossings["deviation"] <= 0.01 + 1e-9).all())
        at = motion.at(motion.crossings["time"])
        off = np.linalg.norm(at.pose[:, :3, 3] - poses[1:-1, :3, 3], axis=1)
        self.assertLess(abs(off - motion.crossings["deviation"]).max(), 1e-9)
        speeds = motion.at(np.linspace(0, motion.duration, 500)).linear[:, 0]
        self.assertLessEqual(np.linalg.norm(speeds, axis=1).max(), LIMITS.speed * (1 + 1e-9))
        seven = canter.smooth(canter.pose7(poses), 0.01, LIMITS)
        self.assertAlmostEqual(seven.duration, motion.duration, places=6)

    def test_a_dense_list(self):
        angle = np.linspace(0, 2 * np.pi, 1001)
        circle = [canter.pose([0.5 + 0.1 * np.cos(a), 0.1 * np.sin(a), 0.3]) for a in angle]
        motion = canter.smooth(np.stack(circle), 0.001, LIMITS)
        self.assertTrue(motion.certificate["holds"])
        self.assertEqual(len(motion.crossings["time"]), 999)

    def test_errors_have_fields(self):
        poses = np.stack([np.eye(4), canter.pose([0.1, 0, 0])])
        with self.assertRaises(canter.SmoothError) as caught:
            canter.smooth(poses, -1, LIMITS)
        self.assertEqual((caught.exception.quantity, caught.exception.value), ("tolerance", -1.0))
        with self.assertRaises(ValueError):
            canter.smooth(np.zeros((0, 4, 4)), 0.001, LIMITS)
        poses[1, 0, 3] = np.inf
        with self.assertRaises(ValueError):
            canter.smooth(poses, 0.001, LIMITS)


if __name__ == "__main__":
    unittest.main()
