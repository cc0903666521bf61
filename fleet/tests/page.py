"""The commands and the program of docs/fleet.md, as they stand there. Snippets that the page marks are
listed with their reason."""

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
from pathlib import Path

from fleet_peer import CANTER, FLEET, Processes, free_port, wait

ROOT = Path(__file__).resolve().parents[2]
# What runs until it is ended, and what it says when it does.
LASTING = {"canter-fleet router": "router listens", "canter engine": "engine of", "canter-fleet cell": "at tls/"}


def blocks(kind):
    page = (ROOT / "docs/fleet.md").read_text()
    found = re.findall(rf"^(<!-- not run by itself: [^\n]* -->\n)?```{kind}\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    for reason, text in found:
        if reason:
            print(f"not run: {reason}{text}", end="")
    return [text for reason, text in found if not reason]


def look(words):
    """Shows the fleet in a terminal until the arm is there, and leaves with q."""
    pid, end = pty.fork()
    if pid == 0:
        os.environ["TERM"] = "xterm"
        fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 120, 0, 0))
        os.execvp(words[0], words)
    seen = b""

    def shown():
        nonlocal seen
        while select.select([end], [], [], 0.1)[0]:
            seen += os.read(end, 65536)
        return b"hall1" in seen

    wait(" ".join(words), shown)
    os.write(end, b"q")
    ended = []

    def over():
        try:
            shown()
        except OSError:
            # Its end of the terminal is closed.
            pass
        process, status = os.waitpid(pid, os.WNOHANG)
        ended.append(status)
        return process == pid

    wait("the end of top", over)
    assert os.waitstatus_to_exitcode(ended[-1]) == 0, seen


def main():
    folder = Path(sys.argv[1])
    port = free_port()

    def here(text):
        return text.replace("router.plant:7447", f"127.0.0.1:{port}").replace("router.plant", "127.0.0.1")

    for name, command in (("canter", CANTER), ("canter-fleet", FLEET)):
        (folder / name).symlink_to(command)
    (folder / "examples").symlink_to(ROOT / "examples")
    path = {"PATH": f"{folder}:{os.environ['PATH']}"}
    os.environ.update(path)
    os.chdir(folder)
    tried = []
    with Processes(folder) as processes:
        for line in [line for block in blocks("sh") for line in block.splitlines()]:
            words = here(line.split("#")[0]).split()
            name = " ".join(words[:2])
            tried.append(name)
            if name == "canter-fleet router":
                words += ["--listen", f"tls/127.0.0.1:{port}"]
            if name == "canter engine":
                # A machine that runs tests may stall.
                words.append("--lock-step")
            if name in LASTING:
                process = processes.start(f"{len(tried)}", *words)
                said = lambda: processes.said(f"{len(tried)}")
                wait(line, lambda: LASTING[name] in said() or process.poll() is not None)
                assert process.poll() is None, f"{line}: {said()}"
            elif name == "canter-fleet top":
                look(words)
            else:
                ran = subprocess.run(words, capture_output=True, text=True, timeout=120)
                assert ran.returncode == 0, f"{line}: {ran.stdout} {ran.stderr}"
        assert len(tried) >= 11 and set(LASTING) < set(tried), tried
        (program,) = blocks("python")
        ran = subprocess.run([sys.executable, "-c", here(program)], capture_output=True, text=True, timeout=60)
        assert ran.returncode == 0 and "ur5e" in ran.stdout and "True" in ran.stdout, (ran.stdout, ran.stderr)
    print(f"{len(tried)} commands and a program of docs/fleet.md")


main()
