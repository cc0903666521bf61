"""Load of a fleet: many simulated cells, each with engine, driver and canter-fleet of its own.

python3 load.py FOLDER CELLS SECONDS [WORDS OF canter engine...], for example 100 600 --rate 100

Prints messages and bytes per second, the age of reports when they come, the time of a question and its
answer (both from the clock of this machine), memory and processor time. Meanwhile the plant gives programs
to the cells in turn; after a third of the time the router is killed and started again, after two thirds the
network is cut for 5 s. At the end the notes of all cells are read: each program that was acknowledged was
executed once, and none twice. Before it, the timing of one engine at 1 kHz without and with a member of the
fleet beside it.

With CANTER_FLEET_STANDING=PROGRAM (the example standing_cells of fleet) only the first CANTER_FLEET_ENGINES
cells have engine and driver; the arms of the others stand still in one process, since a hundred engines are more
than the processors of a desk carry. Each cell has its canter-fleet all the same.

As root the router has a network of its own, so that its cable can be cut; otherwise the router is stopped for
5 s instead. With CANTER_FLEET_GO=FILE the measurement begins when this file is there.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fleet_peer
from fleet_peer import Peer, Processes, fleet, free_port, wait

TICK = os.sysconf("SC_CLK_TCK")
# Time between two programs of the plant (s), and how long a question may take.
BETWEEN, PATIENCE = 0.5, 5.0
CUT = 5.0
PROGRAM = """InitCanon()
SetLengthUnits("meter")
MoveTo({{{{0.45, {side}, 0.3}}, {{0,0,-1}}, {{1,0,0}}}})
Message("{mark}")
EndCanon(0)
"""


class Cable:
    """A network of its own for the router, where we may make one."""

    def __init__(self):
        self.name = f"canter{os.getpid()}" if os.geteuid() == 0 else None
        if self.name:
            near, far = f"cn{os.getpid()}", f"cf{os.getpid()}"
            self.near = near
            host = f"10.213.{os.getpid() % 250}."
            for words in (
                f"netns add {self.name}",
                f"link add {near} type veth peer name {far} netns {self.name}",
                f"addr add {host}1/24 dev {near}",
                f"link set {near} up",
                f"-n {self.name} addr add {host}2/24 dev {far}",
                f"-n {self.name} link set {far} up",
                f"-n {self.name} link set lo up",
            ):
                subprocess.run(["ip", *words.split()], check=True)
            fleet_peer.HOST = host + "2"
            fleet_peer.INSIDE = ["ip", "netns", "exec", self.name]

    def cut(self, router):
        """Nothing passes for some seconds, and nobody is told."""
        if self.name:
            subprocess.run(["ip", "link", "set", self.near, "down"], check=True)
            time.sleep(CUT)
            subprocess.run(["ip", "link", "set", self.near, "up"], check=True)
        else:
            router.send_signal(signal.SIGSTOP)
            time.sleep(CUT)
            router.send_signal(signal.SIGCONT)

    def remove(self):
        if self.name:
            subprocess.run(["ip", "netns", "del", self.name], check=True)


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
        self.count = self.bytes = 0
        # When a report came, and how old it was.
        self.ages, self.arms = [], {}

    def __call__(self, sample):
        now = time.time_ns()
        text = sample.payload.to_bytes()
        begin = text.index(b'"clock_ns":') + 11
        sent = int(text[begin : text.index(b",", begin)])
        with self.lock:
            self.count += 1
            self.bytes += len(text)
            self.ages.append((time.monotonic(), (now - sent) / 1e9))
            self.arms[str(sample.key_expr)] = time.monotonic()

    def clear(self):
        with self.lock:
            self.count = self.bytes = 0
            self.ages.clear()

    def heard_since(self, when):
        """How many arms have reported since then."""
        with self.lock:
            return sum(at > when for at in self.arms.values())


class Plant(threading.Thread):
    """Gives programs to the arms in turn. What is not answered is asked for again with the same id."""

    def __init__(self, keys, port, arms):
        super().__init__()
        self.keys, self.port, self.arms = keys, port, arms
        self.ends = threading.Event()
        self.acknowledged, self.refused, self.repeated, self.again = {}, [], 0, 0
        self.error = None

    def run(self):
        try:
            with Peer(self.keys / "plant.mes", self.port) as peer:
                number = 0
                while not self.ends.wait(BETWEEN):
                    self.give(peer, number)
                    number += 1
        except Exception as error:
            self.error = error

    def give(self, peer, number):
        arm, mark = self.arms[number % len(self.arms)], f"program-{number}"
        side = 0.1 if (number // len(self.arms)) % 2 else -0.1
        submission = None
        end = time.monotonic() + 120
        while time.monotonic() < end:
            body = peer.status(arm)
            if body is None:
                # The router may be away.
                time.sleep(0.2)
                continue
            submission = submission or {"id": mark, "session": body["session"], "format": "text", "name": mark}
            submission["program"] = PROGRAM.format(side=side, mark=mark)
            submission["until_ns"] = body["clock_ns"] + int(PATIENCE * 1e9)
            answer = peer.ask(arm, "submit", submission, patience=1.0)
            if answer is None:
                self.repeated += 1
                continue
            if answer["accepted"]:
                self.acknowledged[mark] = arm
                self.again += answer["body"].get("again", False)
            else:
                self.refused.append((mark, answer["message"]))
            return
        raise AssertionError(f"no answer from {arm}")


class Questions(threading.Thread):
    """Asks one arm after the other how it is."""

    def __init__(self, keys, port, arms):
        super().__init__()
        self.keys, self.port, self.arms = keys, port, arms
        self.ends = threading.Event()
        # When it was asked, how long the answer took, whether there was one.
        self.asked = []

    def run(self):
        with Peer(self.keys / "viewer.eva", self.port) as peer:
            while not self.ends.wait(0.01):
                began = time.monotonic()
                answer = peer.ask(self.arms[len(self.asked) % len(self.arms)], "status", patience=PATIENCE)
                self.asked.append((began, time.monotonic() - began, answer is not None))


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


def standing(processes, folder, cells, like):
    """Starts the cells whose arms stand still, with reports like those of an arm."""
    if not cells:
        return []
    program = os.environ["CANTER_FLEET_STANDING"]
    for cell in cells:
        (folder / cell).mkdir(mode=0o700)
    (folder / "status.json").write_text(json.dumps(like))
    words = [program, folder, folder / "status.json", *cells]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    processes.all.append(process)
    said = process.stdout.readline()
    assert said == f"{len(cells)} cells stand\n", said
    return [process]


def check(peer, plant):
    """Every program that was acknowledged was executed once, and none twice."""
    by_arm = {}
    for mark, arm in plant.acknowledged.items():
        by_arm.setdefault(arm, []).append(mark)
    executed = 0
    for arm, given in by_arm.items():

        def done():
            notes = peer.notes(arm)
            said = [note["note"]["text"] for note in notes if note["note"]["event"] == "message"]
            return (notes, said) if given[-1] in said else None

        notes, said = wait(f"the last program of {arm}", done)
        numbers = [note["number"] for note in notes]
        assert numbers == list(range(1, len(numbers) + 1)), f"{arm}: a note is missing"
        assert said == given, f"{arm}: given {given}, executed {said}"
        executed += len(said)
    assert not plant.refused, plant.refused
    print(f"programs: {len(plant.acknowledged)} acknowledged, {executed} executed, each once; {plant.repeated} "
          f"questions without an answer asked again, {plant.again} of them taken before")


def disturb(began, seconds, counter, count, around):
    """Kills the router and cuts the network; the times that were disturbed, up to when all are seen again."""
    cable, processes, keys, port, router = around
    disturbed = []

    def until(share):
        time.sleep(max(0.0, began + share * seconds - time.monotonic()))

    def over(what, start, back):
        wait("all cells", lambda: counter.heard_since(back) == count, 120)
        end = time.monotonic()
        disturbed.append((start, end))
        print(f"{what}: all cells heard {end - back:.1f} s after it was back", flush=True)

    until(1 / 3)
    start = time.monotonic()
    processes.kill(router)
    router = processes.router(keys, port)
    over("router killed and started again", start, time.monotonic())
    until(2 / 3)
    start = time.monotonic()
    cable.cut(router)
    over(f"network cut for {CUT:.0f} s", start, time.monotonic())
    until(1)
    return disturbed, router


def measure(processes, cable, keys, port, router, cells):
    """Everything while all cells run."""
    engines, stand, members, arms, everyone, seconds = cells
    count = len(everyone)
    counter = Counter()
    with Peer(keys / "viewer.eva", port) as peer:
        wait("all cells", lambda: len(peer.sees("canter/*/*/alive")) == count, 300)
        peer.session.declare_subscriber("canter/*/*/status", counter)
        print(f"{count} cells are there, load {os.getloadavg()[0]:.1f}", flush=True)
        go = os.environ.get("CANTER_FLEET_GO")
        while go and not Path(go).exists():
            time.sleep(0.2)
        time.sleep(3)
        counter.clear()
        kinds = {"canter-fleet cell": members, "engine": engines, "cells that stand": stand}
        before = {name: sum(map(seconds_of, some)) for name, some in kinds.items()}
        small = sum(map(memory, members))
        began = time.monotonic()
        plant, questions = Plant(keys, port, arms), Questions(keys, port, everyone)
        for thread in (plant, questions):
            thread.start()
        disturbed, router = disturb(began, seconds, counter, count, (cable, processes, keys, port, router))
        for thread in (plant, questions):
            thread.ends.set()
        for thread in (plant, questions):
            thread.join()
        lasted = time.monotonic() - began
        for name, some in kinds.items():
            used = sum(map(seconds_of, some)) - before[name]
            print(f"{name}: {sum(map(memory, some)):.0f} MB in {len(some)}, {used / lasted:.2f} processors")
        print(f"canter-fleet cell: {small:.0f} MB at the beginning; router: {memory(router):.0f} MB, "
              f"{seconds_of(router):.1f} s of processor time since it was started again")
        calm = lambda at, took=0.0: not any(start <= at + took and at <= end for start, end in disturbed)
        with counter.lock:
            print(f"{count} cells ({len(arms)} with engines, {len(counter.arms)} heard), {lasted:.0f} s: {counter.count / lasted:.0f} reports/s, "
                  f"{counter.bytes / lasted / 1e6:.2f} MB/s; load {os.getloadavg()[0]:.1f}")
            print("age of a report:", percentiles([age for at, age in counter.ages if calm(at)]))
        answered = [took for at, took, was in questions.asked if was and calm(at, took)]
        silent = [calm(at, took) for at, took, was in questions.asked if not was]
        print("question and answer:", percentiles(answered))
        print(f"without an answer: {sum(silent)}, and {len(silent) - sum(silent)} while the router or the network was away")
        assert plant.error is None, plant.error
        check(peer, plant)


def main():
    folder, count, seconds, words = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
    keys = folder / "keys"
    cells = [f"hall-{number:03}" for number in range(count)] + ["single"]
    cable = Cable()
    roles = ("--viewer", "eva", "--plant", "mes", "--host", fleet_peer.HOST)
    made = fleet("keys", keys, *roles, *[word for cell in cells for word in ("--cell", cell)])
    assert made.returncode == 0, made.stderr
    try:
        with Processes(folder) as processes, ThreadPoolExecutor(4) as pool:
            port = free_port()
            router = processes.router(keys, port)
            for member in (False, True):
                timing = json.dumps(period(processes, keys, port, member))
                print("1 kHz,", "with" if member else "without", timing, flush=True)

            def engine(cell):
                # Each cell as on a machine of its own.
                (folder / cell).mkdir(mode=0o700)
                return processes.engine(f"{cell}/arm", *words, domain=folder / cell)

            moving = cells[: int(os.environ.get("CANTER_FLEET_ENGINES", count))]
            moving = [cell for cell in moving if cell != "single"]
            engines = list(pool.map(engine, moving))
            like = processes.canter_status(f"{moving[0]}/arm", domain=folder / moving[0])
            stand = standing(processes, folder, cells[len(moving) : -1], like)
            member = lambda cell: processes.cell(keys, [f"{cell}/arm"], port, domain=folder / cell)
            members = list(pool.map(member, cells[:-1]))
            arms = [f"{cell}/arm" for cell in moving]
            everyone = [f"{cell}/arm" for cell in cells[:-1]]
            measure(processes, cable, keys, port, router, (engines, stand, members, arms, everyone, seconds))
    finally:
        cable.remove()


main()
