#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the commands of README.md's section "Your own data" as they stand there, on bags that `tutti simulate` makes: those of
recordings, and those of a live mission, against the server that the first of them starts. Only what a reader has to put in is put in:
HOST:PORT as the server prints it, and a free port for the page. Used by check_pages.py --run.
"""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import urllib.request

BRIEF = "simulation.robots=[{walk: {duration_s: 40}}, {walk: {duration_s: 40}}]"
MINE = "mission: mine\nrobots: [{name: alpha, bag: alpha}, {name: bravo, bag: bravo}]\nclosures: {verifier: lidar}\n"
WAIT_S = 120  # for what a program is to print or do


def block(page, begin):
    """The commands of the first block behind the line `begin`."""
    found = re.search(rf"^{begin}\n\n```sh\n(.*?)^```", page, re.M | re.S)
    return found[1].splitlines() if found else []


def free_port():
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as one:
        return one.getsockname()[1]


class Wrong(Exception):
    pass


class Reader:
    """Who types the commands, in a folder of their own."""

    def __init__(self, program, folder):
        self.folder, self.started = pathlib.Path(folder), []
        (self.folder / "bin").mkdir()
        (self.folder / "bin/tutti").symlink_to(pathlib.Path(program).resolve())
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        self.environment = {**os.environ, "PATH": path, "ROS_DOMAIN_ID": str(100 + os.getpid() % 100)}

    def type(self, line):
        done = subprocess.run(["bash", "-c", line], cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=WAIT_S)
        if done.returncode:
            raise Wrong(f"{line}\nexit code {done.returncode}: {(done.stdout + done.stderr)[-2000:]}")
        return done.stdout

    def start(self, line, name):
        output = (self.folder / f"{name}.out").open("w+")
        program = subprocess.Popen(["bash", "-c", "exec " + line], cwd=self.folder, env=self.environment, stdout=output, stderr=subprocess.STDOUT)
        self.started.append((line, program, output))

    def wait_for(self, what, ready):
        until = time.monotonic() + WAIT_S
        while not (found := ready()):
            ended = [f"{line}\n{self.said(output)}" for line, program, output in self.started if program.poll() is not None]
            if ended or time.monotonic() > until:
                raise Wrong(f"{what}: not within {WAIT_S} s; {'; '.join(ended) or 'everything runs'}")
            time.sleep(0.2)
        return found

    @staticmethod
    def said(output):
        return pathlib.Path(output.name).read_text()[-2000:]

    def stop(self):
        """The last that was started first, as one does it."""
        wrong = []
        for line, program, output in reversed(self.started):
            program.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(30)
            if program.poll() != 0:
                program.kill()
                wrong.append(f"{line}\nexit code {program.poll()} after SIGTERM: {self.said(output)}")
            output.close()
        self.started = []
        return wrong


def run_recordings(reader, lines):
    reader.type(f"tutti simulate demo -o recordings --set '{BRIEF}'")
    (reader.folder / "FOLDER").symlink_to(reader.folder / "recordings")
    (reader.folder / "mine.yaml").write_text(MINE)
    for line in lines:
        reader.type(line)
    if not (reader.folder / "out/mine/report.html").exists():
        raise Wrong("out/mine/report.html is not there")


def run_live(reader, lines):
    server, robot, export = lines
    port = free_port()
    if "--view 8080" not in server or "nats://HOST:PORT" not in robot:
        raise Wrong(f"expected --view 8080 and nats://HOST:PORT in\n{server}\n{robot}")
    reader.start(server.replace("--view 8080", f"--view {port}"), "server")
    printed = reader.wait_for("the server's line for robots", lambda: re.search(r"--bus nats://(\S+)", (reader.folder / "server.out").read_text()))
    robot = robot.replace("HOST:PORT", printed[1])
    has_ros = "--ros" in reader.type("tutti robot --help")
    reader.start(robot if has_ros else re.sub(r"--ros\b.*", f"demo --stay --rate 4 --set '{BRIEF}'", robot), "robot")
    if has_ros:
        reader.type("tutti bag play recordings/alpha --wait-for /alpha/odom --rate 4")
    reader.wait_for("submaps of alpha", lambda: re.search(r"[1-9][0-9]* submaps", reader.type(f"tutti status {printed[0]} --mission site")))
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=WAIT_S) as page:
        if "tutti" not in page.read().decode().lower():
            raise Wrong(f"{server}: its page is none")
    reader.type(export)
    if not (reader.folder / "map.yaml").exists():
        raise Wrong(f"{export}\nmap.yaml is not there")


def run(page, program):
    """The commands that failed, each with its output."""
    if not shutil.which("nats-server"):
        raise SystemExit(print("TUTTI_ALL_SKIPPED: no nats-server; apt install nats-server"))
    with tempfile.TemporaryDirectory() as folder:
        reader, wrong = Reader(program, folder), []
        try:
            for begin, run_block in (("From recordings:", run_recordings), ("Live:", run_live)):
                lines = block(page, begin)
                if len(lines) != 3:
                    raise Wrong(f"README.md: {len(lines)} commands behind '{begin}', expected 3; scripts/run_readme.py runs them")
                run_block(reader, lines)
        except (Wrong, subprocess.TimeoutExpired) as error:
            wrong.append(str(error))
        finally:
            wrong += reader.stop()
        return wrong
