"""How far the simulated arm of the tests is behind a motion from the pose of its start, without a clock and without a
network: one number (rad) on standard output.

    python servo.py FOLDER
"""

import logging
import os
import sys

import numpy as np
from arm_model import write

os.environ["FR3_MJCF"] = str(write(sys.argv[1]))
logging.disable(logging.WARNING)

from franka_sim.mujoco_franka_sim import MujocoFrankaSim  # noqa: E402

# Steps of 1 ms at rest and in motion, and how far each joint moves (rad).
REST, MOTION, DISTANCE = 200, 1000, 0.02


def main():
    arm = MujocoFrankaSim(enable_vis=False)
    arm.initialize_simulation()

    def measured():
        return np.array(arm.data.qpos[arm.arm_qpos_adr])

    start, worst = measured(), 0.0
    for step in range(REST + MOTION + REST):
        u = min(max((step - REST) / MOTION, 0.0), 1.0)
        share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        arm.latest_joint_positions = start + DISTANCE * share
        arm.step(1)
        worst = max(worst, np.abs(arm.latest_joint_positions - measured()).max())
    print(worst)


if __name__ == "__main__":
    main()
