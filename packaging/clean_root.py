#!/usr/bin/env python3
"""Installs the Debian package in a fresh Debian 12 with systemd, as docs/install.md says, and removes it:

    sudo packaging/clean_root.py FOLDER [--deb FILE]

FOLDER gets the fresh system (debootstrap, 300 MB; kept for the next time) in FOLDER/fresh. Everything is
done on an overlay of it, in namespaces of its own with its own systemd, and is gone afterwards. Without
--deb the package is built first, by the lines of docs/install.md.

Every snippet of docs/install.md is run as it stands there. Shown as well: the manual pages open, the units
survive `kill -9` of each process without a motion, `systemctl stop` stops on the path, and removal leaves
nothing.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = "systemd,systemd-sysv,dbus,man-db,sudo,procps"
SLOW = """InitCanon()
SetLengthUnits("meter")
SetRelativeSpeed(5)
MoveTo({{0.45, 0.3, 0.3}, {0,0,-1}, {1,0,0}})
MoveTo({{0.45, -0.3, 0.3}, {0,0,-1}, {1,0,0}})
EndCanon(0)
"""
# The first process: mounts what a system has, and becomes its systemd.
BOOT = """
set -e
mount --make-rprivate /
mount -t overlay overlay -o lowerdir="$1/fresh",upperdir="$1/changed",workdir="$1/work" "$1/system"
cd "$1/system"
mount -t proc proc proc
mount -t sysfs -o ro sysfs sys
mount -t cgroup2 cgroup2 sys/fs/cgroup
for folder in run dev; do mount -t tmpfs -o mode=755 tmpfs $folder; done
mount -t tmpfs tmpfs tmp
for name in null zero full random urandom tty; do touch dev/$name; mount --bind /dev/$name dev/$name; done
mkdir dev/shm dev/pts
mount -t tmpfs -o mode=1777 tmpfs dev/shm
ln -s /proc/self/fd dev/fd
exec env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot . /lib/systemd/systemd --show-status=0
"""


def blocks():
    """The lines of each snippet of docs/install.md."""
    text = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    found = re.findall(r"^```sh\n(.*?)^```$", text, re.S | re.M)
    assert len(found) == 4, f"{len(found)} snippets in docs/install.md"
    return [[line.split("  #")[0].strip() for line in block.splitlines()] for block in found]


def wait(what, check, patience=60):
    end = time.monotonic() + patience
    while True:
        found = check()
        if found:
            return found
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.05)


def gone(group):
    """Removes a control group once its processes have ended."""
    try:
        group.rmdir()
    except OSError:
        return False
    return True


class System:
    """A fresh system in namespaces of its own; ended with the block."""

    def __init__(self, folder):
        self.folder = folder
        for name in ("changed", "work", "system"):
            shutil.rmtree(folder / name, ignore_errors=True)
            (folder / name).mkdir()
        mounts = Path("/proc/mounts").read_text().splitlines()
        tree = next(line.split()[1] for line in mounts if line.split()[2] == "cgroup2")
        self.group = Path(tree) / f"canter-clean-root-{os.getpid()}"
        self.group.mkdir()

    def __enter__(self):
        def join():
            (self.group / "cgroup.procs").write_text("0")

        kinds = ("--pid", "--mount", "--uts", "--ipc", "--cgroup", "--net")
        words = ["unshare", *kinds, "--fork", "--kill-child", "sh", "-c", BOOT, "boot", str(self.folder)]
        self.process = subprocess.Popen(words, preexec_fn=join)
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        self.first = wait("systemd", lambda: children.read_text().strip())
        wait("the system", lambda: self.ran("systemctl is-system-running").stdout.strip() in ("running", "degraded"))
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        for folder in [*sorted(self.group.rglob("*/"), reverse=True), self.group]:
            if folder.is_dir():
                wait("an empty group", lambda: gone(folder))

    def ran(self, line):
        enter = ["nsenter", "-t", self.first, "-m", "-p", "-u", "-i", "-n", "-C", "-r", "-w"]
        clean = ["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root", "DEBIAN_FRONTEND=noninteractive"]
        words = [*enter, *clean, "sh", "-c", f"cd /root; {line}"]
        return subprocess.run(words, capture_output=True, text=True, timeout=300)

    def run(self, line, codes=(0,)):
        """What a line prints that has to end well."""
        print(f"# {line}", flush=True)
        ran = self.ran(line)
        assert ran.returncode in codes, f"{line}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
        return ran.stdout

    def files(self):
        """Everything on its disk."""
        found = self.ran("find / -xdev -printf '%p %y %l\\n'").stdout.splitlines()
        # What dpkg, apt and the journal note for themselves, and what every program may cache.
        own = re.compile(r"/(var/(lib/(dpkg|apt|systemd)|log|cache)|root/target|root/fleet)(/| |$)")
        return {line for line in found if not own.match(line)}

    def status(self):
        ran = self.ran("sudo -u canter CANTER_DOMAIN=/run/canter canter status --json --arm cell/arm")
        return json.loads(ran.stdout) if ran.returncode == 0 else {}

    def unit(self, name, setting):
        return self.ran(f"systemctl show --property={setting} --value {name}").stdout.strip()

    def kill(self, process):
        self.run(f"kill -9 {process}")


def rests(system):
    """The arm does not move for half a second."""
    before = wait("a status", system.status)["joints"]
    time.sleep(0.5)
    after = wait("a status", system.status)["joints"]
    assert max(abs(a - b) for a, b in zip(before, after)) < 1e-3, (before, after)


def moves(system):
    """Gives a slow program and waits until the arm moves."""
    system.run("sudo -u canter CANTER_DOMAIN=/run/canter canter send --no-wait /tmp/slow.canon --arm cell/arm")
    wait("motion", lambda: system.status().get("command") == "MoveTo")
    time.sleep(1.0)
    assert system.status()["command"] == "MoveTo", "it does not move"


def build():
    for line in blocks()[0]:
        print(f"# {line}", flush=True)
        subprocess.run(line, shell=True, cwd=ROOT, check=True)
    return max((ROOT / "target/packages").glob("canter_*.deb"), key=lambda path: path.stat().st_mtime)


def installed(system):
    """The package is installed, its command works, its manual pages open."""
    install, run, man = blocks()[1]
    system.run(install)
    listed = system.run("dpkg -L canter").splitlines()
    for file in (
        "/usr/bin/canter",
        "/usr/bin/canter-fleet",
        "/usr/share/man/man1/canter.1.gz",
        "/usr/share/man/man1/canter-fleet.1.gz",
        "/usr/lib/systemd/system/canter@.service",
        "/usr/lib/systemd/system/canter-fleet@.service",
        "/usr/lib/systemd/system/canter-fleet-router.service",
    ):
        assert file in listed, file
    print(system.run("canter --version; canter-fleet --version").strip())
    system.run(run)
    assert "SYNOPSIS" in system.run(f"MANPAGER=cat {man}")
    pages = [Path(file).name.removesuffix(".1.gz") for file in listed if "/man1/" in file]
    for page in pages:
        assert "NAME" in system.ran(f"MANPAGER=cat man {page}").stdout, page
    print(f"{len(pages)} manual pages open")


def one_engine(system):
    """The unit of an arm: starts, survives kill -9 of engine and driver, stops on the path."""
    for line in blocks()[2][:-1]:
        system.run(line)
    wait("an idle arm", lambda: system.status().get("idle"))
    print(system.run(blocks()[2][-1]).strip().splitlines()[0])
    moves(system)
    engine = system.unit("canter@cell-arm", "MainPID")
    system.kill(engine)
    wait("a new engine", lambda: system.unit("canter@cell-arm", "NRestarts") == "1")
    status = wait("an idle arm", lambda: (lambda now: now if now.get("idle") else None)(system.status()))
    assert not status["fault"], status
    rests(system)
    print("engine killed in motion: started again, no fault, the arm rests")
    moves(system)
    engine = system.unit("canter@cell-arm", "MainPID")
    driver = system.run(f"pgrep -P {engine}").split()[0]
    system.kill(driver)
    fault = wait("a fault", lambda: system.status().get("fault"))
    rests(system)
    assert system.unit("canter@cell-arm", "MainPID") == engine, "the engine has ended"
    print(f"driver killed in motion: latched fault, the arm rests: {fault}")
    system.run("systemctl restart canter@cell-arm")
    wait("an arm without fault", lambda: system.status().get("idle") and not system.status()["fault"])
    moves(system)
    began = time.monotonic()
    system.run("systemctl stop canter@cell-arm")
    result = system.unit("canter@cell-arm", "Result")
    assert (system.unit("canter@cell-arm", "ActiveState"), result) == ("inactive", "success"), result
    print(f"systemctl stop in motion: ended after {time.monotonic() - began:.1f} s, result {result}")
    system.run("systemctl start canter@cell-arm")
    wait("an idle arm", lambda: system.status().get("idle"))


def fleet(system):
    """The units of a fleet survive kill -9; the arm goes on."""
    *lines, listing = blocks()[3]
    system.run("echo 127.0.0.1 router.plant >> /etc/hosts")
    for line in lines:
        system.run(line)

    def alive():
        ran = system.ran(listing)
        return ran.returncode == 0 and '"alive":true' in ran.stdout and ran.stdout

    print(wait("the arm in the fleet", alive).strip()[:100])
    for unit in ("canter-fleet@cell-arm", "canter-fleet-router"):
        moves(system)
        system.kill(system.unit(unit, "MainPID"))
        wait("a new process", lambda: system.unit(unit, "NRestarts") == "1")
        wait("the arm in the fleet", alive)
        assert system.status()["command"] == "MoveTo", "the arm depends on it"
        print(f"{unit} killed: started again, the arm is seen again, its motion went on")


def removed(system, before):
    system.run("apt-get remove -y canter")
    left = sorted(system.files() - before)
    print("left after remove:", *left, sep="\n  ")
    units = system.run("systemctl list-units --all --plain --no-legend 'canter*'", (0, 1))
    assert "running" not in units, units
    system.run("apt-get purge -y canter")
    left = sorted(line for line in system.files() - before if not line.startswith("/etc/canter"))
    gone = sorted(before - system.files())
    assert not left and not gone, (left, gone)
    assert system.ran("getent passwd canter; getent group canter").stdout == ""
    print("left after purge: nothing but /etc/canter")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--deb", type=Path)
    options = parser.parse_args()
    if os.geteuid() != 0:
        sys.exit("packaging/clean_root.py mounts and starts a system: it needs root")
    deb = (options.deb or build()).resolve()
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "fresh/usr/bin/man").exists():
        shutil.rmtree(folder / "fresh", ignore_errors=True)
        words = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", "bookworm", folder / "fresh"]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    with System(folder) as system:
        inside = Path(f"/proc/{system.first}/root")
        (inside / "root/target/packages").mkdir(parents=True)
        shutil.copy(deb, inside / "root/target/packages")
        (inside / "tmp/slow.canon").write_text(SLOW)
        system.run('echo "127.0.0.1 $(hostname)" >> /etc/hosts')
        before = system.files()
        installed(system)
        one_engine(system)
        fleet(system)
        removed(system, before)
    print("docs/install.md holds in a clean root")


if __name__ == "__main__":
    main()
