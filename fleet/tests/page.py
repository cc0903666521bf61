"""The commands and the program of docs/fleet.md, as they stand there."""

import os
import re
import subprocess
import sys
from pathlib import Path

from fleet_peer import CANTER, FLEET, Processes, free_port, wait

ROOT = Path(__file__).resolve().parents[2]
# What runs until it is ended, and what it says when it does.
LASTING = {"canter-fleet router": "router listens", "canter engine": "engine of", "canter-fleet cell": "at tls/"}


def blocks(kind):
    page = (ROOT / "docs/fleet.md").read_text()
    return re.findall(rf"^```{kind}\n(.*?)^```", page, re.MULTILINE | re.DOTALL)


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
            elif name in ("cargo install", "canter-fleet top"):
                # Built already; top.py tries it in a terminal.
                continue
            else:
                ran = subprocess.run(words, capture_output=True, text=True, timeout=120)
                assert ran.returncode == 0, f"{line}: {ran.stdout} {ran.stderr}"
        assert len(tried) >= 12 and set(LASTING) < set(tried), tried
        (program,) = blocks("python")
        ran = subprocess.run([sys.executable, "-c", here(program)], capture_output=True, text=True, timeout=60)
        assert ran.returncode == 0 and "ur5e" in ran.stdout and "True" in ran.stdout, (ran.stdout, ran.stderr)
    print(f"{len(tried)} commands and a program of docs/fleet.md")


main()
