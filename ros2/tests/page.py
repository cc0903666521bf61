"""The commands of docs/ros2.md, as they stand there, and the names in the settings for MoveIt. Snippets that
the page marks are listed with their reason.

python3 page.py FOLDER
"""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CANTER = os.environ["CANTER_COMMAND"]
BRIDGE = os.environ["CANTER_ROS2_COMMAND"]
# What each command says once it runs; it is ended at the end.
SAYS = {"canter engine": "engine of", "canter serve": "serving ROS 2"}
PATIENCE = 60.0


def snippets():
    """Language, text, and why it is not run, or none."""
    page = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
    found = re.findall(r"^(?:<!-- not run by itself: ([^\n]*) -->\n)?```(\w+)\n(.*?)^```$", page, re.S | re.M)
    return [(language, text, reason) for reason, language, text in found]


def moveit(text):
    """Joints and action of the settings for MoveIt are those of the arm and of the bridge."""
    status = subprocess.run([CANTER, "status", "--json", "--arm", "cell/ur5e"], capture_output=True, text=True)
    assert status.returncode == 0, status.stderr
    joints = re.search(r"joints: \[(.*)\]", text).group(1).split(", ")
    assert joints == json.loads(status.stdout)["joint_names"], joints
    page = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
    controller = re.search(r"controller_names: \[(\w+)\]", text).group(1)
    action = re.search(r"action_ns: (\w+)", text).group(1)
    source = "".join(path.read_text() for path in (ROOT / "ros2/src").glob("*.rs"))
    assert f'default_value = "{controller}"' in source and f"{action}" in source, (controller, action)
    assert f"`/{controller}/{action}`" in page and f"\n  {controller}:\n" in text


def main():
    folder = Path(sys.argv[1])
    for name, command in (("canter", CANTER), ("canter-ros2", BRIDGE)):
        (folder / name).symlink_to(command)
    variables = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "ROS_DOMAIN_ID": str(150 + os.getpid() % 50)}
    started, tried = [], 0
    try:
        for language, text, reason in snippets():
            if reason:
                print(f"not run: {reason}:\n{text}", end="")
            if language == "yaml":
                moveit(text)
            if language != "sh" or reason:
                continue
            for line in text.splitlines():
                words = line.split("#")[0].split()
                tried += 1
                log = folder / f"{tried}.log"
                with open(log, "wb") as out:
                    started.append(subprocess.Popen(words, stdout=out, stderr=out, env=variables))
                end = time.monotonic() + PATIENCE
                while SAYS[" ".join(words[:2])] not in log.read_text(errors="replace"):
                    ended = started[-1].poll()
                    assert ended is None and time.monotonic() < end, f"{line}: {ended}: {log.read_text()}"
                    time.sleep(0.05)
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(20)
    assert tried == len(SAYS), f"{tried} commands"
    print(f"{tried} commands of docs/ros2.md")


main()
