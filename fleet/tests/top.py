"""canter-fleet top in a terminal, and the commands of a person."""

import fcntl
import json
import os
import pty
import re
import select
import struct
import sys
import termios
from pathlib import Path

from fleet_peer import FLEET, Peer, Processes, fleet, free_port, link, wait

ARMS = ["hall/left", "hall/right"]
MOVE = """InitCanon()
SetLengthUnits("meter")
SetRelativeSpeed(5)
MoveTo({{0.45, 0.2, 0.3}, {0,0,-1}, {1,0,0}})
MoveTo({{0.45, -0.2, 0.3}, {0,0,-1}, {1,0,0}})
EndCanon(0)
"""


class Terminal:
    """A command in a terminal of its own, as far as it moves the cursor and writes."""

    ROWS, COLUMNS = 30, 120

    def __init__(self, *words):
        self.pid, self.end = pty.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm"
            os.execv(FLEET, [FLEET, *map(str, words)])
        fcntl.ioctl(self.end, termios.TIOCSWINSZ, struct.pack("HHHH", self.ROWS, self.COLUMNS, 0, 0))
        self.text = ""
        self.screen = [[" "] * self.COLUMNS for _ in range(self.ROWS)]
        self.at = [0, 0]

    def look(self):
        """What is on the screen."""
        while select.select([self.end], [], [], 0.1)[0]:
            try:
                self.text += os.read(self.end, 65536).decode(errors="replace")
            except OSError:
                break
        # An order or a character; an order that has not come whole waits.
        for part in re.finditer(r"\x1b\[([?0-9;]*)([A-Za-z])|([^\x1b])", self.text):
            numbers, order, letter = part.groups()
            if order == "H":
                self.at = [int(number) - 1 for number in (numbers or "1;1").split(";")]
            elif letter:
                row, column = self.at
                if row < self.ROWS and column < self.COLUMNS:
                    self.screen[row][column] = letter
                self.at[1] += 1
        kept = re.search(r"\x1b[^A-Za-z]*$", self.text)
        self.text = kept.group() if kept else ""
        return "\n".join("".join(row).rstrip() for row in self.screen)

    def shows(self, *words):
        screen = self.look()
        return all(word in screen for word in words)

    def over(self, key):
        """Presses a key that ends it: the exit code, and what it said last."""
        os.write(self.end, key)
        last = ""
        while select.select([self.end], [], [], 5.0)[0]:
            try:
                last += os.read(self.end, 65536).decode(errors="replace")
            except OSError:
                break
        _, code = os.waitpid(self.pid, 0)
        return os.waitstatus_to_exitcode(code), last


def main():
    folder = Path(sys.argv[1])
    keys = folder / "keys"
    made = fleet("keys", keys, "--cell", "hall", "--viewer", "eva", "--operator", "otto", "--plant", "mes")
    assert made.returncode == 0, made.stderr
    program = folder / "move.canon"
    program.write_text(MOVE)
    with Processes(folder) as processes:
        port = free_port()
        viewer, operator, plant = (link(keys / who, port) for who in ("viewer.eva", "operator.otto", "plant.mes"))
        # In the wrong order: the cell waits for its router and its engines.
        none = fleet("list", "--all", *viewer)
        assert none.returncode == 4 and "no link to the router" in none.stderr, none
        cell = processes.start("cell", FLEET, "cell", *[w for a in ARMS for w in ("--arm", a)], *link(keys / "cell.hall", port))
        wait("a first failure", lambda: "trying again" in processes.said("cell"))
        processes.router(keys, port)
        wait("the cell", lambda: "at tls/" in processes.said("cell"))
        dark = fleet("list", "--all", *viewer)
        processes.engine(ARMS[0])
        second = processes.engine(ARMS[1])

        def living():
            lines = [json.loads(line) for line in fleet("list", "--all", *viewer).stdout.splitlines()]
            return lines if all(line["alive"] for line in lines) and len(lines) == 2 else None

        lines = wait("both arms", living)
        assert [line["arm"] for line in lines] == ARMS, lines
        assert "alive\":true" not in dark.stdout, dark

        terminal = Terminal("top", *viewer)
        wait("the table", lambda: terminal.shows("2 arms: 2 idle", *ARMS))
        sent = fleet("send", ARMS[0], program, "--no-wait", *plant)
        assert sent.returncode == 0 and "accepted as" in sent.stderr, sent
        wait("a moving arm", lambda: terminal.shows("MoveTo"))
        # One question stops all; what may move an arm goes to one.
        stopped = fleet("stop", "--all", *operator)
        answers = {a["arm"]: a for a in map(json.loads, stopped.stdout.splitlines())}
        assert stopped.returncode == 0 and sorted(answers) == ARMS, stopped
        assert all(a["accepted"] and a["body"]["held"] for a in answers.values()), stopped
        wait("a held arm", lambda: terminal.shows("held"))
        refused = fleet("resume", ARMS[0], *plant)
        assert refused.returncode == 4 and "no right" in refused.stderr, refused
        for arm in ARMS:
            assert fleet("resume", arm, *operator).returncode == 0
        slow = fleet("override", ARMS[0], "0.5", *operator)
        assert slow.returncode == 0, slow
        wrong = fleet("override", ARMS[0], "1.5", *operator)
        assert wrong.returncode == 1 and "0 to 1" in wrong.stderr, wrong
        assert fleet("override", ARMS[0], "1", *operator).returncode == 0
        done = fleet("send", ARMS[1], program, *plant)
        assert done.returncode == 0, done
        assert [json.loads(line)["event"] for line in done.stdout.splitlines()][-1] == "done", done
        bad = folder / "bad.canon"
        bad.write_text("InitCanon()\nFly()\n")
        wrong = fleet("send", ARMS[1], bad, *plant)
        assert wrong.returncode == 1 and "bad.canon:2:1" in wrong.stderr, wrong
        none = fleet("send", ARMS[1], folder / "none.canon", *plant)
        assert none.returncode == 3, none
        plain = fleet("send", ARMS[1], program, "--keys", keys / "plant.mes", "--router", "tcp/127.0.0.1:7447")
        assert plain.returncode == 2 and "tls/HOST:PORT" in plain.stderr, plain
        absent = fleet("stop", "hall/none", *operator)
        assert absent.returncode == 4, absent
        notes = fleet("notes", ARMS[1], "--since", "0", "--now", *viewer)
        numbers = [json.loads(line)["number"] for line in notes.stdout.splitlines()]
        assert notes.returncode == 0 and numbers == list(range(1, len(numbers) + 1)), notes
        processes.kill(second)
        wait("a dark arm", lambda: terminal.shows("dark"))
        partly = fleet("list", *ARMS, *viewer)
        assert [json.loads(line)["alive"] for line in partly.stdout.splitlines()][0], partly
        code, last = terminal.over(b"q")
        assert code == 0 and "\x1b[?1049l" in last, ("the terminal is not restored", code, last)
        closed = Terminal("top", *viewer)
        wait("the table", lambda: closed.shows("1 arms", ARMS[0]))
        os.close(closed.end)
        wait("the end without a terminal", lambda: os.waitpid(closed.pid, os.WNOHANG)[0])
        piped = fleet("top", *viewer)
        assert piped.returncode == 2 and "needs a terminal" in piped.stderr, piped
        # The cell ends; its arms go on.
        cell.terminate()
        cell.wait(20)
        with Peer(keys / "viewer.eva", port) as peer:
            wait("dark arms", lambda: not peer.sees("canter/*/*/alive"))
    modes = {path.name: path.stat().st_mode & 0o777 for path in keys.glob("*/key.pem")}
    assert set(modes.values()) == {0o600}, modes
    # Rights are taken away with the folder; what is there stays as it is.
    before = (keys / "cell.hall/cert.pem").read_text()
    for file in (keys / "operator.otto").iterdir():
        file.unlink()
    (keys / "operator.otto").rmdir()
    assert fleet("keys", keys, "--cell", "gate").returncode == 0
    rules = (keys / "router/router.json5").read_text()
    assert "cell.gate" in rules and "operator.otto" not in rules
    assert (keys / "cell.hall/cert.pem").read_text() == before
    assert fleet("keys", keys, "--cell", "a/b").returncode == 2
    print("cells, top, list, send, stop, pause, override, notes, keys: as docs/fleet.md says")


main()
