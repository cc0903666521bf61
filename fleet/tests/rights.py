"""Who may what: every right with every certificate, tried with the outside client.

The table must be the one in docs/fleet.md.
"""

import json
import sys
import threading
import time
from pathlib import Path

import zenoh
from fleet_peer import Peer, Processes, fleet, free_port, settings, wait

ARM = "hall/left"
QUIET = 'InitCanon()\nMessage("taken")\nEndCanon(0)\n'

WHO = ["viewer.eva", "operator.otto", "plant.mes", "cell.hall", "cell.other"]


def asks(word, text=None):
    """Whether a question is answered."""

    def tried(peer, _):
        more = dict(text or {})
        if word in ("resume", "override"):
            more["until_ns"] = time.time_ns() + 10**10
        return peer.ask(ARM, word, more, patience=0.6) is not None

    return tried


def submits(peer, judge):
    program = judge.submission(ARM, f"right-{time.monotonic_ns()}", QUIET)
    answer = peer.ask(ARM, "submit", program, patience=0.6)
    assert answer is None or answer["accepted"], answer
    return answer is not None


def reads(kind):
    return lambda peer, _: peer.hears(f"canter/*/*/{kind}", 0.6)


def reads_notes(peer, judge):
    """Whether a note comes, while there are some."""
    heard = threading.Event()
    subscriber = peer.session.declare_subscriber(f"canter/{ARM}/note", lambda _: heard.set())
    time.sleep(0.2)
    program = judge.submission(ARM, f"note-{time.monotonic_ns()}", QUIET)
    assert judge.ask(ARM, "submit", program)["accepted"]
    try:
        return heard.wait(1.0)
    finally:
        subscriber.undeclare()


def sees(peer, _):
    return bool(peer.sees("canter/*/*/alive"))


def forges(kind):
    """Whether a viewer hears what this one puts in the name of the arm."""

    def tried(peer, judge):
        heard = threading.Event()
        mark = f"forged-{time.monotonic_ns()}"

        def listen(sample):
            if mark in sample.payload.to_string():
                heard.set()

        subscriber = judge.session.declare_subscriber(f"canter/{ARM}/{kind}", listen)
        time.sleep(0.1)
        peer.session.put(f"canter/{ARM}/{kind}", mark)
        try:
            return heard.wait(0.6)
        finally:
            subscriber.undeclare()

    return tried


def answers(peer, judge):
    """Whether a question of another reaches this one under the name of the arm."""
    asked = threading.Event()
    queryable = peer.session.declare_queryable(f"canter/{ARM}/ask/status", lambda _: asked.set())
    time.sleep(0.1)
    judge.ask(ARM, "status", patience=0.6)
    try:
        return asked.wait(0.1)
    finally:
        queryable.undeclare()


def lives(peer, judge):
    """Whether others believe this one that an arm lives."""
    token = peer.session.liveliness().declare_token("canter/hall/ghost/alive")
    time.sleep(0.1)
    try:
        return any("ghost" in name for name in judge.sees("canter/*/*/alive"))
    finally:
        token.undeclare()


WHAT = {
    "read reports": reads("status"),
    "read notes": reads_notes,
    "see who lives": sees,
    "ask status": asks("status"),
    "ask notes": asks("notes", {"since": 0}),
    "stop": asks("stop"),
    "pause": asks("pause"),
    "resume": asks("resume"),
    "override": asks("override", {"share": 1.0}),
    "submit": submits,
    "jog": asks("jog", {"space": "joint", "speeds": [0.1] * 6, "timeout_ms": 100}),
    "recover": asks("recover"),
    "report as the cell": forges("status"),
    "note as the cell": forges("note"),
    "live as the cell": lives,
    "answer as the cell": answers,
}

READ = {"read reports", "read notes", "see who lives", "ask status", "ask notes"}
MAY = {
    "viewer.eva": READ,
    "operator.otto": READ | {"stop", "pause", "resume", "override"},
    "plant.mes": READ | {"stop", "submit"},
    "cell.hall": {"report as the cell", "note as the cell", "live as the cell", "answer as the cell"},
    "cell.other": set(),
}


def table(found):
    rows = ["| | viewer | operator | plant | the cell | another cell |", "|---|---|---|---|---|---|"]
    for what in WHAT:
        marks = ["yes" if what in found[who] else "-" for who in WHO]
        rows.append(f"| {what} | {' | '.join(marks)} |")
    return "\n".join(rows)


def refused_links(folder, keys, port):
    """Who gets no link: without a certificate, and with one of another authority."""
    other = folder / "other"
    assert fleet("keys", other, "--plant", "mes").returncode == 0
    tries = {
        "no certificate": settings(keys / "plant.mes", port, certificate=False),
        "another authority's": settings(other / "plant.mes", port, authority=keys / "router/authority.pem"),
        "a router of another authority": settings(keys / "plant.mes", port, authority=other / "router/authority.pem"),
    }
    for name, config in tries.items():
        config["connect"]["timeout_ms"] = 0
        try:
            session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
        except zenoh.ZError:
            print(f"no link: {name}")
            continue
        # A TLS 1.3 client learns late that its certificate was not accepted.
        answered = list(session.get(f"canter/{ARM}/ask/status", timeout=1.0))
        linked = list(session.info.routers_zid())
        session.close()
        assert not answered and not linked, name
        print(f"no link: {name}")


def one_thread(process):
    """Zenoh reads and writes its links in one thread (decision 0146)."""
    names = [task.read_text().strip() for task in Path(f"/proc/{process.pid}/task").glob("*/comm")]
    if "canter-fleet" not in Path(f"/proc/{process.pid}/cmdline").read_text():
        return
    assert not [name for name in names if name.startswith(("rx-", "net-", "acc-", "app-"))], names
    assert "tx-0" in names, names


def main():
    folder = Path(sys.argv[1])
    keys = folder / "keys"
    made = fleet("keys", keys, "--cell", "hall", "--cell", "other", "--viewer", "eva", "--operator", "otto", "--plant", "mes")
    assert made.returncode == 0, made.stderr
    with Processes(folder) as processes:
        port = free_port()
        processes.router(keys, port)
        processes.engine(ARM)
        processes.cell(keys, [ARM], port)
        with Peer(keys / "plant.mes", port) as judge:
            wait("the arm", lambda: judge.status(ARM))
            refused_links(folder, keys, port)
            for process in processes.all:
                one_thread(process)
            found = {}
            for who in WHO:
                with Peer(keys / who, port) as peer:
                    found[who] = {what for what, tried in WHAT.items() if tried(peer, judge)}
        # What is not in the list has no right at all; and with one, the cell still refuses it.
        rules = json.loads((keys / "router/router.json5").read_text())
        rules["access_control"]["enabled"] = False
        (keys / "router/router.json5").write_text(json.dumps(rules))
        port = free_port()
        processes.router(keys, port)
        processes.cell(keys, [ARM], port)
        with Peer(keys / "viewer.eva", port) as peer:
            wait("the arm", lambda: peer.status(ARM))
            for word in ["jog", "recover", "abort", "follow", "replace", "shutdown", "setpoint", "state"]:
                answer = peer.ask(ARM, word, {"space": "joint", "speeds": [0.1] * 6, "timeout_ms": 100})
                assert not answer["accepted"] and "does not go over the network" in answer["message"], answer
            every = peer.ask_all("*/*", "submit", {"id": "x"})
            assert not every[ARM]["accepted"] and "goes to one arm" in every[ARM]["message"], every
    print(table(found))
    assert found == MAY, "\n".join(
        f"{who}: may not {MAY[who] - found[who]}, may {found[who] - MAY[who]}" for who in WHO if found[who] != MAY[who]
    )
    page = (Path(__file__).resolve().parents[2] / "docs/fleet.md").read_text()
    assert table(found) in page, "the table in docs/fleet.md is another one"


main()
