"""Compare smooth motions through dense lists with a smoothing spline and toppra (PyPI).

    pip install toppra scipy numpy
    python3 benches/peers/dense_peer.py CANTER

CANTER is the program `canter`. The six lists are those of the bench `motion` (dense), by their
formulas. For each of them, in the same run:

- `canter bench motion` plans a motion within the tolerance, speed, acceleration and jerk;
- scipy fits the smoothest cubic spline that passes all poses within the tolerance (splprep, its
  smoothing factor found by bisection), and toppra times it within the same speed and acceleration.
  toppra knows no limit of jerk. Norms are limits of speed by a fourth joint, the length of the way,
  and of acceleration by 64 directions that lie inside the sphere.

Prints durations, planning times and the largest jerk over the limit, then ratios.
"""

import json
import math
import subprocess
import sys
import tempfile
import time

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from scipy.interpolate import CubicSpline, splev, splprep

SPEED, ACCELERATION, JERK = 500.0, 5000.0, 1e5  # mm, s
DIRECTIONS = 64
GRID = 1500


def along(count, curve):
    return np.array([curve(2.0 * math.pi * i / count) for i in range(count + 1)])


def lists():
    """Name, poses (mm) and tolerance (mm) of each list."""
    sin, cos = math.sin, math.cos
    radius = lambda a: 70.0 + 25.0 * cos(3.0 * a)
    return [
        ("circle360", along(360, lambda a: [60 * cos(a), 60 * sin(a), 0]), 0.1),
        ("helix1500", along(1500, lambda a: [40 * cos(3 * a), 40 * sin(3 * a), 7.5 * a]), 0.05),
        (
            "clover2400",
            along(2400, lambda a: [radius(a) * cos(a), radius(a) * sin(a), 6 * sin(2 * a)]),
            0.05,
        ),
        ("eight900", along(900, lambda a: [120 * sin(a), 60 * sin(2 * a), 0]), 0.1),
        (
            "wave3000",
            along(3000, lambda a: [100 * a, 15 * sin(4 * a), 5 * sin(2 * a)]),
            0.05,
        ),
        (
            "pocket2000",
            along(2000, lambda a: [24 * a - 12 * sin(4 * a), 12 * cos(4 * a), 0]),
            0.05,
        ),
    ]


def by_canter(program):
    cases = {
        name: {"P": poses.tolist(), "Q": None, "tol": tol, "V": SPEED, "A": ACCELERATION, "J": JERK}
        for name, poses, tol in lists()
    }
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump({"cases": cases}, file)
        file.flush()
        done = subprocess.run(
            [program, "bench", "motion", "--json", file.name], stdout=subprocess.PIPE, check=True
        )
    rows = json.loads(done.stdout)["cases"]
    return {row["name"]: (row["motion_s"], row["planning_s"], row["jerk_ratio"]) for row in rows}


def fitted(poses, tolerance):
    """The smoothest cubic spline within the tolerance of all poses, over its length."""
    steps = np.linalg.norm(np.diff(poses, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    weights = np.ones(len(poses))
    weights[[0, -1]] = 1e4
    low, high, best = 0.0, len(poses) * tolerance**2, None
    for _ in range(12):
        middle = 0.5 * (low + high)
        spline, _ = splprep(poses.T, u=length, w=weights, k=3, s=middle)
        off = np.linalg.norm(np.array(splev(length, spline)).T - poses, axis=1).max()
        if off <= tolerance:
            low, best = middle, spline
        else:
            high = middle
    if best is None:
        best, _ = splprep(poses.T, u=length, k=3, s=0.0)
    return best, length[-1]


def directions():
    """Unit vectors spread over the sphere."""
    k = np.arange(DIRECTIONS) + 0.5
    height, angle = 1.0 - 2.0 * k / DIRECTIONS, math.pi * (1.0 + math.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)


def inner(rows):
    """Bound on all rows that keeps the vector inside the unit sphere."""
    probe = np.random.default_rng(1).normal(size=(20000, 3))
    probe /= np.linalg.norm(probe, axis=1)[:, None]
    return (probe @ rows.T).max(axis=1).min()


def by_toppra(poses, tolerance):
    clock = time.perf_counter()
    spline, end = fitted(poses, tolerance)
    places = np.linspace(0.0, end, 4 * GRID + 1)
    points = np.concatenate([np.array(splev(places, spline)), places[None, :]]).T
    path = toppra.SplineInterpolator(places, points)
    rows = np.concatenate([directions(), np.zeros((DIRECTIONS, 1))], axis=1)
    bound = np.full(DIRECTIONS, ACCELERATION * inner(directions()))
    free = 1e6
    limits = [
        toppra.constraint.JointVelocityConstraint(
            np.array([[-free, free]] * 3 + [[-SPEED, SPEED]])
        ),
        toppra.constraint.SecondOrderConstraint(
            lambda q, dq, ddq: ddq,
            lambda q: rows,
            lambda q: bound,
            4,
            discretization_scheme=toppra.constraint.DiscretizationType.Interpolation,
        ),
    ]
    grid = np.linspace(0.0, end, GRID + 1)
    algorithm = toppra.algorithm.TOPPRA(limits, path, gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = algorithm.compute_parameterization(0.0, 0.0)
    planning = time.perf_counter() - clock
    steps = 2.0 * np.diff(grid) / (speed[1:] + speed[:-1])
    return steps.sum(), planning, jerk(grid, steps, spline)


def jerk(grid, steps, spline):
    """The largest jerk of the motion over the limit, by differences of accelerations at 1 ms."""
    law = CubicSpline(np.concatenate([[0.0], np.cumsum(steps)]), grid)
    times = np.arange(0.0, steps.sum(), 1e-3)
    places = np.array(splev(np.clip(law(times), 0.0, grid[-1]), spline)).T
    third = np.diff(places, n=3, axis=0) / 1e-9
    return np.linalg.norm(third, axis=1).max() / JERK


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    toppra.setup_logging("ERROR")
    ours = by_canter(sys.argv[1])
    print("list        canter s  plan ms  jerk   toppra s  plan ms  jerk")
    lines = []
    for name, poses, tolerance in lists():
        motion, planning, most = ours[name]
        other, time_taken, their_most = by_toppra(poses, tolerance)
        print(
            f"{name:11} {motion:8.4f} {planning * 1e3:8.2f} {most:5.2f} "
            f"{other:10.4f} {time_taken * 1e3:8.1f} {their_most:5.1f}"
        )
        lines.append(f"ratio motion-dense-{name}-to-toppra {motion / other:.4f}")
        lines.append(f"ratio planning-dense-{name}-to-toppra {planning / time_taken:.4f}")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
