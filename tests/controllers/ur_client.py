"""Reads the states of a controller with ur_rtde, which others wrote.

    python ur_client.py ADDRESS

Prints how many states came for each second of the controller's time, and how far a joint moved (rad).
"""

import sys
import time

from rtde_receive import RTDEReceiveInterface


def main():
    client = RTDEReceiveInterface(sys.argv[1])
    times, joints = set(), []
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        times.add(client.getTimestamp())
        joints.append(client.getActualQ())
        time.sleep(0.0002)
    assert client.getRobotMode() == 7 and client.getSafetyMode() == 1
    client.disconnect()
    moved = max(max(column) - min(column) for column in zip(*joints))
    print((len(times) - 1) / (max(times) - min(times)), moved)


if __name__ == "__main__":
    main()
