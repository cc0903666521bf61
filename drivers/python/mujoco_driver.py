"""A driver that is a physics simulation: builds its model from the robot's URDF.

    python mujoco_driver.py cell/arm robots/ur5e/robot.urdf --home 0 -1.57 1.57 -1.57 -1.57 0
"""

import argparse
import re

import mujoco
import numpy

from canter_driver import Robot, messages, run


class Physics(Robot):
    """An arm in MuJoCo with computed-torque control."""

    name = "mujoco"

    def __init__(self, urdf, home, frequency=150.0, viewer=False):
        with open(urdf, encoding="utf-8") as file:
            text = file.read()
        self.model = model_of(text)
        self.data = mujoco.MjData(self.model)
        n = self.joints = self.model.nv
        if len(home) not in (0, n):
            raise SystemExit(f"--home has {len(home)} values for {n} joints")
        if home:
            self.data.qpos[:] = home
        mujoco.mj_forward(self.model, self.data)
        self.lower, self.upper = (self.model.jnt_range[:, end].tolist() for end in (0, 1))
        limits = [float(v) for v in re.findall(r'<limit[^>]*\bvelocity="([^"]+)"', text)]
        self.velocity = (limits + [3.14] * n)[:n]
        self.acceleration, self.jerk = [10.0] * n, [100.0] * n
        self.frequency = frequency
        self.gripper = messages.TOOL_OPEN
        self.viewer = None
        if viewer:
            from mujoco import viewer as window

            self.viewer = window.launch_passive(self.model, self.data)

    def measure(self):
        return self.data.qpos.tolist(), self.data.qvel.tolist()

    def move(self, position, velocity, acceleration, period):
        model, data, w = self.model, self.data, self.frequency
        w = min(w, 0.4 / period)
        model.opt.timestep = period
        data.qacc[:] = (
            numpy.asarray(acceleration)
            + 2 * w * (numpy.asarray(velocity) - data.qvel)
            + w * w * (numpy.asarray(position) - data.qpos)
        )
        mujoco.mj_inverse(model, data)
        data.qfrc_applied[:] = data.qfrc_inverse
        mujoco.mj_step(model, data)
        if self.viewer is not None:
            self.viewer.sync()

    def tool(self, tool, action):
        self.gripper = (
            messages.TOOL_OPEN if action == messages.OPEN else messages.TOOL_CLOSED
        )

    def tool_status(self, tool):
        return self.gripper if tool == 0 else messages.TOOL_UNKNOWN


def model_of(text):
    """The model of a URDF's text; links without inertia get a small one."""
    spec = mujoco.MjSpec.from_string(text)
    for body in spec.bodies[1:]:
        if body.mass <= 0:
            body.mass, body.inertia = 1.0, [0.01, 0.01, 0.01]
            body.explicitinertial = True
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
        geom.mass = 0
    return spec.compile()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arm")
    parser.add_argument("urdf")
    parser.add_argument("--home", nargs="*", type=float, default=[])
    parser.add_argument("--viewer", action="store_true")
    words = parser.parse_args()
    try:
        run(words.arm, Physics(words.urdf, words.home, viewer=words.viewer))
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
