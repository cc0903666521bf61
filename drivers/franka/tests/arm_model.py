"""The arm of the controller of the tests, for MuJoCo: from the URDF inside franka-sim, so nothing is downloaded."""

import re
from pathlib import Path

import franka_sim
import mujoco

# What the URDF does not have: damping (N m s/rad) and inertia of the motors (kg m2). The servo of franka-sim damps with
# up to 450 N m s/rad in steps of 1 ms; below 450 * 0.001 / 2 kg m2 it swings by itself where little else is moved: between
# joints 1 and 3, whose axes are one line in the pose of the start.
DAMPING, ARMATURE = 1.0, 0.25


def write(folder, armature=ARMATURE):
    """The arm without meshes as a file; returns its path."""
    text = (Path(franka_sim.__file__).parent / "models" / "fr3.urdf").read_text()
    for element in ("visual", "collision"):
        text = re.sub(rf"<{element}\b.*?</{element}>", "", text, flags=re.S)
    option = '<mujoco><compiler fusestatic="false" balanceinertia="true" discardvisual="false"/></mujoco>'
    text = re.sub(r"(<robot\b[^>]*>)", r"\1" + option, text, count=1)
    spec = mujoco.MjSpec.from_string(text)
    for joint in spec.joints:
        joint.damping, joint.armature = DAMPING, armature
    spec.compile()
    file = Path(folder) / "fr3.xml"
    file.write_text(spec.to_xml())
    return file
