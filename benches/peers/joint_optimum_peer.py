"""Compare MoveSmoothlyTo where joints rule with a direct optimum in joint space (casadi, PyPI).

    pip install casadi numpy
    python3 benches/peers/joint_optimum_peer.py CANTER SUITE.json [ROBOT ...]

CANTER is the program `canter`, SUITE.json a file for `canter bench motion`; robots are ur5e, panda
and iiwa7 unless they are named. Lists of more than 60 poses or with orientations are left out.

Canter plans a program with the list, its middle where the robot's controlled point is at home. Then an
interior-point method (casadi with IPOPT) looks for the shortest motion under the same rules,
from Canter's motion as its start: joint positions, velocities, accelerations and jerks, the controlled
point's speed, acceleration and jerk as norms, the tool's orientation, each pose passed within the
tolerance, every leg within the corridor, rest at both ends. The jerk of each joint is constant in
each of the 4 to 16 steps of a leg; the tool's limits are kept at the ends of the steps. So it is a local
optimum of a problem that is a little easier at places and a little harder at others.

Prints both durations, their ratio, the share of the time in which a limit of a joint is reached and
the time that each needed, then the geometric mean for each robot.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
import tomllib
import xml.etree.ElementTree as xml
from pathlib import Path

import casadi as ca
import numpy as np

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
MOST_POSES = 60
# A limit counts as reached from this share on.
REACHED = 0.98
# How far the orientation may be off at the ends of the steps (sine of the angle).
TURNED = 1e-4


def rotation(roll, pitch, yaw):
    (a, b, c), (d, e, f) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    return np.array([
        [e * f, a * b * f - c * d, d * b * f + a * c],
        [e * c, a * b * c + d * f, d * b * c - a * f],
        [-b, a * e, d * e],
    ])


def frame(element):
    matrix = np.eye(4)
    if element is not None:
        matrix[:3, :3] = rotation(*map(float, element.get("rpy", "0 0 0").split()))
        matrix[:3, 3] = list(map(float, element.get("xyz", "0 0 0").split()))
    return matrix


class Robot:
    """The chain from the base to the flange, and the limits of joints and controlled point."""

    def __init__(self, canter, name):
        tree = xml.parse(ROBOTS / name / "robot.urdf").getroot()
        file = tomllib.loads((ROBOTS / name / "robot.toml").read_text())
        by_child = {joint.find("child").get("link"): joint for joint in tree.iter("joint")}
        link, chain = file["tip_link"], []
        while link in by_child:
            chain.insert(0, by_child[link])
            link = by_child[link].find("parent").get("link")
        self.chain = [(j.get("type"), frame(j.find("origin")), axis(j)) for j in chain]
        # With the margins that are planned with.
        shown = subprocess.run([canter, "robots", "show", name, "--json"], capture_output=True, check=True)
        joints = json.loads(shown.stdout)["joints"]
        self.lower, self.upper = np.array(joints["lower"]), np.array(joints["upper"])
        limits = (joints[key] for key in ("velocity", "acceleration", "jerk"))
        self.velocity, self.acceleration, self.jerk = map(np.array, limits)
        tool = file["tool_limits"]
        keys = ["speed_m_per_s", "acceleration_m_per_s2", "jerk_m_per_s3"]
        self.tool_limits = [float(tool[key]) for key in keys]
        mounted = [e for e in file.get("end_effector", []) if e["name"] == file.get("mounted")]
        self.tool = np.eye(4)
        if mounted:
            tcp = mounted[0]["flange_from_tcp"]
            self.tool[:3, 3] = tcp["position_m"]
            self.tool[:3, :3] = rotation(*tcp.get("roll_pitch_yaw_rad", [0.0] * 3))
        self.home = np.array(file["home"]["joints_rad_or_m"])

    def forward(self, q):
        """Position and rotation of the controlled point in the base, as casadi expressions of q."""
        pose, index = ca.SX(np.eye(4)), 0
        for kind, origin, (x, y, z) in self.chain:
            pose = pose @ ca.SX(origin)
            if kind == "fixed":
                continue
            turn, angle = ca.SX(np.eye(4)), q[index]
            index += 1
            if kind == "prismatic":
                turn[:3, 3] = ca.vertcat(x, y, z) * angle
            else:
                cross = ca.SX(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))
                turn[:3, :3] = ca.SX(np.eye(3)) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * cross @ cross
            pose = pose @ turn
        pose = pose @ ca.SX(self.tool)
        return pose[:3, 3], pose[:3, :3]


def axis(joint):
    element = joint.find("axis")
    values = [1.0, 0.0, 0.0] if element is None else list(map(float, element.get("xyz").split()))
    return np.array(values) / np.linalg.norm(values)


def plan(canter, name, points, turn, tolerance):
    """Canter's motion: times of the samples from its start, q, dq, ddq; its duration and planning time."""
    words = lambda v: "{%s}" % ", ".join(f"{x:.9f}" for x in v)
    pose = lambda p: "{%s, %s, %s}" % (words(p), words(turn[:, 2]), words(turn[:, 0]))
    listed = ",\n".join(pose(p) for p in points[1:])
    program = (
        'InitCanon()\nSetLengthUnits("mm")\nSetRelativeSpeed(100)\nSetRelativeAcceleration(100)\n'
        f"SetIntermediatePointTolerance({tolerance})\nMoveTo({pose(points[0])})\n"
        f"MoveSmoothlyTo({{{listed}}}, {len(points) - 1})\nEndCanon(0)\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        source, samples = Path(folder) / "p.canon", Path(folder) / "s.csv"
        source.write_text(program)
        ran = subprocess.run(
            [canter, "plan", str(source), "--robot", name, "--samples", str(samples), "--json"],
            capture_output=True, text=True,
        )
        if ran.returncode != 0:
            return None, ran.stdout + ran.stderr
        commands = json.loads(ran.stdout)["commands"]
        table = np.genfromtxt(samples, delimiter=",", names=True)
    smooth = [command for command in commands if command["name"] == "MoveSmoothlyTo"]
    rows = table[table["command"] == 6]
    n = len([key for key in table.dtype.names if key.startswith("dq")])
    columns = lambda key: np.stack([rows[f"{key}{i + 1}"] for i in range(n)], axis=1)
    motion = rows["t_s"] - rows["t_s"][0], columns("q"), columns("dq"), columns("ddq")
    return (motion, smooth[0]["certificate"]["duration_s"], smooth[0]["planning_s"]), ""


def passes(tool, points):
    """The sample nearest to each pose, in order."""
    found, first = [0], 0
    for index, point in enumerate(points[1:-1], 1):
        behind = len(tool) - (len(points) - 1 - index)
        # The next pose must not come before this one: the search ends at the first minimum near it.
        gaps = np.linalg.norm(tool[first + 1 : behind] - point, axis=1)
        near = np.flatnonzero(gaps < gaps.min() + 2e-3)
        first = first + 1 + int(near[0] + np.argmin(gaps[near[0] : near[0] + 60]))
        found.append(first)
    return found + [len(tool) - 1]


class Problem:
    """The shortest motion through the poses, as a nonlinear program."""

    def __init__(self, robot, points, turn, tolerance):
        self.robot, self.points, self.tolerance = robot, points, tolerance
        n = self.n = len(robot.lower)
        q, v, a, j = (ca.SX.sym(name, n) for name in "qvaj")
        p, r = robot.forward(q)
        speed = ca.jtimes(p, q, v)
        force = ca.jtimes(speed, q, v) + ca.jtimes(speed, v, a)
        jerk = ca.jtimes(force, q, v) + ca.jtimes(force, v, a) + ca.jtimes(force, a, j)
        off = ca.SX(turn).T @ r
        error = ca.vertcat(off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]) / 2
        caps = robot.tool_limits
        norms = [ca.sumsqr(x) / cap**2 for x, cap in zip((speed, force, jerk), caps)]
        self.place = ca.Function("place", [q], [p])
        self.look = ca.Function("look", [q, v, a, j], [p, error, ca.vertcat(*norms)])

    def solve(self, motion):
        times, q, v, a = motion
        tool = np.array(self.place.map(len(times))(q.T)).T
        at = passes(tool, self.points)
        legs = len(self.points) - 1
        steps = max(4, min(16, 120 // legs))
        self.w, self.w0, self.low, self.high = [], [], [], []
        self.g, self.g_low, self.g_high = [], [], []
        sample = lambda of, t: np.array([np.interp(t, times, column) for column in of.T])
        state = self.state("s0", [sample(x, 0.0) for x in (q, v, a)], first=q[0])
        total = 0
        for leg in range(legs):
            begin, end = times[at[leg]], times[at[leg + 1]]
            length = self.variable(f"T{leg}", [max(end - begin, 1e-3)], [1e-4], [20.0])
            total += length
            h = length / steps
            for step in range(steps):
                t0, t1 = (begin + (end - begin) * (step + i) / steps for i in (0, 1))
                guess = (sample(a, t1) - sample(a, t0)) / max(t1 - t0, 1e-4)
                bound = self.robot.jerk
                j = self.variable(f"j{leg}_{step}", np.clip(guess, -bound, bound), -bound, bound)
                last = leg + 1 == legs and step + 1 == steps
                after = self.state(f"s{leg}_{step}", [sample(x, t1) for x in (q, v, a)], rest=last)
                self.join(state, after, j, h)
                self.watch(state, j, leg)
                self.watch(after, j, leg)
                state = after
            self.pass_by(state[0], self.points[leg + 1], leg + 1 == legs)
        program = {"x": ca.vertcat(*self.w), "f": total, "g": ca.vertcat(*self.g)}
        options = {
            "ipopt.print_level": 0, "print_time": False, "ipopt.max_iter": 400, "ipopt.tol": 1e-6,
            "ipopt.max_cpu_time": 240.0, "ipopt.mu_init": 1e-3, "ipopt.acceptable_tol": 1e-4,
        }
        solver = ca.nlpsol("solver", "ipopt", program, options)
        found = solver(
            x0=np.concatenate(self.w0), lbx=np.concatenate(self.low), ubx=np.concatenate(self.high),
            lbg=np.concatenate(self.g_low), ubg=np.concatenate(self.g_high),
        )
        return float(found["f"]), solver.stats()["return_status"]

    def variable(self, name, guess, low, high):
        variable = ca.MX.sym(name, len(guess))
        self.w.append(variable)
        for into, values in ((self.w0, guess), (self.low, low), (self.high, high)):
            into.append(np.broadcast_to(np.asarray(values, float), (len(guess),)))
        return variable

    def state(self, name, guess, first=None, rest=False):
        robot, n = self.robot, self.n
        low = [robot.lower, -robot.velocity, -robot.acceleration]
        high = [robot.upper, robot.velocity, robot.acceleration]
        if first is not None:
            low, high = [first, np.zeros(n), np.zeros(n)], [first, np.zeros(n), np.zeros(n)]
        if rest:
            low[1:], high[1:] = [np.zeros(n)] * 2, [np.zeros(n)] * 2
        whole = self.variable(name, np.concatenate(guess), np.concatenate(low), np.concatenate(high))
        return whole[:n], whole[n : 2 * n], whole[2 * n :]

    def hold(self, value, low, high):
        self.g.append(value)
        size = value.shape[0]
        self.g_low.append(np.broadcast_to(np.asarray(low, float), (size,)))
        self.g_high.append(np.broadcast_to(np.asarray(high, float), (size,)))

    def join(self, before, after, j, h):
        (q, v, a), (q1, v1, a1) = before, after
        self.hold(q + h * v + h**2 / 2 * a + h**3 / 6 * j - q1, 0.0, 0.0)
        self.hold(v + h * a + h**2 / 2 * j - v1, 0.0, 0.0)
        self.hold(a + h * j - a1, 0.0, 0.0)

    def watch(self, state, j, leg):
        """Tool limits, orientation and corridor."""
        point, error, norms = self.look(*state, j)
        self.hold(norms, 0.0, 1.0)
        self.hold(error, -TURNED, TURNED)
        start, end = self.points[leg], self.points[leg + 1]
        way = end - start
        along = way / np.linalg.norm(way)
        side = point - start - along * ca.dot(along, point - start)
        self.hold(ca.sumsqr(side) / self.tolerance**2, 0.0, 1.0)

    def pass_by(self, q, pose, is_end):
        """A pose is passed within the tolerance; the last one is reached."""
        gap = ca.sumsqr(self.place(q) - pose) / self.tolerance**2
        self.hold(gap, 0.0, 1e-6 if is_end else 1.0)


def ruled(robot, motion):
    """The share of the time in which a joint is at a limit of velocity, acceleration or jerk."""
    times, _, v, a = motion
    jerk = np.diff(a, axis=0) / np.diff(times)[:, None]
    shares = np.maximum(np.abs(v[1:]) / robot.velocity, np.abs(a[1:]) / robot.acceleration)
    return float(np.mean(np.maximum(shares, np.abs(jerk) / robot.jerk).max(axis=1) >= REACHED))


def main():
    canter, suite, *names = sys.argv[1:]
    cases = json.loads(Path(suite).read_text())["cases"]
    print("robot    list         poses  Canter s  optimum s  ratio  joints rule  Canter  casadi")
    for name in names or ["ur5e", "panda", "iiwa7"]:
        robot, ratios = Robot(canter, name), []
        q = ca.SX.sym("q", len(robot.home))
        home = ca.Function("home", [q], list(robot.forward(q)))
        middle, turn = (np.array(x) for x in home(robot.home))
        for case, data in cases.items():
            points = np.array(data["P"], float) * 1e-3
            if len(points) > MOST_POSES or data["Q"] is not None:
                continue
            points += middle.T - (points.min(axis=0) + points.max(axis=0)) / 2
            found, why = plan(canter, name, points * 1e3, turn, data["tol"])
            if found is None:
                print(f"{name:8} {case:12} {len(points):5}  refused: {why.splitlines()[0][:70]}")
                continue
            motion, duration, taken = found
            begun = time.monotonic()
            problem = Problem(robot, points, turn, data["tol"] * 1e-3)
            optimum, status = problem.solve(motion)
            spent = time.monotonic() - begun
            share = ruled(robot, motion)
            good = status in ("Solve_Succeeded", "Solved_To_Acceptable_Level")
            if good:
                ratios.append(duration / optimum)
            note = "" if good else f"  {status}"
            print(
                f"{name:8} {case:12} {len(points):5} {duration:9.4f} {optimum:10.4f} {duration / optimum:6.3f}"
                f" {share:11.0%} {taken:7.2f} {spent:7.1f}{note}", flush=True,
            )
        if ratios:
            mean = math.exp(np.mean(np.log(ratios)))
            print(f"ratio joint-optimum-{name} {mean:.4f}", flush=True)


main()
