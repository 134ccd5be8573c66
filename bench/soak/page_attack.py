#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures what an attack on the page costs the mission: robots of the fleet mission send submaps to a server whose page is attacked and left alone in
turn. A commit is timed on the bus, from a robot's submap to the receipt that the server sends it after storing. Prints a table for
docs/results/robustness.md. Without credentials, so that the attackers are also let to ask what
only a viewer may. They are niced by 19: theirs is another machine's time.
"""
import argparse
import asyncio
import contextlib
import json
import multiprocessing
import os
import pathlib
import re
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
NAMES = ["alpha", "bravo", "charlie", "delta", "echo", "foxtrot", "golf", "hotel"]  # of simulated robots
HEAD = b"Host: 127.0.0.1\r\nX-Tutti: 1\r\n"
SETTLE_S = 3.0  # of a phase, before it counts


async def peer(port, source, begin, then, period_s, reads):
    """Says one thing, then another again and again; who is put out comes back at once."""
    while True:
        with contextlib.suppress(OSError, asyncio.TimeoutError):
            reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(f"127.0.0.{source}", 0))
            with contextlib.closing(writer):
                writer.write(begin)
                while not reader.at_eof():
                    with contextlib.suppress(asyncio.TimeoutError):
                        await asyncio.wait_for(reader.read(1 << 20 if reads else 1), period_s)
                    writer.write(then)
                    await writer.drain()
        await asyncio.sleep(0.05)


def get(path, *headers):
    return f"GET {path} HTTP/1.1\r\n".encode() + HEAD + "".join(f"{h}\r\n" for h in headers).encode() + b"\r\n"


TRICKLE = b"POST /api/login HTTP/1.1\r\n" + HEAD + b"Content-Length: 4000\r\n\r\n"
NESTED = b"POST /api/mark HTTP/1.1\r\n" + HEAD + b"Content-Length: 2097152\r\n\r\n" + b"[" * (2 << 20)
PAGE, WHY, PAST = get("/", "Accept-Encoding: gzip"), get("/api/why?from=alpha&to=bravo"), get("/api/history")
ATTACKS = {  # name: connections, addresses, what each says first and then, seconds between, whether it reads answers
    "64 bodies that trickle, of one address": (64, 1, TRICKLE, b"a", 0.25, True),
    "300 that ask every 0.3 s, of 250 addresses": (300, 250, get("/api/none"), get("/api/none"), 0.3, True),
    "10,000 silent connections of 200 addresses": (10_000, 200, b"", b"", 60.0, True),
    "64 bodies of 2 MiB of `[`, of 64 addresses": (64, 64, NESTED, b"", 1.0, True),
    "64 addresses that ask for the page without pause": (64, 64, PAGE, PAGE, 0.01, True),
    "16 viewers that ask why robots are not joined, without pause": (16, 16, WHY, WHY, 0.01, True),
    "16 viewers that ask for the past, and do not read it": (16, 16, PAST, PAST, 1.0, False),
}


def attack(port, name):
    os.nice(19)
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    count, addresses, begin, then, period_s, reads = ATTACKS[name]

    async def run():
        peers = (peer(port, 2 + i % addresses, begin, then, period_s, reads) for i in range(min(count, most - 200)))
        await asyncio.gather(*peers)

    asyncio.run(run())


class Commits(threading.Thread):
    """(when, how long) of each: listens to submaps and receipts on the bus."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.done, self.waiting = [], {}
        host, port = url.removeprefix("nats://").split(":")
        self.bus = socket.create_connection((host, int(port)))
        self.file = self.bus.makefile("rb")
        self.bus.sendall(b'CONNECT {"verbose":false,"headers":true,"lang":"python","version":"0"}\r\n'
                         b"SUB mission.*.robot.*.submap 1\r\nSUB $KV.*.robot.*.receipt 2\r\n")

    def run(self):
        for line in self.file:
            words = line.split()
            if words[:1] == [b"PING"]:
                self.bus.sendall(b"PONG\r\n")
            if words[:1] not in ([b"MSG"], [b"HMSG"]):
                continue
            self.file.read(int(words[-1]) + 2)
            at, robot = time.monotonic(), words[1].split(b".")[-2]
            if words[1].endswith(b".submap"):
                self.waiting.setdefault(robot, []).append(at)
            else:
                self.done += [(at, at - sent) for sent in self.waiting.pop(robot, [])]


def used(pid):
    """CPU seconds and megabytes so far."""
    words = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(words[11]) + int(words[12])) * TICK_S, int(words[21]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def row(name, commits, page_cpu, page_mb, server_cpu):
    took = sorted(commits) or [float("nan")]
    at = lambda share: 1000.0 * took[min(len(took) - 1, int(share * len(took)))]
    print(f"| {name} | {len(commits)} | {at(0.5):.0f} | {at(0.99):.0f} | {1000.0 * took[-1]:.0f} | {page_cpu:.2f} | {page_mb:.0f} | "
          f"{server_cpu:.2f} |", flush=True)


def until(file, pattern):
    end = time.monotonic() + 120.0
    while not (found := re.search(pattern, file.read_text())):
        if time.monotonic() > end:
            sys.exit(file.read_text())
        time.sleep(0.1)
    return found[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti")
    parser.add_argument("--rate", type=float, default=10.0)
    parser.add_argument("--seconds", type=float, default=12.0, help="of a phase")
    parser.add_argument("--page-nice", type=int, default=0, metavar="N", help="the page is niced by N")
    parser.add_argument("--only", default="", metavar="WORD,WORD", help="attacks with one of these words in their names")
    options = parser.parse_args()
    chosen = [name for name in ATTACKS if any(word in name for word in options.only.split(","))]
    phases = [name for attacked in chosen for name in ("", attacked)] + [""]
    mission_s = options.rate * options.seconds * (len(phases) + 1)
    words = [SOURCE / "missions/fleet.yaml", "--set", f"simulation.robots.0.copies={len(NAMES)}",
             "--set", f"simulation.robots.0.walk.duration_s={mission_s}"]
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as programs:
        folder = pathlib.Path(folder)

        def start(name, *more):
            with open(folder / f"{name}.out", "w") as log:
                out = subprocess.Popen([options.tutti, *map(str, more), *map(str, words), "--rate", str(options.rate),
                                        "--state", folder / name], stdout=log, stderr=log)
            programs.callback(out.wait)
            programs.callback(out.terminate)
            return out

        server = start("server", "server", "--view", "0")
        bus = until(folder / "server.out", r"--bus (nats:\S+)")
        port = int(until(folder / "server.out", r"the page is at http://[^:]+:(\d+)/"))
        page = json.loads((folder / "server/page/status.json").read_text())["pid"]
        for thread in pathlib.Path(f"/proc/{page}/task").iterdir() if options.page_nice else []:
            os.setpriority(os.PRIO_PROCESS, int(thread.name), options.page_nice)
        commits = Commits(bus)
        commits.start()
        for name in NAMES:
            start(name, "robot", "--name", name, "--bus", bus, "--session", "0")
        time.sleep(options.seconds)

        print("| | commits | median, ms | p99, ms | worst, ms | page: CPU s | page: MB | server: CPU s |\n|---|" + "---|" * 7)
        groups = {"": [], "attacked": []}
        spent = {"": [0.0, 0.0], "attacked": [0.0, 0.0]}
        for name in phases:
            attacker = multiprocessing.Process(target=attack, args=(port, name), daemon=True) if name else None
            if attacker:
                attacker.start()
            time.sleep(SETTLE_S)
            begin, page_s, server_s = time.monotonic(), used(page)[0], used(server.pid)[0]
            time.sleep(options.seconds - SETTLE_S)
            end = time.monotonic()
            took = [t for at, t in list(commits.done) if begin <= at < end]
            cost = used(page)[0] - page_s, used(server.pid)[0] - server_s
            if attacker:
                attacker.kill()
                attacker.join()
            row(name or "nobody", took, cost[0], used(page)[1], cost[1])
            key = "attacked" if name else ""
            groups[key] += took
            spent[key] = [a + b for a, b in zip(spent[key], cost)]
        for key, name in ("", "**all without**"), ("attacked", "**all with**"):
            row(name, groups[key], spent[key][0], used(page)[1], spent[key][1])


if __name__ == "__main__":
    main()
