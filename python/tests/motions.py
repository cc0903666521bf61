"""State-to-state motions: durations of Ruckig, its interface, laws, errors with fields."""

import pickle
import unittest
from unittest import mock

import numpy as np
import ruckig

import canter
from canter import otg


def problem(rng, dof):
    """A random problem for Ruckig and for us, from any state to any state."""
    inp = ruckig.InputParameter(dof)
    inp.max_velocity = rng.uniform(0.5, 3, dof).tolist()
    inp.max_acceleration = rng.uniform(1, 10, dof).tolist()
    inp.max_jerk = rng.uniform(10, 100, dof).tolist()
    inp.current_position = rng.uniform(-3, 3, dof).tolist()
    inp.target_position = rng.uniform(-3, 3, dof).tolist()
    inp.current_velocity = (rng.uniform(-0.3, 0.3, dof)).tolist()
    inp.target_velocity = (rng.uniform(-0.3, 0.3, dof)).tolist()
    inp.current_acceleration = (rng.uniform(-0.3, 0.3, dof)).tolist()
    return inp


FIELDS = (
    "max_velocity max_acceleration max_jerk current_position target_position current_velocity "
    "target_velocity current_acceleration target_acceleration"
).split()


def ours(theirs):
    inp = otg.InputParameter(theirs.degrees_of_freedom)
    for name in FIELDS:
        setattr(inp, name, list(getattr(theirs, name)))
    return inp


class Durations(unittest.TestCase):
    def test_they_are_those_of_ruckig(self):
        rng = np.random.default_rng(7)
        for _ in range(300):
            inp = problem(rng, 6)
            theirs, mine = ruckig.Trajectory(6), otg.Trajectory(6)
            ruckig.Ruckig(6).calculate(inp, theirs)
            otg.Ruckig(6).calculate(ours(inp), mine)
            self.assertLess(abs(mine.duration - theirs.duration), 1e-9)
            end = mine.at_time(mine.duration)
            self.assertEqual(end[0], list(inp.target_position))

    def test_many_at_once_are_the_same(self):
        rng = np.random.default_rng(8)
        states = rng.uniform(-1, 1, (500, 6, 7))
        states[:, 1:3] *= 0.3
        states[:, 4:] *= 0.3
        limits = {"velocity": 2, "acceleration": 8, "jerk": np.full(7, 80.0)}
        durations, at = otg.states_at(states, 0.02, **limits)
        self.assertEqual(durations.tobytes(), otg.durations(states, threads=1, **limits).tobytes())
        for k in range(0, 500, 25):
            one = canter.move(
                states[k, 0],
                states[k, 3],
                start_velocity=states[k, 1],
                start_acceleration=states[k, 2],
                target_velocity=states[k, 4],
                target_acceleration=states[k, 5],
                **limits,
            )
            self.assertEqual(one.duration, durations[k])
            for mine, all_ in zip(one.at(0.02), at):
                self.assertEqual(mine.tolist(), all_[k].tolist())


class Interface(unittest.TestCase):
    def control(self, module, inp):
        """The control loop of Ruckig's documentation."""
        loop, out = module.Ruckig(inp.degrees_of_freedom, 0.01), module.OutputParameter(3)
        states = []
        result = module.Result.Working
        while result == module.Result.Working:
            result = loop.update(inp, out)
            states.append(list(out.new_position))
            out.pass_to_input(inp)
        return np.array(states), out.trajectory.duration

    def test_the_control_loop_of_ruckig_runs(self):
        theirs = problem(np.random.default_rng(9), 3)
        mine = ours(theirs)
        expected, duration = self.control(ruckig, theirs)
        found, also = self.control(otg, mine)
        self.assertAlmostEqual(duration, also, places=9)
        self.assertEqual(len(expected), len(found))
        # Between the ends, joints that are not the slowest may go different ways.
        self.assertLess(abs(found[-2:] - expected[-2:]).max(), 2e-2)
        self.assertEqual(otg.Result.Finished.value, 1)

    def test_limits_hold_and_the_pieces_are_the_motion(self):
        motion = canter.move([0, 0.5], [1, -2], velocity=[1, 2], acceleration=4, jerk=60)
        t = np.linspace(0, motion.duration, 2000)
        state = motion.at(t)
        self.assertEqual(state.position.shape, (2000, 2))
        self.assertTrue((abs(state.velocity) <= np.array([1, 2]) * (1 + 1e-12)).all())
        self.assertTrue((abs(state.acceleration) <= 4 * (1 + 1e-12)).all())
        self.assertTrue((abs(state.jerk) <= 60 * (1 + 1e-12)).all())
        durations, coefficients = motion.pieces()
        self.assertAlmostEqual(durations.sum(), motion.duration)
        start = 0.0
        for duration, piece in zip(durations, coefficients):
            powers = (duration / 2) ** np.arange(6)
            there = motion.at(start + duration / 2).position
            self.assertLess(abs(piece @ powers - there).max(), 1e-12)
            start += duration

    def test_phase_velocity_and_period(self):
        straight = canter.move(
            [0, 0], [1, 2], velocity=1, acceleration=2, jerk=9, synchronisation="phase"
        )
        state = straight.at(np.linspace(0, straight.duration, 50))
        self.assertTrue(straight.is_straight)
        self.assertLess(abs(2 * state.position[:, 0] - state.position[:, 1]).max(), 1e-12)
        ticks = canter.move([0], [1], velocity=1, acceleration=2, jerk=9, period=0.008)
        self.assertAlmostEqual(ticks.duration / 0.008 % 1 % 1, 0, places=6)
        inp = otg.InputParameter(1)
        inp.control_interface = otg.ControlInterface.Velocity
        inp.target_velocity, inp.max_acceleration, inp.max_jerk = [0.5], [1], [10]
        inp.max_velocity = [1]
        found = otg.Trajectory(1)
        otg.Ruckig(1).calculate(inp, found)
        self.assertEqual(found.at_time(found.duration)[1], [0.5])


class Fields(unittest.TestCase):
    """The fields of a problem are read as they are or through arrays; nobody sees a difference."""

    CHANGES = [
        {},
        {"max_velocity": 2.0},
        {"current_position": np.zeros(6), "target_position": (1, 2, 3, 0.5, 0, -1)},
        {"target_position": np.arange(12.0)[::2], "enabled": [True] * 5 + [False]},
        {"min_velocity": [-0.5] * 6, "max_position": [3.0] * 6, "minimum_duration": 4},
        {"min_acceleration": [-1] * 6, "min_position": None},
        {"control_interface": otg.ControlInterface.Velocity, "target_velocity": [0.1] * 6},
        {"synchronization": otg.Synchronization.Phase},
        {"synchronization": otg.Synchronization.No},
        {"max_jerk": [0.0] * 6},
        {"max_velocity": [np.nan] * 6},
        {"min_velocity": [np.nan] * 6},
        {"target_velocity": [3.0] * 6},
        {"current_position": [0.0] * 5},
        {"current_position": ["a"] * 6},
        {"enabled": [1] * 6},
        {"enabled": [True] * 5},
        {"synchronization": otg.Synchronization.TimeIfNecessary},
    ]

    def outcome(self, change):
        inp = otg.InputParameter(6)
        inp.max_velocity, inp.max_acceleration, inp.max_jerk = [2.0] * 6, [8.0] * 6, [80.0] * 6
        inp.target_position = [1.0, 0.5, -0.5, 0.25, 0.1, 0.0]
        for name, value in change.items():
            setattr(inp, name, value)
        trajectory = otg.Trajectory(6)
        try:
            otg.Ruckig(6).calculate(inp, trajectory)
        except (ValueError, TypeError, canter.OtgError) as error:
            return repr(error)
        return trajectory.duration, trajectory.at_time(0.3 * trajectory.duration)

    def test_both_ways_are_one(self):
        with mock.patch.object(otg._canter, "otg_of", wraps=otg._canter.otg_of) as direct:
            quick = [self.outcome(change) for change in self.CHANGES]
            self.assertGreater(direct.call_count, len(self.CHANGES) - 2)
        with mock.patch.object(otg._canter, "otg_of", return_value=None):
            slow = [self.outcome(change) for change in self.CHANGES]
        self.assertEqual(quick, slow)
        self.assertEqual([isinstance(one, tuple) for one in quick], [True] * 9 + [False] * 9)

    def test_plain_fields_need_no_arrays(self):
        inp = otg.InputParameter(2)
        inp.max_velocity = inp.max_acceleration = [1.0, 1.0]
        inp.target_position = np.array([1.0, 2.0])
        with mock.patch.object(otg, "_limits", side_effect=AssertionError("arrays were made")):
            self.assertEqual(otg.Ruckig(2).calculate(inp, otg.Trajectory(2)), otg.Result.Working)


class Errors(unittest.TestCase):
    def test_they_name_joint_quantity_value_and_limit(self):
        with self.assertRaises(canter.OtgError) as caught:
            canter.move([0, 0], [1, 1], target_velocity=[0, 5], velocity=1, acceleration=1, jerk=1)
        error = caught.exception
        self.assertEqual((error.joint, error.quantity, error.value), (1, "velocity", 5.0))
        self.assertEqual(error.limit, 1.0)
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((again.joint, str(again)), (1, str(error)))
        with self.assertRaises(canter.OtgError) as caught:
            canter.move([0], [1], velocity=1, acceleration=-1, jerk=1)
        self.assertEqual((caught.exception.joint, caught.exception.value), (0, -1.0))
        states = np.zeros((3, 6, 2))
        states[2, 3, 1] = np.nan
        with self.assertRaises(canter.OtgError) as caught:
            otg.durations(states, velocity=1, acceleration=1, jerk=1)
        self.assertEqual((caught.exception.index, caught.exception.joint), (2, 1))

    def test_shapes_are_checked(self):
        for bad in ({"start": [[0]]}, {"target": [0, 0]}, {"start": np.zeros(9)}):
            given = {"start": [0.0], "target": [1.0], **bad}
            with self.assertRaises(ValueError):
                canter.move(**given, velocity=1, acceleration=1)
        with self.assertRaises(ValueError):
            canter.move([0], [1], velocity=1, acceleration=1, synchronisation="together")


if __name__ == "__main__":
    unittest.main()
