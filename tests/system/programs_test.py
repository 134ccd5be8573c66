#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Server, robots and workers as programs, over a nats-server of their own; skips where none is installed.

usage: programs_test.py TUTTI_PROGRAM SOURCE_DIR [Programs.TEST...]
"""
import json
import math
import os
import pathlib
import random
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
import unittest

TUTTI, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
MISSION = SOURCE / "tests/system/small_mission.yaml"
SHARED = SOURCE.parent / "shared/data"
HAS_NATS = shutil.which("nats-server") or (os.path.exists("/usr/sbin/nats-server") and "/usr/sbin/nats-server")
RATE = ["--rate", "40"]  # 150 s in about 4
PATIENCE_S = 120.0  # a busy machine


def run(*arguments):
    return subprocess.run([TUTTI, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S)


def rows(file, table):
    """(key, bytes) of a map that nobody has open."""
    with sqlite3.connect(f"file:{file}?immutable=1", uri=True) as store:
        return store.execute(f"SELECT key, bytes FROM {table} ORDER BY key").fetchall()


def children(parent):
    """The children of a process."""
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            number, _, rest = stat.read_text().partition(" (")
        except OSError:  # it has ended
            continue
        if rest.rpartition(") ")[2].split()[1] == str(parent):
            found.append(int(number))
    return found


def submaps(file):
    return len(rows(file, "submaps"))


def report(folder):
    return json.loads((folder / "report.json").read_text())


def vertices(folder):
    """Positions of the map's keyframes, by their number."""
    words = [line.split() for line in (folder / "graph.g2o").read_text().splitlines()]
    return {int(w[1]): [float(x) for x in w[2:5]] for w in words if w and w[0].startswith("VERTEX")}


def edges(folder):
    words = [line.split() for line in (folder / "graph.g2o").read_text().splitlines()]
    return sorted((int(w[1]), int(w[2])) for w in words if w and w[0].startswith("EDGE"))


def fleet():
    """A pose graph: two robots on one circle, a second a pose; every other closure between them arrives 40 s late."""
    turn, radius, covariance = 2 * math.pi / 40, 8.0, " ".join("1e-4" if i in (0, 6, 11, 15, 18, 20) else "0" for i in range(21))
    pose = lambda x, y, yaw: f"{x:.9f} {y:.9f} 0 0 0 {math.sin(yaw / 2):.12f} {math.cos(yaw / 2):.12f}"
    stamp = lambda k, late_s=0: f"{1670403892 + k + late_s}.357527971"
    lines = []
    for robot in "ab":
        for k in range(120):
            angle = turn * k
            lines.append(f"VERTEX_SE3:QUAT {stamp(k)} {robot}{k} {pose(radius * math.cos(angle), radius * math.sin(angle), angle)}")
    step = pose(*(radius * value for value in (math.cos(turn) - 1, math.sin(turn))), turn)
    for robot in "ab":
        lines += [f"EDGE_SE3:QUAT {stamp(k)} {robot}{k - 1} {robot}{k} {step} {covariance}" for k in range(1, 120)]
    for k in range(40, 120, 5):
        lines.append(f"EDGE_SE3:QUAT {stamp(k)} a{k - 40} a{k} {pose(0, 0, 0)} {covariance}")
        lines.append(f"EDGE_SE3:QUAT {stamp(k, 40 * (k % 2))} a{k} b{k - 40} {pose(0, 0, 0)} {covariance}")
    return "\n".join(lines) + "\n"


class Program:
    """One of tutti's programs while it runs."""

    def __init__(self, *arguments, env=None):
        self.process = subprocess.Popen([TUTTI, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True, env={**os.environ, **(env or {})})

    def line(self):
        """The next line of its output; when it has ended instead, why."""
        line = self.process.stdout.readline().strip()
        if not line:
            raise AssertionError("ended without a line: {}, {}".format(*self.end(stop=False)))
        return line

    def bus(self):
        """The bus of a server that has just been started: its first line is the command that starts a robot."""
        line, begin = self.line(), "tutti robot --name NAME --bus "
        assert line.startswith(begin), f"{line}, {self.process.poll()}"
        return line.removeprefix(begin).split()[0]

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def end(self, stop=True):
        """Exit code and what it said."""
        if stop:
            self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out + err


class ProgramsTest(unittest.TestCase):
    """A folder in which programs run, and what they say of themselves in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def start(self, *arguments, env=None):
        program = Program(*arguments, env=env)
        self.addCleanup(lambda: program.process.poll() is None and program.kill())
        return program

    def status(self, who):
        try:
            return json.loads((self.path / who / "status.json").read_text())
        except (OSError, ValueError):
            return {}

    def wait_for(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), end, f"{what}: {self.status('server')} {self.status('alpha')}")
            time.sleep(0.02)

    def wait_for_map(self, what="end"):
        """Waits for a status that is written after this is asked: the one before may not know the last submaps yet."""
        asked = time.time()
        file = self.path / "server/status.json"
        self.wait_for(lambda: file.stat().st_mtime > asked + 0.1 and self.status("server")["pending_jobs"] == 0 and
                      not self.status("server")["has_news"], what)


@unittest.skipUnless(HAS_NATS, "nats-server is not installed")
class Programs(ProgramsTest):
    @classmethod
    def setUpClass(cls):
        cls.common = tempfile.TemporaryDirectory()
        cls.expected = pathlib.Path(cls.common.name) / "run"
        done = run("run", MISSION, "--out", cls.expected)
        assert done.returncode == 0, done.stderr
        assert report(cls.expected)["server"]["closures_accepted"] > 5

    @classmethod
    def tearDownClass(cls):
        cls.common.cleanup()

    def start_server(self, *more, rate=RATE, env=None):
        server = self.start("server", "--state", self.path / "server", MISSION, *rate, *more, env=env)
        bus = server.bus()
        self.assertTrue(bus.startswith("nats://127.0.0.1:"), bus)
        return server, bus

    def start_robot(self, name, bus, *more, rate=RATE):
        return self.start("robot", "--name", name, "--bus", bus, "--state", self.path / name, MISSION, *rate,
                          "--session", "0", *more)

    def expect_same_map(self, out, expected=None):
        expected = expected or self.expected
        self.assertEqual(edges(out), edges(expected))
        expected, found = vertices(expected), vertices(out)
        self.assertEqual(found.keys(), expected.keys())
        for number, position in expected.items():
            for a, b in zip(position, found[number]):
                self.assertLess(abs(a - b), 1e-3)

    def expect_same_map_file(self):
        done = run("map", "export", self.path / "server/map.tutti", "--g2o", self.path / "graph.g2o")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.expect_same_map(self.path)

    def mission_up(self, *more):
        out = self.path / "up"
        done = run("mission", "up", MISSION, "--out", out, *RATE, *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_same_map(out)
        here, there = report(out), report(self.expected)
        for key in ("closures_accepted", "rejections", "rmse_m", "failed_odometry"):
            self.assertEqual(here["server"][key], there["server"][key])
        return out

    def test_mission_up_is_tutti_run(self):
        out = self.mission_up("--view", "0")
        shown = (out / "report.html").read_text()
        for key in ("status", "alerts", "radio"):  # as the page was sent them meanwhile
            self.assertTrue(f'{{"key":"{key}","t":' in shown, key)
        for name in ("alpha", "bravo"):
            told = (out / "state/robots" / name / "events.jsonl").read_text()
            for event in ("update_timed", "update_scored"):
                self.assertIn(f'"{event}"', told)
        again = run("mission", "up", MISSION, "--out", out)
        self.assertEqual(again.returncode, 1)
        self.assertIn("earlier mission", again.stderr)

    def test_a_page_that_is_killed_over_and_over_changes_nothing(self):
        status = self.path / "up/state/server/page/status.json"
        over, killed = threading.Event(), []

        def kill_pages():
            while not over.wait(0.05):
                try:
                    page = json.loads(status.read_text())["pid"]
                except (OSError, ValueError):
                    continue
                if page not in killed and "page" in pathlib.Path(f"/proc/{page}/cmdline").read_text():
                    killed.append(page)
                    time.sleep(0.3)
                    os.kill(page, signal.SIGKILL)

        killer = threading.Thread(target=kill_pages)
        killer.start()
        try:
            self.mission_up("--view", "0")
        finally:
            over.set()
            killer.join()
        self.assertGreaterEqual(len(killed), 2)

    def test_fixes_are_sent_like_the_rest_also_with_rights(self):
        mission = [SOURCE / "missions/apart_fixes.yaml", "--set", "simulation.robots.0.walk.duration_s=240",
                   "--set", "simulation.robots.1.walk.duration_s=240"]
        expected, out = self.path / "run", self.path / "up"
        for words in (("run", *mission, "--out", expected, "--map", self.path / "run.tutti"),
                      ("mission", "up", *mission, "--out", out, "--rate", "60", "--pki")):
            done = run(*words)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_same_map(out, expected)
        here, there = report(out)["server"], report(expected)["server"]
        self.assertGreater(sum(robot["fixes"] for robot in there["fixes"]["robots"]), 400)
        self.assertIsNotNone(there["fixes"]["origin"])
        for key in ("closures_accepted", "rejections", "components", "fixes"):
            self.assertEqual(here[key], there[key])
        self.assertEqual(rows(out / "state/server/map.tutti", "submaps"), rows(self.path / "run.tutti", "submaps"))

    @unittest.skipUnless((SHARED / "euroc/V1_01/maplab_submaps").is_dir(), "no recordings in ../shared/data")
    def test_robots_replay_keypoints_of_a_front_end(self):
        mission, expected, out = SOURCE / "missions/euroc_v101_rovio.yaml", self.path / "run", self.path / "up"
        for words in (("run", mission, "--out", expected), ("mission", "up", mission, "--out", out, "--rate", "20")):
            done = run(*words, "--data", SHARED)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_same_map(out, expected)
        for key in ("closures_accepted", "rejections", "components"):
            self.assertEqual(report(out)["server"][key], report(expected)["server"][key])
        robots = report(out)["robots"]
        self.assertTrue(all(robot["course"][-1]["server_rmse_m"] < 0.15 for robot in robots), robots[0]["course"][-1:])

    def test_a_fleet_hears_of_closures_when_they_arrived(self):
        (self.path / "fleet.pyfg").write_text(fleet())
        (self.path / "fleet.yaml").write_text(
            "robots: [{name: a, graph: {file: fleet.pyfg}}, {name: bravo, graph: {file: fleet.pyfg, robot: b}}]\n"
            "closures: {verifier: recorded}\n")
        expected, out = self.path / "run", self.path / "up"
        for words in (("run",), ("mission", "up", "--rate", "20")):
            done = run(*words, self.path / "fleet.yaml", "--data", self.path, "--out", out if len(words) > 1 else expected)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_same_map(out, expected)
        for key in ("closures_accepted", "components"):
            self.assertEqual(report(out)["server"][key], report(expected)["server"][key])
        self.assertEqual(report(expected)["server"]["closures_accepted"], 32)
        arrivals = sorted([k for k in range(40, 120, 5)] + [k + 40 * (k % 2) for k in range(40, 120, 5)])
        for folder in (out, expected):  # the server's clock is the older one
            course = report(folder)["server"]["course"]
            for update in course:
                self.assertLessEqual(update["closures_accepted"], sum(at <= update["time_s"] for at in arrivals))
            self.assertGreater(course[-1]["time_s"], 155.0)  # of a115 and b75, and the robots had ended at 119

    def test_workers_elsewhere_find_the_same(self):
        out = self.mission_up("--workers", "2")
        told = [json.loads(line) for line in (out / "state/server/events.jsonl").read_text().splitlines()]
        self.assertTrue(any(event["event"] == "verdicts_taken" for event in told))

    def test_a_killed_worker_costs_only_time(self):
        server, bus = self.start_server("--threads", "0")
        robots = [self.start_robot(name, bus) for name in ("alpha", "bravo")]
        workers = [self.start("worker", "--bus", bus, MISSION) for _ in range(2)]
        self.wait_for(lambda: self.status("server").get("submaps", 0) >= 6, "submaps")
        workers[0].kill()
        for robot in robots:
            self.assertEqual(robot.end(stop=False)[0], 0)
        self.wait_for_map()
        self.assertEqual(workers[1].end()[0], 0)
        self.assertEqual(server.end()[0], 0)
        self.expect_same_map_file()

    def mission_status(self, bus, *more):
        done = run("status", "--bus", bus, "--json", *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return json.loads(done.stdout)

    def test_what_a_bare_worker_cannot_do_waits_for_one_that_can(self):
        server, bus = self.start_server("--threads", "0")
        bare = self.start("worker", "--bus", bus)  # has no reference, which this mission's closures come from
        robots = [self.start_robot(name, bus) for name in ("alpha", "bravo")]
        self.wait_for(lambda: self.mission_status(bus)["waiting"] > 0, "a job that is given back")
        self.assertIn("reference", self.mission_status(bus)["why_waiting"])
        proper = self.start("worker", "--bus", bus, MISSION)
        for robot in robots:
            self.assertEqual(robot.end(stop=False)[0], 0)
        self.wait_for_map()
        self.assertEqual(self.mission_status(bus)["waiting"], 0)
        for program in (bare, proper, server):
            code, said = program.end()
            self.assertEqual(code, 0, said)
        self.expect_same_map_file()

    def test_a_bare_worker_has_the_servers_settings(self):
        """Those of a LiDAR's mission, and not the default ones: no pair is ever one place."""
        settings = ["--set", "closures.verifier=lidar", "--set", "simulation.sensors=lidar", "--set", "duration_s=40",
                    "--set", "agent.submap.duration_s=8", "--set", "closures.min_submap_gap=1",
                    "--set", "closures.lidar.min_points=999000"]
        server, bus = self.start_server("--threads", "0", *settings)
        bare = self.start("worker", "--bus", bus, "--threads", "2")
        robots = [self.start_robot(name, bus, *settings) for name in ("alpha", "bravo")]
        for robot in robots:
            self.assertEqual(robot.end(stop=False)[0], 0)
        self.wait_for_map("answers")
        self.assertGreaterEqual(self.status("server")["submaps"], 6)
        self.assertEqual(self.status("server")["closures"], 0)
        for program in (bare, server):
            code, said = program.end()
            self.assertEqual(code, 0, said)
        info = run("map", "info", self.path / "server/map.tutti").stdout
        self.assertRegex(info, r"verifier +lidar [0-9]+ \(settings [0-9a-f]{16}\): closures between 0 pairs, [1-9]")

    def test_a_mission_has_one_server_and_others_are_told(self):
        server, bus = self.start_server("--mission", "alps")
        code, said = self.start("server", "--state", self.path / "second", "--bus", bus, "--mission", "alps",
                                MISSION).end(stop=False)
        self.assertEqual(code, 1, said)
        for word in ("'alps'", f"process {server.process.pid}", str(self.path / "server"), "since 20"):
            self.assertIn(word, said)
        other = self.start("server", "--state", self.path / "third", "--bus", bus, "--mission", "jura", MISSION)
        self.assertIn("--mission jura", other.line())

        self.assertIn("alps, jura", run("status", "--bus", bus).stderr)  # which?
        robot = self.start_robot("alpha", bus, "--mission", "alpes")
        self.wait_for(lambda: "alps" in self.status("alpha").get("alone", ""), "a robot that is told")
        self.assertIn("'alpes'", self.status("alpha")["alone"])
        robot.kill()
        robot = self.start_robot("alpha", bus, "--mission", "jura", "--stay")
        self.wait_for(lambda: self.status("alpha").get("finished") and self.status("alpha")["backlog"] == 0, "jura")
        self.assertEqual(self.mission_status(bus, "--mission", "alps")["submaps"], 0)
        self.assertGreater(self.mission_status(bus, "--mission", "jura")["submaps"], 3)
        self.assertEqual(robot.end()[0], 0)

        other.kill()  # its own restart takes its place at once
        other = self.start("server", "--state", self.path / "third", "--bus", bus, "--mission", "jura", MISSION)
        self.assertIn("--mission jura", other.line())
        for program in (other, server):
            code, said = program.end()
            self.assertEqual(code, 0, said)
        done = run("server", "--state", self.path / "fourth", "--mission", "two words")
        self.assertEqual(done.returncode, 2)
        self.assertIn("letters, digits", done.stderr)

    def test_a_killed_server_and_a_killed_robot_go_on(self):
        server, bus = self.start_server()
        robots = {name: self.start_robot(name, bus) for name in ("alpha", "bravo")}
        self.wait_for(lambda: self.status("server").get("submaps", 0) >= 4, "submaps")
        server.kill()  # its bus goes with it
        self.wait_for(lambda: self.status("alpha").get("time_s", 0) > 75, "half of it")
        robots["alpha"].kill()
        server, same_bus = self.start_server()
        self.assertEqual(same_bus, bus)
        robots["alpha"] = self.start_robot("alpha", bus)
        for name, robot in robots.items():
            code, said = robot.end(stop=False)
            self.assertEqual(code, 0, f"{name}: {said}")
            self.assertEqual(self.status(name)["backlog"], 0)
        self.wait_for_map()
        code, said = server.end()
        self.assertEqual(code, 0, said)
        self.expect_same_map_file()

    def test_kills_at_random_instants_lose_nothing(self):
        """TUTTI_SEED: which instants (bench/soak/kills.py tries many)."""
        rng = random.Random(int(os.environ.get("TUTTI_SEED", "1")))
        slow = ["--rate", "15"]
        server, bus = self.start_server("--threads", "0", rate=slow)

        def start(name):
            if name in ("alpha", "bravo"):
                return self.start("robot", "--name", name, "--bus", bus, "--state", self.path / name, MISSION, *slow,
                                  "--session", "0", "--stay")
            return self.start("worker", "--bus", bus, MISSION)

        others = {name: start(name) for name in ("alpha", "bravo", "worker 1", "worker 2")}
        killed = []
        while len(killed) < 20:
            time.sleep(rng.uniform(0.0, 0.6))
            name = rng.choice([*others, "server", "bus"])
            killed.append(name)
            if name == "server":
                server.kill()  # its bus goes with it
                server, same_bus = self.start_server("--threads", "0", rate=slow)
                self.assertEqual(same_bus, bus)
            elif name == "bus":
                for bus_server in children(server.process.pid):
                    os.kill(bus_server, signal.SIGKILL)
            else:
                others[name].kill()
                others[name] = start(name)
        for name in ("alpha", "bravo"):
            self.wait_for(lambda: self.status(name).get("finished") and self.status(name)["backlog"] == 0, f"{name} {killed}")
        self.wait_for_map(f"the map {killed}")
        for program in (*others.values(), server):
            code, said = program.end()
            self.assertEqual(code, 0, said)
        self.expect_same_map_file()

    def test_a_word_that_the_bus_has_lost_is_said_again(self):
        server, bus = self.start_server()
        robots = [self.start_robot(name, bus) for name in ("alpha", "bravo")]
        for program in (*robots, server):
            code, said = program.end(stop=program is server)
            self.assertEqual(code, 0, said)
        listed = run("map", "closure", "list", self.path / "server/map.tutti").stdout
        closure = next(line.split()[0] for line in listed.splitlines() if " accepted" in line)

        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]

        def start_bus(store):
            started = subprocess.Popen([HAS_NATS, "-js", "-a", "127.0.0.1", "-p", str(port), "-sd", str(store)],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(started.wait)
            self.addCleanup(started.kill)
            return started

        first = start_bus(self.path / "bus")
        server, bus = self.start_server("--bus", f"nats://127.0.0.1:{port}")
        self.wait_for(lambda: run("status", "--bus", bus).returncode == 0, "the server on the bus")
        server.process.send_signal(signal.SIGSTOP)
        word = self.start("map", "closure", "reject", closure, "--bus", bus)
        stream = self.path / "bus/jetstream/$G/streams"
        self.wait_for(lambda: any(b"reject" in block.read_bytes() for block in stream.glob("VERDICTS_*/msgs/*.blk")),
                      "the decision in the stream")
        first.kill()
        start_bus(self.path / "another bus")
        server.process.send_signal(signal.SIGCONT)
        code, said = word.end(stop=False)
        self.assertEqual(code, 0, said)
        self.assertIn("stored by the server", said)
        done = run("map", "closure", "accept", "nobody/1-bravo/2", "--bus", bus)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("nobody", done.stderr)
        self.assertEqual(server.end()[0], 0)
        show = run("map", "closure", "show", closure, self.path / "server/map.tutti").stdout
        self.assertRegex(show, r"decision +reject")

    def test_sigterm_is_a_clean_stop(self):
        slow = ["--rate", "5"]  # nobody has ended by then, however slow the machine is
        server, bus = self.start_server(rate=slow)
        robot = self.start_robot("alpha", bus, rate=slow)
        self.wait_for(lambda: self.status("server").get("submaps", 0) >= 1, "submaps")
        for program in (robot, server):
            code, said = program.end()
            self.assertEqual(code, 0, said)
        stored = submaps(self.path / "server/map.tutti")
        self.assertGreaterEqual(stored, 1)
        self.assertFalse((self.path / "server/map.tutti-wal").exists())
        self.assertFalse(self.status("alpha")["finished"])
        server, bus = self.start_server()
        robot = self.start_robot("alpha", bus)
        self.assertEqual(robot.end(stop=False)[0], 0)
        self.assertEqual(server.end()[0], 0)
        self.assertGreater(submaps(self.path / "server/map.tutti"), stored)

    def test_a_second_robot_of_a_name_is_refused(self):
        _, bus = self.start_server(rate=[])  # names are held for 30 s of mission time
        words = ["robot", "--name", "alpha", "--bus", bus, MISSION, "--stay"]
        first = self.start(*words, "--state", self.path / "alpha")

        def known():
            done = run("status", "--bus", bus, "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            return [robot["name"] for robot in json.loads(done.stdout)["robots"] if robot["last_seen_s_ago"] is not None]

        self.wait_for(lambda: known() == ["alpha"], "alpha's status")
        code, said = self.start(*words, "--state", self.path / "second").end(stop=False)
        self.assertEqual(code, 1, said)
        self.assertIn("alpha", said)
        self.assertIn("another name", said)
        self.assertIsNone(first.process.poll())

    def test_a_robot_that_cannot_reach_its_bus_says_so(self):
        nowhere = "nats://127.0.0.1:1"
        robot = self.start("robot", "--name", "alpha", "--bus", nowhere, "--state", self.path / "alpha", MISSION, "--stay")
        self.wait_for(lambda: "no link to the bus " + nowhere in self.status("alpha").get("trouble", ""), "its trouble")
        self.assertFalse(self.status("alpha")["connected"])
        self.assertIn("cannot reach the bus " + nowhere, (self.path / "alpha/log.txt").read_text())
        self.assertEqual((self.path / "alpha").stat().st_mode & 0o777, 0o750)
        for file in (self.path / "alpha").iterdir():
            self.assertEqual(file.stat().st_mode & 0o027, 0, file)
        code, said = robot.end()
        self.assertEqual(code, 0, said)
        self.assertIn("cannot reach the bus", said)

    def test_tells_the_service_manager(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
            listener.bind(str(self.path / "notify"))
            listener.settimeout(PATIENCE_S)
            server, _ = self.start_server(env={"NOTIFY_SOCKET": str(self.path / "notify")})
            self.assertEqual(listener.recv(100), b"READY=1")
            self.assertEqual(server.end()[0], 0)
            self.assertEqual(listener.recv(100), b"STOPPING=1")

    def test_refusals(self):
        def refused(code, *words, args):
            done = run(*args)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
            for word in words:
                self.assertIn(word, done.stderr + done.stdout)

        state = self.path / "server"
        refused(2, "--state", args=["server"])
        refused(2, "--pki", "--insecure", args=["server", "--state", state, "--listen", "0.0.0.0:4222"])
        refused(2, "TLS", args=["server", "--state", state, "--bus", "nats://192.0.2.1:4222"])
        refused(2, "TLS", args=["robot", "--name", "alpha", "--bus", "nats://192.0.2.1:4222", "--state",
                                self.path / "alpha", MISSION])
        refused(2, "charlie", "alpha, bravo", args=["robot", "--name", "charlie", "--bus", "nats://127.0.0.1:1",
                                                    "--state", self.path / "charlie", MISSION])
        refused(2, "mission", args=["robot", "--name", "alpha", "--bus", "nats://127.0.0.1:1", "--state", state])
        refused(2, "'al pha'", "' '", "letters, digits", args=["robot", "--name", "al pha", "--bus", "nats://127.0.0.1:1", "--state",
                                                               self.path / "space", "--feed", self.path / "feed", MISSION])
        (self.path / "other").mkdir()
        (self.path / "other" / "thesis.tex").write_text("important")
        refused(1, "thesis.tex", args=["server", "--state", self.path / "other"])
        server, bus = self.start_server()
        refused(1, "another program", args=["server", "--state", state])
        refused(1, "server", args=["robot", "--name", "alpha", "--bus", bus, "--state", state, MISSION])
        self.assertEqual(server.end()[0], 0)
        refused(1, "server", args=["robot", "--name", "alpha", "--bus", bus, "--state", state, MISSION])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
