"""The controller of the tests: franka-sim 1.1.7 with its rules enforced, on 127.0.0.1 only.

    python serve.py PORT FOLDER [GRIPPER_OBJECT_WIDTH]

Prints `ready` when the server listens, and a line of its record (record.py) for each line of standard
input. The command of the package itself would bind to all networks.
"""

import ctypes
import gc
import os
import sys
import threading
from pathlib import Path

PORT, FOLDER = int(sys.argv[1]), Path(sys.argv[2])
WIDTH = float(sys.argv[3]) if len(sys.argv) > 3 else None

import franka_sim  # noqa: E402
from arm_model import write  # noqa: E402
from franka_sim import FrankaSimServer  # noqa: E402
from record import Record  # noqa: E402


def keep_time():
    """Keeps the interpreter from holding up the cycle: memory stays in RAM where that is allowed, threads
    take turns in less than a cycle, and nothing is collected."""
    ctypes.CDLL(None).mlockall(3)
    sys.setswitchinterval(1e-4)
    gc.collect()
    gc.freeze()
    gc.disable()


def drop_late_answers():
    """The rule of the maker: an answer after its cycle is dropped. franka-sim counts it as missing, but applies it all the
    same and takes back what it did meanwhile, after the client was told of that."""
    original = FrankaSimServer._absorb_within_motion_limits

    def absorb(server, command, *, fresh):
        return fresh and original(server, command, fresh=fresh)

    FrankaSimServer._absorb_within_motion_limits = absorb


def main():
    os.environ["FR3_MJCF"] = str(write(FOLDER))
    server = franka_sim.FrankaSimServer(
        host="127.0.0.1",
        port=PORT,
        enable_vis=False,
        enable_gripper=WIDTH is not None,
        gripper_object_width=WIDTH,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
    )

    if os.environ.get("CANTER_FRANKA_LATE") != "applied":
        drop_late_answers()
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
