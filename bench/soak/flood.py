#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures what strangers who connect and send nothing cost a bus with rights: a server with --pki, N connections that are opened again as
soon as the bus closes them, and how long a member's `tutti status` takes before, meanwhile and afterwards. Prints a table for
docs/results/robustness.md. The machine must allow this program N open files (ulimit -n).
"""
import argparse
import os
import pathlib
import re
import selectors
import socket
import statistics
import subprocess
import tempfile
import time

TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
PORT = 24733


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def memory_mb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1]) / 1e3


class Flood:
    def __init__(self, most):
        self.most, self.made, self.closed, self.peak = most, 0, 0, 0
        self.open = set()
        self.selector = selectors.DefaultSelector()

    def go_on(self, seconds, until=lambda: False):
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            for _ in range(min(200, self.most - len(self.open))):
                one = socket.socket()
                one.setblocking(False)
                one.connect_ex(("127.0.0.1", PORT))
                self.selector.register(one, selectors.EVENT_READ)
                self.open.add(one)
                self.made += 1
            self.peak = max(self.peak, len(self.open))
            for key, _ in self.selector.select(0.01):
                try:
                    said = key.fileobj.recv(4096)
                except OSError:
                    said = b""
                if not said:
                    self.selector.unregister(key.fileobj)
                    self.open.discard(key.fileobj)
                    key.fileobj.close()
                    self.closed += 1


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("tutti")
    arguments.add_argument("--connections", type=int, default=10_000)
    arguments.add_argument("--seconds", type=float, default=30.0)
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        pki, state = folder / "pki", folder / "server"
        for words in (["init", "--mission", "cave"], ["add-operator", "anna"]):
            subprocess.run([options.tutti, "pki", *words, "--pki", pki], check=True, stdout=subprocess.DEVNULL)
        server = subprocess.Popen([options.tutti, "server", "--pki", pki, "--mission", "cave", "--listen", f"127.0.0.1:{PORT}",
                                   "--state", state], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        command = [options.tutti, "status", "--bus", f"tls://127.0.0.1:{PORT}", "--credentials", pki / "credentials/anna.cred", "--wait", "30"]

        def ask(flood):
            begin = time.monotonic()
            asked = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            flood.go_on(60.0, lambda: asked.poll() is not None)
            return time.monotonic() - begin if asked.wait() == 0 else None

        try:
            calm = Flood(0)
            while ask(calm) is None:  # it is coming up
                time.sleep(0.5)
            bus = int(re.search(r"\[(\d+)\]", (state / "bus/log").read_text())[1])
            print("| | `tutti status`, median s | worst s | failed | open at a time | made | bus CPU s per s | bus MB |\n|---|---|---|---|---|---|---|---|")
            flood = Flood(options.connections)
            flood_names = (("before", calm), (f"{options.connections} silent strangers", flood), ("afterwards", calm))
            for name, load in flood_names:
                begin, began_s = time.monotonic(), cpu_s(bus)
                took = []
                while time.monotonic() - begin < options.seconds:
                    took.append(ask(load))
                good = [t for t in took if t is not None]
                print(f"| {name} | {statistics.median(good) if good else float('nan'):.2f} | {max(good, default=float('nan')):.2f} | "
                      f"{len(took) - len(good)} of {len(took)} | {load.peak} | {load.made} | "
                      f"{(cpu_s(bus) - began_s) / (time.monotonic() - begin):.2f} | {memory_mb(bus):.0f} |", flush=True)
                for one in list(load.open):
                    one.close()
                load.open.clear()
            lines = [line for line in (state / "log.txt").read_text().splitlines() if "refuses a stranger" in line]
            print(f"\nThe server's log has {len(lines)} lines of them; the last: {lines[-1] if lines else '-'}")
        finally:
            server.terminate()
            server.wait(20)


if __name__ == "__main__":
    main()
