"""Router killed, network cut, cell and engine killed: nothing moves twice, nothing that was
acknowledged is lost."""

import json
import os
import random
import sys
import time
from pathlib import Path

from fleet_peer import Peer, Processes, Wire, fleet, free_port, wait

ARM = "hall/left"
SEED = int(os.environ.get("CANTER_FLEET_SEED", "1"))
PROGRAMS = int(os.environ.get("CANTER_FLEET_PROGRAMS", "40"))


def program(mark, side):
    """Moves a little, and says so when it has."""
    y = 0.1 if side else -0.1
    return (
        'InitCanon()\nSetLengthUnits("meter")\nMoveTo({{0.45, ' + str(y) + ', 0.3}, {0,0,-1}, {1,0,0}})\n'
        f'Message("{mark}")\nEndCanon(0)\n'
    )


def marks(notes):
    return [note["note"]["text"] for note in notes if note["note"]["event"] == "message"]


def submit_until_answered(peer, number, text):
    """Sends the same until an answer comes; how often it was sent, and the answer."""
    submission = peer.submission(ARM, number, text)
    for sent in range(1, 100):
        # The time until which it holds is not part of what it is.
        body = wait("the status", lambda: peer.status(ARM))
        submission["until_ns"] = body["clock_ns"] + 3 * 10**9
        answer = peer.ask(ARM, "submit", submission, patience=1.0)
        if answer is not None:
            assert answer["accepted"], answer
            return sent, answer
    raise AssertionError("no answer came")


def killed_router(processes, keys, port):
    """The router dies again and again while programs are given: each is taken once."""
    chance = random.Random(SEED)
    router = processes.router(keys, port)
    again = repeated = 0
    with Peer(keys / "plant.mes", port) as peer:
        wait("the arm", lambda: peer.status(ARM))
        given = []
        for index in range(PROGRAMS):
            mark = f"killed-{index}"
            given.append(mark)
            text = program(mark, index % 2)
            if index % 8 == 4:
                # Sent, and the router dies at some time around it.
                submission = peer.submission(ARM, mark, text)
                replies = peer.session.get(
                    f"canter/{ARM}/ask/submit", payload=json.dumps(submission), timeout=1.0
                )
                time.sleep(chance.random() * 0.004)
                processes.kill(router)
                del replies
                router = processes.router(keys, port)
            sent, answer = submit_until_answered(peer, mark, text)
            repeated += sent > 1 or index % 8 == 4
            again += answer["body"].get("again", False)
        found = wait("the last", lambda: (lambda n: n if given[-1] in marks(n) else None)(peer.notes(ARM)))
        numbers = [note["number"] for note in found]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "a number is missing"
        counted = marks(found)
        assert counted == given[-len(counted) :], (given, counted)
        if numbers[0] == 1:
            assert counted == given
    print(f"router killed {PROGRAMS // 8} times: {PROGRAMS} programs, {repeated} sent again, {again} of them "
          f"taken before, each executed once")
    return router


def cut_network(processes, keys, port, wire):
    """Five seconds without network: the program goes on; what was asked meanwhile is not known, and
    the same number finds out."""
    with Peer(keys / "plant.mes", port) as peer, Peer(keys / "operator.otto", port) as operator:
        wait("the arm", lambda: peer.status(ARM))
        body = peer.status(ARM)
        before = body["last_note"]
        _, first = submit_until_answered(peer, "cut-0", program("cut-0", 0))
        began = time.monotonic()
        wire.cut()
        submission = {
            "id": "cut-1", "session": body["session"], "until_ns": 2**63, "format": "text",
            "name": "cut-1", "program": program("cut-1", 1),
        }
        answer = peer.ask(ARM, "submit", submission, patience=1.0)
        assert answer is None, "an answer came through a cut wire"
        wait("the dark cell", lambda: not peer.sees(f"canter/{ARM}/alive"))
        assert operator.ask(ARM, "stop", patience=0.5) is None
        stopped = fleet("stop", ARM, "--keys", keys / "operator.otto", "--router", f"tls/127.0.0.1:{port}")
        assert stopped.returncode == 4 and "What became of it is not known" in stopped.stderr, stopped
        time.sleep(max(0.0, 5.0 - (time.monotonic() - began)))
        wire.mend()
        wait("the cell", lambda: peer.sees(f"canter/{ARM}/alive"))
        _, second = submit_until_answered(peer, "cut-1", submission["program"])
        _, repeated = submit_until_answered(peer, "cut-0", program("cut-0", 0))
        assert repeated["body"]["again"] and repeated["body"]["first"] == first["body"]["first"]
        _, repeated = submit_until_answered(peer, "cut-1", submission["program"])
        assert repeated["body"]["again"] and repeated["body"]["first"] == second["body"]["first"]
        found = wait("the last", lambda: (lambda n: n if "cut-1" in marks(n) else None)(peer.notes(ARM, before)))
        assert marks(found) == ["cut-0", "cut-1"], marks(found)
    print("network cut for 5 s: dark while it was, two programs executed once each")


def late_network(keys, port, wire):
    """A network that delivers late moves nothing."""
    with Peer(keys / "plant.mes", port) as peer:
        wait("the arm", lambda: peer.status(ARM))
        submission = peer.submission(ARM, "late", program("late", 0), holds=0.3)
        wire.cut()
        assert peer.ask(ARM, "submit", submission, patience=0.3) is None
        time.sleep(0.7)
        wire.mend()
        wait("the arm", lambda: peer.status(ARM))
        assert "late" not in marks(peer.notes(ARM)), "it moved late"
        refused = peer.ask(ARM, "submit", submission)
        assert not refused["accepted"] and "too late" in refused["message"], refused
        _, taken = submit_until_answered(peer, "late", program("late", 0))
        assert "again" not in taken["body"], "it was taken late"
    print("late by 0.7 s: not executed; the same number in time: executed once")


def killed_processes(processes, keys, port, wire, engine, cell):
    """The cell's process dies: the engine knows the numbers. The engine dies: no number holds."""
    with Peer(keys / "plant.mes", port) as peer:
        body = wait("the arm", lambda: peer.status(ARM))
        _, first = submit_until_answered(peer, "last", program("last", 1))
        processes.kill(cell)
        wait("the dark cell", lambda: not peer.sees(f"canter/{ARM}/alive"))
        processes.cell(keys, [ARM], wire.port)
        wait("the cell", lambda: peer.sees(f"canter/{ARM}/alive"))
        _, again = submit_until_answered(peer, "last", program("last", 1))
        assert again["body"]["again"] and again["body"]["last"] == first["body"]["last"]
        old = peer.submission(ARM, "old", program("old", 0))
        processes.kill(engine)
        wait("the dark arm", lambda: not peer.sees(f"canter/{ARM}/alive"))
        engine = processes.engine(ARM, "--lock-step")
        wait("the arm", lambda: peer.sees(f"canter/{ARM}/alive"))
        now = wait("the status", lambda: peer.status(ARM))
        assert now["session"] != body["session"]
        old["until_ns"] = now["clock_ns"] + 10**10
        refused = peer.ask(ARM, "submit", old)
        assert not refused["accepted"] and "started again" in refused["message"], refused
        assert marks(peer.notes(ARM)) == []
    print("cell killed: the number was known; engine killed: a program for the old one is refused")


def main():
    folder = Path(sys.argv[1])
    keys = folder / "keys"
    made = fleet("keys", keys, "--cell", "hall", "--operator", "otto", "--plant", "mes")
    assert made.returncode == 0, made.stderr
    with Processes(folder) as processes:
        port = free_port()
        wire = Wire(port)
        engine = processes.engine(ARM, "--lock-step")
        router = processes.router(keys, port)
        cell = processes.cell(keys, [ARM], wire.port)
        with Peer(keys / "plant.mes", port) as peer:
            wait("the arm", lambda: peer.status(ARM))
        processes.kill(router)
        killed_router(processes, keys, port)
        cut_network(processes, keys, port, wire)
        late_network(keys, port, wire)
        killed_processes(processes, keys, port, wire, engine, cell)


main()
