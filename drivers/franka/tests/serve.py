"""The controller of the tests: franka-sim 1.1.7 with its rules enforced, on 127.0.0.1 only.

    python serve.py PORT FOLDER [GRIPPER_OBJECT_WIDTH]

Makes the model for MuJoCo from the URDF inside the package, so nothing is downloaded; prints
`ready` when the server listens, and a line of its record (record.py) for each line of standard input. The command of the
package itself would bind to all networks.
"""

import ctypes
import gc
import os
import re
import sys
import threading
from pathlib import Path

import mujoco

PORT, FOLDER = int(sys.argv[1]), Path(sys.argv[2])
WIDTH = float(sys.argv[3]) if len(sys.argv) > 3 else None

import franka_sim  # noqa: E402
from record import Record  # noqa: E402

# Damping (N m s/rad) and inertia of the motors (kg m2): what the URDF does not have.
DAMPING, ARMATURE = 1.0, 0.1


def model(folder):
    """The arm without meshes, as a file for MuJoCo."""
    text = (Path(franka_sim.__file__).parent / "models" / "fr3.urdf").read_text()
    for element in ("visual", "collision"):
        text = re.sub(rf"<{element}\b.*?</{element}>", "", text, flags=re.S)
    option = '<mujoco><compiler fusestatic="false" balanceinertia="true" discardvisual="false"/></mujoco>'
    text = re.sub(r"(<robot\b[^>]*>)", r"\1" + option, text, count=1)
    spec = mujoco.MjSpec.from_string(text)
    for joint in spec.joints:
        joint.damping, joint.armature = DAMPING, ARMATURE
    spec.compile()
    file = folder / "fr3.xml"
    file.write_text(spec.to_xml())
    return file


def keep_time():
    """Keeps the interpreter from holding up the cycle: memory stays in RAM where that is allowed, threads
    take turns in less than a cycle, and nothing is collected."""
    ctypes.CDLL(None).mlockall(3)
    sys.setswitchinterval(1e-4)
    gc.collect()
    gc.freeze()
    gc.disable()


def main():
    os.environ["FR3_MJCF"] = str(model(FOLDER))
    server = franka_sim.FrankaSimServer(
        host="127.0.0.1",
        port=PORT,
        enable_vis=False,
        enable_gripper=WIDTH is not None,
        gripper_object_width=WIDTH,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
    )

    record = Record(FOLDER)
    keep_time()

    def ready():
        while not getattr(server, "running", False):
            if stop.wait(0.05):
                return
        print("ready", flush=True)
        record.answer()

    stop = threading.Event()
    threading.Thread(target=ready, daemon=True).start()
    try:
        server.start()
    except KeyboardInterrupt:
        pass
    finally:
        stop.set()
        server.stop()


if __name__ == "__main__":
    main()
