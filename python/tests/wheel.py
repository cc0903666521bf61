"""Installs a wheel in a new virtual environment, without Rust on the search path, plans and plots in five
lines and drives the simulated arm in ten, and says how long it took:

    python3 python/tests/wheel.py dist/canter-*.whl

Without a wheel it runs the commands of docs/python.md as they stand there, the last one first, since it
makes the wheel; this compiles for minutes. Then it does the same with that wheel.
"""

import glob
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

FIVE = """\
import canter, matplotlib.pyplot as plt
plan = canter.plan("pick_and_place.canon", "ur5e")
plt.plot(plan.t, plan.q)
plt.savefig("plan.svg")
print(f"{plan.duration:.3f} s planned, largest speed {abs(plan.dq).max():.3f} rad/s")
"""

TEN = """\
import canter
with canter.simulate("ur5e") as arm:
    home = arm.robot.home
    there = canter.joints_to(home + [0.3, 0.1, -0.1, 0, 0, 0])
    job = arm.submit(canter.program([there, canter.joints_to(home)], speed=0.4))
    while abs(arm.setpoint["dq"]).max() == 0: pass
    print("moves", flush=True)
    job.wait()
    print("done at", arm.q.round(3))
    assert abs(arm.q - home).max() < 1e-2
"""


def main(wheel):
    with tempfile.TemporaryDirectory() as folder:
        bare = {"PATH": "/usr/bin:/bin", "HOME": folder, "MPLBACKEND": "Agg", "CANTER_DOMAIN": folder + "/domain"}
        python = Path(folder) / "venv/bin/python"
        subprocess.run([sys.executable, "-m", "venv", folder + "/venv"], check=True)
        for tool in ("cargo", "rustc"):
            found = subprocess.run(["sh", "-c", f"command -v {tool}"], env=bare, stdout=subprocess.DEVNULL)
            assert found.returncode != 0, f"{tool} is on the search path"
        begin = time.monotonic()
        subprocess.run([python, "-m", "pip", "install", "-q", wheel], env=bare, check=True)
        installed = time.monotonic()
        moving = subprocess.Popen([python, "-c", TEN], env=bare, cwd=folder, stdout=subprocess.PIPE, text=True)
        assert moving.stdout.readline() == "moves\n"
        moved = time.monotonic()
        print(moving.stdout.read().strip())
        assert moving.wait() == 0
        print(f"pip install {installed - begin:.1f} s, first motion {moved - begin:.1f} s after its start")
        command = Path(folder) / "venv/bin/canter"
        print(subprocess.run([command, "--version"], env=bare, check=True, capture_output=True, text=True).stdout.strip())
        subprocess.run([python, "-m", "pip", "install", "-q", "matplotlib"], env=bare, check=True)
        os.symlink(ROOT / "examples/pick_and_place.canon", folder + "/pick_and_place.canon")
        subprocess.run([python, "-c", FIVE], env=bare, cwd=folder, check=True)
        assert (Path(folder) / "plan.svg").stat().st_size > 10_000
        kit = "from canter.driver import Robot; import sys; assert 'numpy' not in sys.modules"
        subprocess.run([python, "-c", kit], env=bare, cwd=folder, check=True)


def page():
    """Runs the commands of docs/python.md in a new virtual environment; the wheel that they make."""
    text = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```sh\n(.*?)^```$", text, re.S | re.M)
    lines = [line.split("  #")[0].strip() for line in block.splitlines()]
    assert lines[-1].startswith("pip wheel") and len(lines) == 3, lines
    folder = tempfile.mkdtemp()
    subprocess.run([sys.executable, "-m", "venv", folder + "/venv"], check=True)
    os.symlink(ROOT / "python", folder + "/python")
    variables = os.environ | {"PATH": f"{folder}/venv/bin:{os.environ['PATH']}"}
    for line in reversed(lines):
        print(f"$ {line}", flush=True)
        subprocess.run(line, shell=True, cwd=folder, env=variables, check=True)
    return glob.glob(folder + "/canter-*.whl")[0]


if __name__ == "__main__":
    main(str(Path(sys.argv[1]).resolve()) if sys.argv[1:] else page())
