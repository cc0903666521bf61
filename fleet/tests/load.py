"""Load of a fleet: many simulated cells, each with engine, driver and canter-fleet of its own.

python3 load.py FOLDER CELLS SECONDS [WORDS OF canter engine...], for example --lock-step or --rate 100.
Prints messages and bytes per second, the age of reports when they come, the time of a question and its
answer (both from the clock of this machine), memory, processor time, and the period of one more engine
at 1 kHz without and with a member of the fleet beside it.
"""

import json
import os
import sys
import threading
import time
from pathlib import Path

from fleet_peer import Peer, Processes, fleet, free_port, wait

TICK = os.sysconf("SC_CLK_TCK")


def seconds_of(process):
    """Processor time of a process (s)."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def memory(process):
    """Its share of the memory (MB)."""
    lines = Path(f"/proc/{process.pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024


def percentiles(values, unit=1e3):
    values = sorted(values)
    if not values:
        return "none"
    at = lambda share: values[min(len(values) - 1, int(share * len(values)))] * unit
    return f"p50 {at(0.5):.1f} ms, p99 {at(0.99):.1f} ms, max {at(1.0):.1f} ms ({len(values)})"


class Counter:
    """Counts what comes, and how old it is."""

    def __init__(self):
        self.lock = threading.Lock()
        self.clear()

    def clear(self):
        with self.lock:
            self.count = self.bytes = 0
            self.ages, self.arms = [], set()

    def __call__(self, sample):
        now = time.time_ns()
        text = sample.payload.to_bytes()
        begin = text.index(b'"clock_ns":') + 11
        sent = int(text[begin : text.index(b",", begin)])
        with self.lock:
            self.count += 1
            self.bytes += len(text)
            self.ages.append((now - sent) / 1e9)
            self.arms.add(str(sample.key_expr))


def period(processes, keys, port, member):
    """The timing of an engine at 1 kHz, without and with a member of the fleet beside it."""
    arm = "single/arm"
    engine = processes.engine(arm, "--rate", "1000")
    cell = processes.cell(keys, [arm], port) if member else None
    time.sleep(15)
    status = processes.canter_status(arm)
    for process in [cell, engine]:
        if process:
            process.terminate()
            process.wait()
            processes.all.remove(process)
    return {"timing": status["timing"], "cycles": status["cycles"]}


def main():
    folder, count, seconds, words = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
    keys = folder / "keys"
    cells = [f"hall-{number:03}" for number in range(count)] + ["single"]
    made = fleet("keys", keys, "--viewer", "eva", *[word for cell in cells for word in ("--cell", cell)])
    assert made.returncode == 0, made.stderr
    with Processes(folder) as processes:
        port = free_port()
        router = processes.router(keys, port)
        for member in (False, True):
            print("1 kHz,", "with" if member else "without", json.dumps(period(processes, keys, port, member)))
        engines, members = [], []
        for cell in cells[:-1]:
            # Each cell as on a machine of its own.
            domain = folder / cell
            domain.mkdir(mode=0o700)
            engines.append(processes.engine(f"{cell}/arm", *words, domain=domain))
            members.append(processes.cell(keys, [f"{cell}/arm"], port, domain=domain))
        counter = Counter()
        with Peer(keys / "viewer.eva", port) as peer:
            wait("all cells", lambda: len(peer.sees("canter/*/*/alive")) == count, 300)
            peer.session.declare_subscriber("canter/*/*/status", counter)
            time.sleep(3)
            counter.clear()
            all_of_them = {"router": [router], "canter-fleet cell": members, "engine": engines}
            before = {name: sum(map(seconds_of, some)) for name, some in all_of_them.items()}
            began = time.monotonic()
            answers, silent = [], 0
            while time.monotonic() - began < seconds:
                arm = f"{cells[len(answers) % count]}/arm"
                asked = time.monotonic()
                answer = peer.ask(arm, "status", patience=5.0)
                answers.append(time.monotonic() - asked)
                if answer is None:
                    silent += 1
                    print(f"no answer from {arm} after {answers[-1]:.3f} s, {asked - began:.3f} s after the start")
                time.sleep(0.01)
            lasted = time.monotonic() - began
            with counter.lock:
                print(f"{count} cells ({len(counter.arms)} heard), {lasted:.0f} s: {counter.count / lasted:.0f} reports/s, "
                      f"{counter.bytes / lasted / 1e6:.2f} MB/s")
                print("age of a report:", percentiles(counter.ages))
            print("question and answer:", percentiles(answers), f"{silent} without an answer")
            for name, some in all_of_them.items():
                used = sum(map(seconds_of, some)) - before[name]
                print(f"{name}: {sum(map(memory, some)):.0f} MB in {len(some)}, {used / lasted:.2f} processors")


main()
