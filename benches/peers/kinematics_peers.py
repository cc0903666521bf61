#!/usr/bin/env python3
"""Cold inverse kinematics of Python-callable peers on the poses of `cargo bench -p benches --bench kinematics`.

Run that bench first: it writes target/kinematics-bench/<arm>.csv (pose and seed a row)
and ours.csv (our mean times). Then

    python3 -m venv .venv && .venv/bin/pip install numpy pin pytracik roboticstoolbox-python EAIK
    .venv/bin/python benches/peers/kinematics_peers.py [--poses 1000] [arm ...]

Peers that are not installed are skipped. Every answer is checked with pinocchio's
forward kinematics when it is there, at 1e-5 m and 1e-5 rad, and against the joint limits.
Times include the call from Python (well under 2 us for the compiled peers; the loop around
pinocchio is itself in Python, as its examples are). Ends with lines `ratio <peer>-<arm> <ours/peer>`,
with our closed form `ratio <peer>-<arm>-closed`.
"""
import argparse
import csv
import math
import pathlib
import statistics
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "target" / "kinematics-bench"


def load(arm, count):
    with open(DATA / f"{arm}.csv") as file:
        rows = [[float(x) for x in row] for row in list(csv.reader(file))[1 : count + 1]]
    return [(row[:7], row[7:]) for row in rows]


def matrix(pose):
    import numpy as np

    x, y, z, qw, qx, qy, qz = pose
    t = np.eye(4)
    t[:3, :3] = [
        [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qw * qz), 2 * (qx * qz + qw * qy)],
        [2 * (qx * qy + qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qw * qx)],
        [2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)],
    ]
    t[:3, 3] = x, y, z
    return t


class Checker:
    """Forward kinematics and limits by pinocchio."""

    def __init__(self, urdf):
        import pinocchio

        self.pin = pinocchio
        self.model = pinocchio.buildModelFromUrdf(str(urdf))
        self.data = self.model.createData()
        self.frame = self.model.getFrameId("flange")

    def good(self, q, target):
        import numpy as np

        if q is None:
            return False
        if isinstance(q, list):
            return any(self.good(one, target) for one in q)
        q = np.asarray(q, float)
        lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
        turned = np.where(q > upper + 1e-6, q - 2 * math.pi, np.where(q < lower - 1e-6, q + 2 * math.pi, q))
        if (turned > upper + 1e-6).any() or (turned < lower - 1e-6).any():
            return False
        self.pin.framesForwardKinematics(self.model, self.data, q)
        found = self.data.oMf[self.frame].homogeneous
        turn = found[:3, :3].T @ target[:3, :3]
        angle = math.acos(max(-1.0, min(1.0, (np.trace(turn) - 1) / 2)))
        # The arc cosine resolves no angle below about 2e-8.
        return np.linalg.norm(found[:3, 3] - target[:3, 3]) <= 1e-5 and angle <= 1e-5


def tracik(urdf, dof):
    from trac_ik import TracIK

    solver = TracIK("base_link", "flange", str(urdf))
    return lambda t, seed: solver.ik(t[:3, 3], t[:3, :3], seed_jnt_values=seed)


def pinocchio(urdf, dof):
    """Closed loop with damping and fixed restarts, as pinocchio's documentation shows it."""
    import numpy as np
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    frame = model.getFrameId("flange")
    random = np.random.default_rng(1)

    def solve(t, seed):
        target = pin.SE3(t)
        for _ in range(30):
            q = np.array(seed)
            for _ in range(100):
                pin.framesForwardKinematics(model, data, q)
                error = pin.log(data.oMf[frame].actInv(target)).vector
                if np.linalg.norm(error) < 1e-6:
                    if (q >= model.lowerPositionLimit).all() and (q <= model.upperPositionLimit).all():
                        return q
                    break
                j = pin.computeFrameJacobian(model, data, q, frame)
                q = q + j.T @ np.linalg.solve(j @ j.T + 1e-6 * np.eye(6), error)
            seed = random.uniform(model.lowerPositionLimit, model.upperPositionLimit)
        return None

    return solve


def toolbox(urdf, dof):
    import roboticstoolbox as rtb

    robot = rtb.Robot.URDF(str(urdf))
    ets = robot.ets(end="flange")

    def solve(t, seed):
        answer = ets.ik_LM(t, q0=seed, tol=1e-11, joint_limits=True)
        return answer.q if answer.success else None

    return solve


def eaik(urdf, dof):
    from eaik.IK_URDF import UrdfRobot

    import numpy as np

    robot = UrdfRobot(str(urdf))
    # It leaves out the turn of the last fixed joint.
    checker = Checker(urdf)
    q = np.zeros(dof)
    checker.pin.framesForwardKinematics(checker.model, checker.data, q)
    fixed = np.linalg.inv(checker.data.oMf[checker.frame].homogeneous) @ robot.fwdKin(q)

    def solve(t, seed):
        """All answers; limits are not its business, so any inside them counts."""
        return list(robot.IK(t @ fixed).Q)

    return solve


PEERS = {"trac-ik": tracik, "pinocchio": pinocchio, "roboticstoolbox": toolbox, "eaik": eaik}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", default=["ur5e", "irb120", "panda", "iiwa14"])
    parser.add_argument("--poses", type=int, default=1000)
    options = parser.parse_args()
    if not (DATA / "ours.csv").exists():
        sys.exit("run `cargo bench -p benches --bench kinematics` first")
    with open(DATA / "ours.csv") as file:
        ours = {(row["arm"], row["solver"]): float(row["mean_us"]) for row in csv.DictReader(file)}
    ratios = []
    for arm in options.arms:
        urdf = ROOT / "robots" / arm / "robot.urdf"
        cases = load(arm, options.poses)
        try:
            checker = Checker(urdf)
        except ImportError:
            checker = None
            print("pinocchio (pip: pin) is not installed: answers are not checked")
        for name, make in PEERS.items():
            try:
                solve = make(urdf, len(cases[0][1]))
            except ImportError:
                print(f"{arm:>14} | {name:<16} | not installed")
                continue
            except Exception as error:  # a peer that cannot take this arm
                print(f"{arm:>14} | {name:<16} | refused: {error}")
                continue
            times, good = [], 0
            for pose, seed in cases:
                target = matrix(pose)
                best = math.inf
                # The fastest of three counts, as in our bench: other work on the machine does not.
                for _ in range(3):
                    begin = time.perf_counter_ns()
                    try:
                        q = solve(target, seed)
                    except Exception:
                        q = None
                    best = min(best, (time.perf_counter_ns() - begin) / 1e3)
                times.append(best)
                good += checker.good(q, target) if checker else q is not None
            mean, median = statistics.fmean(times), statistics.median(times)
            print(f"{arm:>14} | {name:<16} | mean {mean:9.1f} us | median {median:9.1f} us | {100 * good / len(cases):6.2f} %")
            ratios += [(f"{name}-{arm}", ours[arm, "numeric"] / mean), (f"{name}-{arm}-closed", ours[arm, "best"] / mean)]
    for name, ratio in ratios:
        print(f"ratio {name} {ratio:.5f}")


if __name__ == "__main__":
    main()
