"""A driver for your own robot: fill in the four places marked HERE.

Start it, then run a program:
    python template.py cell/arm
    canter run PROGRAM --robot ur5e --driver external --arm cell/arm
"""

import sys

from canter_driver import Robot, messages, run


class MyRobot(Robot):
    """Six ideal joints that reach each setpoint at once."""

    name = "my robot"
    # HERE: the ranges (rad), and the limits of speed (rad/s), acceleration (rad/s2) and jerk (rad/s3):
    # at least those of the robot's folder.
    lower = [-6.3] * 6
    upper = [6.3] * 6
    velocity = [3.2] * 6
    acceleration = [20.0] * 6
    jerk = [400.0] * 6

    def __init__(self):
        self.position = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
        self.speed = [0.0] * 6
        self.gripper = messages.TOOL_OPEN

    def measure(self):
        # HERE: read the joint positions and velocities from the hardware.
        return self.position, self.speed

    def move(self, position, velocity, acceleration, at_ns, period):
        # HERE: send the reference to the hardware; use velocity and acceleration as feed-forward.
        # The joints shall be there at `at_ns`. `begin`, `fault` and others are in `Robot`.
        self.position, self.speed = list(position), list(velocity)

    def tool(self, tool, order):
        # HERE: begin to open or close; `tool_status` reports when it is done.
        self.gripper = (
            messages.TOOL_OPEN if order.action == messages.OPEN else messages.TOOL_CLOSED
        )

    def tool_status(self, tool):
        return self.gripper if tool == 0 else messages.TOOL_UNKNOWN


if __name__ == "__main__":
    # Ends with Ctrl-C or SIGTERM: the kit brakes the arm first.
    run(sys.argv[1] if len(sys.argv) > 1 else "cell/arm", MyRobot())
