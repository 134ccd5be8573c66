#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How many robots at how many times real time this machine sustains: one server and N robots of the fleet mission
(trajectories, closures from the reference), each a program of its own; then a restart of the server after kill -9
on the largest map; then real scans with several numbers of workers. Prints tables for docs/results/robustness.md.
"""
import argparse
import bisect
import json
import os
import pathlib
import signal
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
UPDATE_PERIOD_S = 20.0  # of the fleet mission
NAMES = ["alpha", "bravo", "charlie", "delta", "echo", "foxtrot", "golf", "hotel"]  # of simulated robots; then by number
COLUMNS = ("robots", "wall s", "of real time", "submaps", "submaps/s", "kB/s", "jobs open, most", "backlog, most",
           "updates late, most s", "server CPU s", "robots CPU s", "server MB", "robot MB", "stored to corrected: median s",
           "p99 s")


def row(*cells):
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


def head(*cells):
    row(*cells)
    print("|" + "---|" * len(cells))


def status(folder):
    """The newest status of a program, and when it was written by the wall clock."""
    file = folder / "status.json"
    try:
        return json.loads(file.read_text()), file.stat().st_mtime
    except (OSError, ValueError):
        return {}, 0.0


def used(process):
    """CPU seconds and megabytes so far."""
    try:
        words = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(") ")[2].split()
    except OSError:
        return 0.0, 0.0
    return (int(words[11]) + int(words[12])) * TICK_S, int(words[21]) * os.sysconf("SC_PAGE_SIZE") / 1e6


class Mission:
    """Programs in a folder; what they reported and used while they ran."""

    def __init__(self, tutti, folder, mission, rate):
        self.tutti, self.folder, self.mission, self.rate = tutti, folder, mission, rate
        self.processes, self.used, self.clocks = {}, {}, {}
        self.jobs = self.backlog = 0
        folder.mkdir()

    def start(self, name, *words):
        with open(self.folder / f"{name}.out", "w") as log:
            self.processes[name] = subprocess.Popen([self.tutti, *map(str, words), *map(str, self.mission)], stdout=log,
                                                    stderr=log)

    def start_server(self, *more):
        """Seconds until it takes messages."""
        begin = time.monotonic()
        self.start("server", "server", "--state", self.folder / "server", "--rate", self.rate, *more)
        while "--bus " not in (text := (self.folder / "server.out").read_text()):
            if self.processes["server"].poll() is not None:
                sys.exit(text)
            time.sleep(0.01)
        self.bus = text.split("--bus ")[1].split()[0]
        return time.monotonic() - begin

    def start_robot(self, name):
        self.start(name, "robot", "--name", name, "--bus", self.bus, "--state", self.folder / name, "--rate", self.rate,
                   "--session", "0", "--stay")

    def look(self):
        """Whether robots, and whether the server, have something to do."""
        robots_busy = server_busy = False
        for name, process in self.processes.items():
            if process.poll() is not None:
                sys.exit(f"{name} has ended: " + (self.folder / f"{name}.out").read_text())
            self.used[name] = tuple(map(max, used(process), self.used.get(name, (0.0, 0.0))))
            said, at = status(self.folder / name)
            if said:
                self.clocks.setdefault(name, []).append(at - said["time_s"] / self.rate)
            if name == "server":
                self.jobs = max(self.jobs, said.get("pending_jobs", 0))
                server_busy = said.get("pending_jobs", 1) > 0 or said.get("has_news", True)
            elif not name.startswith("worker"):
                self.backlog = max(self.backlog, said.get("backlog", 0))
                robots_busy = robots_busy or not said.get("finished") or said["backlog"] > 0
        return robots_busy, server_busy

    def wait(self, until_done):
        """Seconds until nobody has anything to do, by what look() returns."""
        begin = time.monotonic()
        quiet = 0
        while quiet < 3:  # a status is half a second old
            time.sleep(0.5)
            quiet = quiet + 1 if until_done(*self.look()) else 0
        return time.monotonic() - begin

    def events(self, name):
        """With their times by the clock on the wall."""
        offset = statistics.median(self.clocks[name])
        out = []
        for part in ("events.1.jsonl", "events.jsonl"):
            file = self.folder / name / part
            for line in file.read_text().splitlines() if file.exists() else []:
                event = json.loads(line)
                if "event" in event:
                    out.append((offset + event["time_s"] / self.rate, event))
        return out

    def stop(self, *signals):
        for process in self.processes.values():
            process.send_signal(*signals or (signal.SIGTERM,))
        for process in self.processes.values():
            process.wait()
        self.processes = {}


def latencies(mission, names):
    """For each submap the time from when the server has stored it until its robot has taken up a map with it; lateness of each
    update."""
    stored, updates, late = [], [], [0.0]  # updates: (stored before it, revision)
    since = None  # mission time of the first news
    for at, event in mission.events("server"):
        if event["event"] == "submap_stored":
            stored.append((at, event["submap"]))
            since = event["time_s"] if since is None else since
        elif event["event"] == "map_updated":
            if since is not None:
                due = -(-since // UPDATE_PERIOD_S) * UPDATE_PERIOD_S
                late.append((event["time_s"] - due) / mission.rate)
            since = None
            updates.append((len(stored), event["revision"]))
    taken = {}  # by robot number: ([revision], [time])
    for name in names:
        for at, event in mission.events(name):
            if event["event"] == "robot_updated":
                revisions, times = taken.setdefault(event["robot"], ([], []))
                revisions.append(event["revision"])
                times.append(at)
    out = []
    for i, (at, submap) in enumerate(stored):
        with_it = bisect.bisect_right([count for count, _ in updates], i)
        revisions, times = taken.get(int(submap.split("/")[0].split(".")[0]), ([], []))
        if with_it == len(updates):
            continue
        k = bisect.bisect_left(revisions, updates[with_it][1])
        if k < len(times):
            out.append(times[k] - at)
    return sorted(out), max(late)


def load(tutti, folder, counts, rate, minutes, more):
    head(*COLUMNS)
    for count in counts:
        settings = [f"simulation.robots.0.copies={count}", f"simulation.robots.0.walk.duration_s={60.0 * minutes}", *more]
        mission = Mission(tutti, folder / f"run{count}", [SOURCE / "missions/fleet.yaml", *(
            word for setting in settings for word in ("--set", setting))], rate)
        names = [*NAMES, *(f"robot{i}" for i in range(len(NAMES), count))][:count]
        mission.start_server()
        for name in names:
            mission.start_robot(name)
        wall = mission.wait(lambda robots_busy, server_busy: not robots_busy and not server_busy)
        waits, late = latencies(mission, names)
        used_by = [mission.used[name] for name in names]
        mission.stop()
        with sqlite3.connect(f"file:{mission.folder}/server/map.tutti?immutable=1", uri=True) as store:
            submaps, size = store.execute("SELECT count(*), sum(length(bytes)) FROM submaps").fetchone()
        row(count, wall, 60.0 * minutes / wall, submaps, submaps / wall, size / wall / 1e3, mission.jobs,
            mission.backlog, late, mission.used["server"][0], sum(cpu for cpu, _ in used_by), mission.used["server"][1],
            max(megabytes for _, megabytes in used_by), statistics.median(waits), waits[int(0.99 * len(waits))])
    print(f"\nrestart after kill -9 on {submaps} submaps:", end=" ")
    for _ in range(3):
        print(f"{mission.start_server():.2f} s", end=" ", flush=True)
        mission.stop(signal.SIGKILL)
    print("\n")


def workers(tutti, folder, data, counts):
    """Pairs a second of real scans: all submaps are stored before the first worker starts."""
    head("workers", "pairs", "s", "pairs/s", "CPU s of the workers", "MB of one")
    for count in counts:
        mission = Mission(tutti, folder / f"workers{count}", [SOURCE / "missions/hku_two_sessions.yaml", "--data", data],
                          20.0)
        mission.start_server("--threads", "0")
        for name in ("alpha", "bravo"):
            mission.start_robot(name)
        mission.wait(lambda robots_busy, _: not robots_busy)
        before = sum(event.get("pairs", 0) for _, event in mission.events("server"))
        begin = time.monotonic()
        for i in range(count):
            mission.start(f"worker{i}", "worker", "--bus", mission.bus, "--threads", "1")
        while mission.look()[1]:
            time.sleep(0.2)
        wall = time.monotonic() - begin
        pairs = sum(event.get("pairs", 0) for _, event in mission.events("server")) - before
        used_by = [mission.used[f"worker{i}"] for i in range(count)]
        mission.stop()
        row(count, pairs, wall, pairs / wall, sum(cpu for cpu, _ in used_by), max(mb for _, mb in used_by))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tutti")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the recordings; without it no workers")
    parser.add_argument("--robots", default="2,4,8,16")
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--workers", default="1,2,4")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting of the mission")
    options = parser.parse_args()
    numbers = lambda text: [int(word) for word in text.split(",")]
    with tempfile.TemporaryDirectory() as folder:
        load(options.tutti, pathlib.Path(folder), numbers(options.robots), options.rate, options.minutes, options.set)
        if options.data:
            workers(options.tutti, pathlib.Path(folder), options.data, numbers(options.workers))


if __name__ == "__main__":
    main()
