#!/usr/bin/env python3
"""Speed through Python: inverse kinematics of 1e6 poses, 1e5 state-to-state motions, 1000 timed paths.

    python3 -m venv .venv
    .venv/bin/pip install canter-*.whl numpy ruckig toppra pin pytracik roboticstoolbox-python
    .venv/bin/python benches/peers/python_peers.py [--poses 1000000] [--states 100000] [--paths 1000]

Everything is called from Python as its own documentation shows. Peers that take one problem a call are
called in a loop; inverse kinematics of peers is timed on the first `--peer-poses` poses only, since a
million would take them minutes to hours, and compared per pose. The same poses, seeds (the middle of the
joint ranges), states and waypoints for all. Answers are checked: poses with our forward kinematics at 1e-5
m and rad, durations against ruckig's. `one` is one thread, as the peers have; `all` uses all processors.

Budget: 1e6 poses of a UR5e in 1 s on one thread; a state-to-state motion of 6 joints in 10 us.
The last lines are `ratio <name> <ours/peer>`; peers that are not installed are left out.
"""

import argparse
import os
import pathlib
import sys
import time

import numpy as np

import canter
from canter import otg

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import kinematics_peers

ROOT = pathlib.Path(__file__).resolve().parents[2]
ratios = []


def timed(work, times=3):
    """Least time of some runs (s), and the last result."""
    least = np.inf
    for _ in range(times):
        begin = time.perf_counter()
        result = work()
        least = min(least, time.perf_counter() - begin)
    return least, result


def row(what, who, seconds, count, remark=""):
    print(f"{what:>10} | {who:<22} | {seconds / count * 1e6:10.3f} us each | {remark}", flush=True)


def kinematics(options):
    for name in ("ur5e", "panda"):
        robot = canter.Robot(name)
        rng = np.random.default_rng(1)
        limits = robot.limits
        q = rng.uniform(limits.lower, limits.upper, (options.poses, robot.dof))
        poses = robot.fk(q, point="flange")
        middle = 0.5 * (limits.lower + limits.upper)
        seconds = {}
        for who, threads in (("one", 1), ("all", None)):
            seconds[who], found = timed(
                lambda: robot.ik_batch(poses, near=middle, point="flange", threads=threads)
            )
            again = robot.fk(found.q[found.success], point="flange")
            assert abs(again - poses[found.success]).max() < 1e-7
            share = f"{100 * found.success.mean():.3f} % of {options.poses} solved"
            row(f"ik {name}", f"canter, {who}", seconds[who], options.poses, share)
        urdf = ROOT / "robots" / name / "robot.urdf"
        for peer in ("trac-ik", "pinocchio", "roboticstoolbox"):
            try:
                solve = kinematics_peers.PEERS[peer](urdf, robot.dof)
            except Exception as error:
                print(f"{name}: {peer} is left out: {error!r}")
                continue
            some = poses[: options.peer_poses]
            begin = time.perf_counter()
            answers = [solve(pose, middle) for pose in some]
            spent = time.perf_counter() - begin
            good = [k for k, answer in enumerate(answers) if answer is not None]
            again = robot.fk(np.array([answers[k] for k in good]), point="flange")
            right = (abs(again - some[good]) < 1e-5).all(axis=(1, 2)).sum() / len(some)
            row(f"ik {name}", peer, spent, len(some), f"{100 * right:.1f} % right")
            for who in ("one", "all"):
                ours = seconds[who] / options.poses
                ratios.append((f"ik-{name}-{peer}-{who}", ours / (spent / len(some))))


def motions(options):
    dof = 6
    rng = np.random.default_rng(2)
    states = rng.uniform(-1, 1, (options.states, 6, dof))
    states[:, [1, 2, 4]] *= 0.3
    states[:, 5] = 0
    seconds = {}
    limits = {"velocity": 2.0, "acceleration": 8.0, "jerk": 80.0}
    for who, threads in (("one", 1), ("all", None)):
        seconds[who], durations = timed(lambda: otg.durations(states, threads=threads, **limits))
        row("otg", f"canter, {who}", seconds[who], len(states))

    def loop(module):
        planner, problem = module.Ruckig(dof), module.InputParameter(dof)
        problem.max_velocity, problem.max_acceleration = [2.0] * dof, [8.0] * dof
        problem.max_jerk = [80.0] * dof
        found = np.empty(len(states))
        motion = module.Trajectory(dof)
        for k, state in enumerate(states):
            problem.current_position, problem.current_velocity = state[0], state[1]
            problem.current_acceleration = state[2]
            problem.target_position, problem.target_velocity = state[3], state[4]
            planner.calculate(problem, motion)
            found[k] = motion.duration
        return found

    alone, _ = timed(lambda: loop(otg), 1)
    row("otg", "canter, one by one", alone, len(states))
    try:
        import ruckig
    except ImportError:
        return print("ruckig is left out: it is not installed")
    theirs, expected = timed(lambda: loop(ruckig), 1)
    off = abs(expected - durations).max()
    row("otg", "ruckig", theirs, len(states), f"durations differ by {off:.1e} s at most")
    assert off < 1e-8
    ratios.append(("otg-ruckig-one-by-one", alone / theirs))
    ratios.extend((f"otg-ruckig-{who}", seconds[who] / theirs) for who in seconds)


def paths(options):
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (options.paths, 11, 7))
    given = {"velocity": 2.0, "acceleration": 10.0}

    def ours(jerk):
        return [canter.time_path(p, jerk=jerk, **given).duration for p in points]

    seconds, durations = timed(lambda: ours(None), 1)
    row("paths", "canter, without jerk", seconds, len(points), f"mean {np.mean(durations):.4f} s")
    jerky, longer = timed(lambda: ours(200.0), 1)
    row("paths", "canter, jerk 200", jerky, len(points), f"mean {np.mean(longer):.4f} s")
    try:
        import logging

        import toppra
        import toppra.algorithm
        import toppra.constraint
    except ImportError:
        return print("toppra is left out: it is not installed")
    logging.getLogger("toppra").setLevel(logging.ERROR)
    limit = np.array([[-2.0, 2.0]] * 7)

    def theirs(p):
        path = toppra.SplineInterpolator(np.arange(11), p, bc_type="natural")
        limits = [
            toppra.constraint.JointVelocityConstraint(limit),
            toppra.constraint.JointAccelerationConstraint(5 * limit),
        ]
        return toppra.algorithm.TOPPRA(limits, path).compute_trajectory().duration

    spent, expected = timed(lambda: [theirs(p) for p in points], 1)
    row("paths", "toppra", spent, len(points), f"mean {np.mean(expected):.4f} s")
    ratios.append(("paths-toppra", seconds / spent))
    ratios.append(("paths-toppra-with-jerk", jerky / spent))
    ratios.append(("paths-toppra-duration", np.mean(durations) / np.mean(expected)))


def plans(options):
    """Whole programs; no peer plans them."""
    program = (ROOT / "examples/pick_and_place.canon").read_text()
    robot = canter.Robot("ur5e")
    count = options.paths
    seconds, _ = timed(lambda: [canter.plan(program, robot).duration for _ in range(count)], 1)
    row("plans", "canter, one by one", seconds, count, "pick_and_place, ur5e")
    seconds, _ = timed(lambda: canter.plan_many([(program, robot)] * count), 1)
    row("plans", "canter, all", seconds, count)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--poses", type=int, default=1_000_000)
    parser.add_argument("--peer-poses", type=int, default=2000)
    parser.add_argument("--states", type=int, default=100_000)
    parser.add_argument("--paths", type=int, default=1000)
    options = parser.parse_args()
    print(f"canter {canter.__version__}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for part in (kinematics, motions, paths, plans):
        part(options)
    for name, ratio in ratios:
        print(f"ratio {name} {ratio:.5f}")


if __name__ == "__main__":
    main()
