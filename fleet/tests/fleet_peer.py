"""The outside client of a fleet (eclipse-zenoh), and the processes that it talks to."""

import json
import os
import signal
import socket
import subprocess
import threading
import time
from pathlib import Path

# Read when zenoh starts its threads (decision 0146).
os.environ.setdefault(
    "ZENOH_RUNTIME", "(rx: (handover: tx), net: (handover: tx), acc: (handover: tx), app: (handover: tx))"
)

import zenoh

CANTER = os.environ["CANTER_COMMAND"]
FLEET = os.environ["CANTER_FLEET_COMMAND"]
PATIENCE = 60.0
# Where the router of a test listens, and what is started before it (a network of its own).
HOST, INSIDE = "127.0.0.1", []


def wait(what, check, patience=PATIENCE):
    """What `check` gives once it gives something."""
    end = time.monotonic() + patience
    while True:
        found = check()
        if found:
            return found
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.02)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Processes:
    """Starts processes, and ends them at the end."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.all = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in reversed(self.all):
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in self.all:
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, log, *words, domain=None):
        out = open(self.folder / f"{log}.log", "ab")
        variables = os.environ | ({"CANTER_DOMAIN": str(domain)} if domain else {})
        # canter-fleet sets it by itself.
        variables.pop("ZENOH_RUNTIME", None)
        process = subprocess.Popen(words, stdout=out, stderr=out, env=variables)
        self.all.append(process)
        return process

    def said(self, log):
        path = self.folder / f"{log}.log"
        return path.read_text(errors="replace") if path.exists() else ""

    def kill(self, process):
        process.kill()
        process.wait()
        self.all.remove(process)

    def canter_status(self, arm, domain=None):
        """The report of an engine of this machine."""
        words = [CANTER, "status", "--json", "--arm", arm, *(["--domain", str(domain)] if domain else [])]
        ran = subprocess.run(words, capture_output=True, text=True, timeout=30)
        assert ran.returncode == 0, ran.stderr
        return json.loads(ran.stdout)

    def router(self, keys, port):
        before = self.said("router").count("router listens")
        words = ["router", "--keys", f"{keys}/router", "--listen", f"tls/{HOST}:{port}"]
        process = self.start("router", *INSIDE, FLEET, *words)
        wait("the router", lambda: self.said("router").count("router listens") > before or process.poll() is not None)
        assert process.poll() is None, self.said("router")
        return process

    def engine(self, arm, *more, domain=None):
        log = "engine-" + arm.replace("/", "-")
        before = self.said(log).count("engine of")
        process = self.start(log, CANTER, "engine", "--robot", "ur5e", "--arm", arm, *more, domain=domain)
        wait("the engine", lambda: self.said(log).count("engine of") > before or process.poll() is not None)
        assert process.poll() is None, self.said(log)
        return process

    def cell(self, keys, arms, port, domain=None):
        words = [word for arm in arms for word in ("--arm", arm)]
        name = arms[0].split("/")[0]
        process = self.start(f"cell-{name}", FLEET, "cell", *words, *link(f"{keys}/cell.{name}", port), domain=domain)
        wait("the cell", lambda: f"at tls/{HOST}:{port}" in self.said(f"cell-{name}") or process.poll() is not None)
        assert process.poll() is None, self.said(f"cell-{name}")
        return process


def link(folder, port):
    return "--keys", str(folder), "--router", f"tls/{HOST}:{port}"


def fleet(*words, **more):
    """A command of canter-fleet, run to its end."""
    return subprocess.run([FLEET, *map(str, words)], capture_output=True, text=True, timeout=120, **more)


def settings(folder, port, authority=None, certificate=True):
    """What a client of a router needs, as JSON."""
    tls = {"root_ca_certificate": str(authority or f"{folder}/authority.pem"), "verify_name_on_connect": True}
    if certificate:
        tls |= {
            "enable_mtls": True,
            "connect_certificate": f"{folder}/cert.pem",
            "connect_private_key": f"{folder}/key.pem",
        }
    return {
        "mode": "client",
        "connect": {"endpoints": [f"tls/{HOST}:{port}"], "timeout_ms": 3000, "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"link": {"tx": {"lease": 4000}, "tls": tls}},
    }


class Peer:
    """A session with the rights of a certificate."""

    def __init__(self, folder, port, **more):
        config = zenoh.Config.from_json5(json.dumps(settings(folder, port, **more)))
        self.session = zenoh.open(config)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.session.close()

    def ask_all(self, arm, word, text=None, patience=3.0):
        """The answers by arm."""
        payload = json.dumps(text or {})
        replies = self.session.get(
            f"canter/{arm}/ask/{word}",
            payload=payload,
            timeout=patience,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        answers = {}
        for reply in replies:
            if reply.ok is not None:
                name = str(reply.ok.key_expr).removeprefix("canter/").split("/ask/")[0]
                answers[name] = json.loads(reply.ok.payload.to_string())
        return answers

    def ask(self, arm, word, text=None, patience=3.0):
        """The answer of an arm, or none."""
        return self.ask_all(arm, word, text, patience).get(arm)

    def status(self, arm):
        answer = self.ask(arm, "status")
        return answer and answer["body"]

    def submission(self, arm, number, program, holds=3.0):
        """A program with a number, for the engine that runs now."""
        body = wait("the status", lambda: self.status(arm))
        return {
            "id": number,
            "session": body["session"],
            "until_ns": body["clock_ns"] + int(holds * 1e9),
            "format": "text",
            "name": number,
            "program": program,
        }

    def notes(self, arm, since=0):
        """All notes after a number."""
        found = []
        while True:
            answer = wait("the notes", lambda: self.ask(arm, "notes", {"since": since}))
            page = answer["body"]["notes"]
            if not page:
                return found
            found += page
            since = page[-1]["number"]

    def hears(self, key, seconds=0.5):
        """Whether something comes under a name within this time."""
        heard = threading.Event()
        subscriber = self.session.declare_subscriber(key, lambda _: heard.set())
        try:
            return heard.wait(seconds)
        finally:
            subscriber.undeclare()

    def sees(self, key):
        """The names that live under a name."""
        return [str(r.ok.key_expr) for r in self.session.liveliness().get(key, timeout=2.0) if r.ok is not None]


class Wire:
    """A network between a cell and its router, which can be cut without a word."""

    def __init__(self, port):
        self.target = port
        self.whole = threading.Event()
        self.whole.set()
        self.ends = False
        self.server = socket.socket()
        self.server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.server.bind(("127.0.0.1", 0))
        self.server.listen()
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            near, _ = self.server.accept()
            threading.Thread(target=self.connect, args=(near,), daemon=True).start()

    def connect(self, near):
        self.whole.wait()
        try:
            far = socket.create_connection(("127.0.0.1", self.target), timeout=5)
            far.settimeout(None)
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            threading.Thread(target=self.carry, args=(one, other), daemon=True).start()

    def carry(self, one, other):
        try:
            while data := one.recv(65536):
                self.whole.wait()
                other.sendall(data)
        except OSError:
            pass
        for end in (one, other):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def cut(self):
        self.whole.clear()

    def mend(self):
        self.whole.set()
