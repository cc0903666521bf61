"""A driver that is a physics simulation: builds its model from the robot's URDF.

    python mujoco_driver.py cell/arm robots/ur5e/robot.urdf --home=0,-1.57,1.57,-1.57,-1.57,0
"""

import argparse
import sys
import threading
import time
from xml.etree import ElementTree

try:
    import iceoryx2  # noqa: F401 (the kit needs it to run)
    import mujoco

    from canter_driver import Robot, messages, run
except ImportError as error:
    sys.exit(f"{error}; {sys.executable} -m pip install mujoco iceoryx2==0.9.3")

# Below this acceleration (rad/s2) the arm counts as being at a setpoint at rest.
REST = 1e-9

LISTS = {
    "home": "positions at the start (rad)",
    "velocity": "largest speeds (rad/s)",
    "acceleration": "largest accelerations (rad/s2)",
    "jerk": "largest jerks (rad/s3)",
}


class Physics(Robot):
    """An arm in MuJoCo with computed-torque control."""

    name = "mujoco"

    def __init__(self, urdf, joints=None, lists=None, viewer=False, frequency=150.0):
        with open(urdf, encoding="utf-8") as file:
            text = file.read()
        self.model = model = model_of(text)
        self.data = mujoco.MjData(model)
        self.joints = joints or [model.joint(i).name for i in range(model.njnt)]
        # Indexes of the arm's joints; other joints of the model, such as fingers, do not move.
        at = self.at = [int(model.joint(name).qposadr[0]) for name in self.joints]
        n = len(at)
        lists = {name: values for name, values in (lists or {}).items() if values}
        for name, values in lists.items():
            if len(values) != n:
                sys.exit(f"--{name} has {len(values)} values for {n} joints")
        self.data.qpos[at] = lists.get("home", [0.0] * n)
        mujoco.mj_forward(model, self.data)
        limited = [bool(model.joint(name).limited[0]) for name in self.joints]
        ranges = [
            model.joint(name).range.tolist() if ends else [-1e3, 1e3]
            for name, ends in zip(self.joints, limited)
        ]
        self.lower, self.upper = (list(ends) for ends in zip(*ranges))
        speeds = speeds_of(text)
        self.velocity = lists.get("velocity") or [speeds.get(j, 3.14) for j in self.joints]
        self.acceleration = lists.get("acceleration", [10.0] * n)
        self.jerk = lists.get("jerk", [100.0] * n)
        self.frequency, self.period = frequency, 0.0
        # Reference of all joints of the model; only those of the arm change.
        self.wanted = [self.data.qpos.tolist(), [0.0] * model.nv, [0.0] * model.nv]
        # Views of MuJoCo's own memory.
        self.qpos, self.qvel, self.qacc = self.data.qpos, self.data.qvel, self.data.qacc
        self.applied, self.inverse = self.data.qfrc_applied, self.data.qfrc_inverse
        self.gripper = messages.TOOL_OPEN
        self.viewer = None
        if viewer:
            from mujoco import viewer as window

            self.viewer = window.launch_passive(model, self.data)
            self.shown = 0.0

    def measure(self):
        at, position, velocity = self.at, self.qpos.tolist(), self.qvel.tolist()
        if len(at) == len(position):
            return position, velocity
        return [position[i] for i in at], [velocity[i] for i in at]

    def move(self, position, velocity, acceleration, at_ns, period):
        model, data = self.model, self.data
        w = min(self.frequency, 0.4 / period)
        ww, w2 = w * w, 2 * w
        wanted = self.wanted
        for i, p, v, a in zip(self.at, position, velocity, acceleration):
            wanted[0][i], wanted[1][i], wanted[2][i] = p, v, a
        wish = [
            a + w2 * (v - dq) + ww * (p - q)
            for p, v, a, q, dq in zip(*wanted, self.qpos.tolist(), self.qvel.tolist())
        ]
        if max(wish) < REST and min(wish) > -REST and not any(wanted[1]):
            # Decaying values would become denormal numbers, which are slow.
            self.qpos[:], self.qvel[:], wish = wanted[0], 0.0, [0.0] * len(wish)
        self.qacc[:] = wish
        if period != self.period:
            self.period = model.opt.timestep = period
        # Positions and velocities are those of the last step, so values derived from them are current.
        mujoco.mj_inverse(model, data)
        self.applied[:] = self.inverse
        mujoco.mj_step(model, data)
        if self.viewer is not None and data.time >= self.shown:
            self.shown = data.time + 1 / 60
            self.viewer.sync()

    def tool(self, tool, order):
        self.gripper = (
            messages.TOOL_OPEN if order.action == messages.OPEN else messages.TOOL_CLOSED
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


def speeds_of(text):
    """The speed limit of each joint of a URDF's text that has one."""
    joints = ElementTree.fromstring(text).iter("joint")
    limits = {joint.get("name"): joint.find("limit") for joint in joints}
    return {
        name: float(limit.get("velocity"))
        for name, limit in limits.items()
        if limit is not None and limit.get("velocity")
    }


def numbers(text):
    return [float(word) for word in text.split(",")]


def until_end_of_input(stop):
    """Sets `stop` when a byte comes on standard input, or a while after it ended."""
    if not sys.stdin.buffer.read(1):
        time.sleep(2)
    stop.set()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arm", help="name of the arm, as cell/arm")
    parser.add_argument("urdf", help="the robot")
    parser.add_argument("--joints", type=lambda text: text.split(","), help="names, root first")
    for name, what in LISTS.items():
        parser.add_argument(f"--{name}", type=numbers, default=[], help=f"{what}, with commas")
    parser.add_argument("--viewer", action="store_true", help="show the robot in a window")
    parser.add_argument("--until-end-of-input", action="store_true", help=argparse.SUPPRESS)
    words = parser.parse_args()
    stop = threading.Event()
    if words.until_end_of_input:
        threading.Thread(target=until_end_of_input, args=[stop], daemon=True).start()
    lists = {name: getattr(words, name) for name in LISTS}
    robot = Physics(words.urdf, words.joints, lists, words.viewer)
    run(words.arm, robot, stop.is_set, lambda: print("ready", flush=True))


if __name__ == "__main__":
    main()
