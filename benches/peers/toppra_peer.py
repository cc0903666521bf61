"""Time toppra (PyPI) on paths like those of the bench `timing`.

    pip install toppra numpy
    python3 benches/peers/toppra_peer.py [PATHS]

Seven joints, eleven waypoints even in -1 to 1 rad, natural cubic spline, 2 rad/s and 10 rad/s2
(toppra knows no jerk limit). The waypoints come from the same generator and seed as those of the
bench, so the paths are the same. Prints the least solving time of five runs and the duration, as
means over the paths, for grids of 101, 201 and 501 points.
"""

import sys
import time

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

JOINTS, WAYPOINTS, SEED = 7, 11, 40
MASK = (1 << 64) - 1


def numbers(state):
    """SplitMix64, as numbers even in -1 to 1."""
    while True:
        state = (state + 0x9E3779B97F4A7C15) & MASK
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        z ^= z >> 31
        yield (z >> 11) / float(1 << 52) - 1.0


def paths(count):
    source = numbers(SEED)
    for _ in range(count):
        values = [next(source) for _ in range(JOINTS * WAYPOINTS)]
        points = np.array(values).reshape(WAYPOINTS, JOINTS)
        yield toppra.SplineInterpolator(np.arange(WAYPOINTS), points, bc_type="natural")


def solve(path, grid):
    limits = [
        toppra.constraint.JointVelocityConstraint(np.tile([-2.0, 2.0], (JOINTS, 1))),
        toppra.constraint.JointAccelerationConstraint(np.tile([-10.0, 10.0], (JOINTS, 1))),
    ]
    points = np.linspace(0.0, WAYPOINTS - 1.0, grid)
    algorithm = toppra.algorithm.TOPPRA(limits, path, gridpoints=points, solver_wrapper="seidel")
    best = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        _, speed, _ = algorithm.compute_parameterization(0.0, 0.0)
        best = min(best, time.perf_counter() - start)
    duration = np.sum(2.0 * np.diff(points) / (speed[1:] + speed[:-1]))
    return best, duration


def main():
    toppra.setup_logging("ERROR")
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    print("  grid    toppra us  toppra s")
    for grid in (101, 201, 501):
        rows = [solve(path, grid) for path in paths(count)]
        best, duration = np.mean(rows, axis=0)
        print(f"{grid:6d} {best * 1e6:12.2f} {duration:9.4f}")


if __name__ == "__main__":
    main()
