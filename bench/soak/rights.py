#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures what TLS and rights cost a mission: `tutti mission up` without and with --pki, by turns. Prints for each the time that it took,
what the robots' connections to the bus carried (as the kernel counts it: TLS, acknowledgements of NATS and all), the CPU time of
the bus, and how long a fresh `tutti status` takes meanwhile; then whether the maps are the same to the bit. Prints a table for
docs/results/robustness.md. Needs `ss` (package iproute2).
"""
import argparse
import os
import pathlib
import re
import statistics
import subprocess
import tempfile
import time

TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
FILES = ("graph.g2o", "graph_stamps.csv", "map.ply", "*_server.tum")  # the map; corrected poses depend on when a robot hears it


def words_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return []


def children(parent):
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            number, _, rest = stat.read_text().partition(" (")
        except OSError:
            continue
        if rest.rpartition(") ")[2].split()[1] == str(parent):
            found += [int(number), *children(int(number))]
    return found


def cpu_s(pid):
    try:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) * TICK_S


def carried(pids):
    """(pid, port) -> (bytes sent, bytes received) of these processes' TCP connections."""
    said = subprocess.run(["ss", "-tinpH"], capture_output=True, text=True, check=True).stdout
    out = {}
    for block in re.split(r"\n(?=\S)", said):
        owner, sent, got = (re.search(p, block) for p in (r"pid=(\d+)", r"bytes_sent:(\d+)", r"bytes_received:(\d+)"))
        if owner and int(owner[1]) in pids:
            port = block.split()[3].rpartition(":")[2]
            out[int(owner[1]), port] = (int(sent[1]) if sent else 0, int(got[1]) if got else 0)
    return out


def run(options, out, more):
    began = time.monotonic()
    mission = subprocess.Popen([options.tutti, "mission", "up", options.mission, *(["--data", options.data] if options.data else []), "--rate",
                                str(options.rate), "--workers", "1", "--out", out, *more], stdout=subprocess.DEVNULL)
    traffic, bus_cpu, answers, url = {}, 0.0, [], None
    while mission.poll() is None:
        time.sleep(0.5)
        all_of_it = {pid: words_of(pid) for pid in children(mission.pid)}
        traffic.update(carried({pid for pid, words in all_of_it.items() if words[1:2] == ["robot"]}))
        for pid, words in all_of_it.items():
            if "nats-server" in words[0]:
                bus_cpu = cpu_s(pid) or bus_cpu
            if words[1:2] == ["robot"] and "--bus" in words:
                url = words[words.index("--bus") + 1]
        if url is None:
            continue
        key = ["--credentials", out / "state/pki/credentials/watcher.cred"] if more else []
        asked = time.monotonic()
        if subprocess.run([options.tutti, "status", "--bus", url, *key], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0:
            answers.append(time.monotonic() - asked)
    assert mission.returncode == 0, f"mission up ended with {mission.returncode}"
    sent, got = (sum(both[i] for both in traffic.values()) / 1e6 for i in (0, 1))
    row = (time.monotonic() - began, sent, got, bus_cpu, statistics.median(answers) if answers else float("nan"), len(answers))
    return row, {file.name: file.read_bytes() for pattern in FILES for file in sorted(out.glob(pattern))}


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("tutti")
    arguments.add_argument("mission")
    arguments.add_argument("--data")
    arguments.add_argument("--rate", type=float, default=10.0)
    arguments.add_argument("--turns", type=int, default=2)
    options = arguments.parse_args()
    print("| bus | s | robots sent MB | robots got MB | bus CPU s | `tutti status`, median s | of |\n|---|---|---|---|---|---|---|", flush=True)
    first, same = None, []
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(options.turns):
            for name, more in (("open", []), ("TLS and rights", ["--pki"])):
                row, files = run(options, pathlib.Path(folder) / f"{len(more)}_{turn}", more)
                print(f"| {name} | {row[0]:.1f} | {row[1]:.3f} | {row[2]:.3f} | {row[3]:.2f} | {row[4]:.3f} | {row[5]} |", flush=True)
                first = first or files
                same.append(all(files.get(key) == first[key] for key in first))
    print(f"\n{', '.join(first)}: {'equal to the bit' if all(same) else f'DIFFERENT: {same}'}")
    return 0 if all(same) else 1


if __name__ == "__main__":
    raise SystemExit(main())
