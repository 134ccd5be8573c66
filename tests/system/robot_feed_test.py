#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Robots that are fed live, as programs: what their feeds say, and the map that comes of it. Skips without nats-server
or python3-protobuf.

usage: robot_feed_test.py TUTTI_PROGRAM SOURCE_DIR PROTO_PYTHON_DIR [LiveRobots.TEST...]
"""
import json
import math
import os
import pathlib
import random
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.append(sys.argv[3])
try:
    from tutti.v1.feed_pb2 import Feed
except ImportError:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):  # where Debian's package is
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
    Feed = None

import programs_test as common

RATE = ["--rate", "50"]
SAMPLE_S = 0.004  # between samples: about 60 times real time
TRANSLATION, ROTATION = 0.01, math.radians(0.4)  # of the odometry, per sqrt(s): as in the mission below
MISSION = """
mission: fed
input: simulated
robots:
  - {{name: alpha, odometry: {{file: alpha.tum}}, reference: {{file: alpha_reference.tum}}, covariance: {noise},
     fixes: alpha.csv, antenna_m: [0.1, 0.0, 0.2]}}
  - {{name: bravo, odometry: {{file: bravo.tum}}, reference: {{file: bravo_reference.tum}}, covariance: {noise},
     fixes: bravo.csv, antenna_m: [0.1, 0.0, 0.2]}}
closures:
  verifier: reference
  reference: {{wrong_share: 0.2, min_time_gap_s: 20.0}}
""".format(noise="{translation_m_per_sqrt_m: 0, translation_m_per_sqrt_deg: 0, translation_m_per_sqrt_s: 0.01, "
                 "rotation_deg_per_sqrt_m: 0, rotation_deg_per_sqrt_deg: 0, rotation_deg_per_sqrt_s: 0.4}")


def samples(file):
    """[(stamp_ns, x, y, z, qx, qy, qz, qw)] of a TUM file."""
    lines = [line.split() for line in file.read_text().splitlines() if not line.startswith("#")]
    return [(int(words[0].replace(".", "")), *map(float, words[1:])) for words in lines]


def halved(odometry):
    """With one more sample between each two."""
    out = odometry[:1]
    for a, b in zip(odometry, odometry[1:]):
        middle = [(x + y) / 2 for x, y in zip(a[1:], b[1:])]
        norm = math.hypot(*middle[3:])
        out += [((a[0] + b[0]) // 2, *middle[:3], *(q / norm for q in middle[3:])), b]
    return out


def write(file, odometry):
    text = "".join(f"{s[0] // 10**9}.{s[0] % 10**9:09d} {' '.join(map(repr, s[1:]))}\n" for s in odometry)
    file.write_text(text)


def fixes_of(reference):
    """One a second of a receiver that is right, [Feed.Fix]."""
    out = []
    for stamp_ns, x, y, z, *_ in reference:
        if not out or stamp_ns - out[-1].stamp_ns >= 10**9:
            out.append(Feed.Fix(stamp_ns=stamp_ns, latitude_deg=46.5 + y / 111_170.0, longitude_deg=7.9 + x / 76_740.0,
                                height_m=600.0 + z, covariance_m2=[2.25, 2.25, 9.0], p_body_antenna=[0.1, 0.0, 0.2]))
    return out


def write_fixes(file, fixes):
    file.write_text("stamp_s,latitude_deg,longitude_deg,height_m,sigma_east_m,sigma_north_m,sigma_up_m\n" + "".join(
        f"{f.stamp_ns // 10**9}.{f.stamp_ns % 10**9:09d},{f.latitude_deg!r},{f.longitude_deg!r},{f.height_m!r},1.5,1.5,3\n"
        for f in fixes))


def times(a, b):
    """T_a * T_b of feed poses, as [x, y, z]."""
    v, w, u = (a.qx, a.qy, a.qz), a.qw, (b.x, b.y, b.z)
    cross = lambda p, q: (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])
    t = [2 * x for x in cross(v, u)]
    return [o + x + w * y + z for o, x, y, z in zip((a.x, a.y, a.z), u, t, cross(v, t))]


class Client(threading.Thread):
    """Feeds odometry, fixes as they fall due, and where wanted this scan, from where the robot stands on, until it is told
    all or killed."""

    def __init__(self, path, odometry, xyz=(), ends=True, meets=False, fixes=()):
        super().__init__(daemon=True)
        self.fixes = list(fixes)
        self.path, self.odometry, self.xyz, self.ends = str(path), odometry, xyz, ends
        self.meets = meets  # the last samples wait until the robot knows where another is
        self.heard = {}  # messages by kind
        self.answers = []  # (stamp_ns, T_odom_body, correction)
        self.welcome = None
        self.start()

    def run(self):
        end = time.monotonic() + common.PATIENCE_S
        with socket.socket(socket.AF_UNIX) as robot:
            robot.settimeout(common.PATIENCE_S)
            while robot.connect_ex(self.path) != 0 and time.monotonic() < end:
                time.sleep(0.01)
            try:
                with robot.makefile("rwb") as self.stream:
                    self.feed()
            except (OSError, struct.error):  # it was killed
                pass

    def feed(self):
        self.say(hello=Feed.Hello(protocol_version=1, client_name=b"test"))
        self.welcome = self.hear("welcome")
        self.say(health=Feed.Health(battery_v=24.5))
        before_ns = self.odometry[0][0]
        for stamp_ns, *pose in self.odometry:
            if self.welcome.has_odometry and stamp_ns <= self.welcome.last_stamp_ns:
                before_ns = stamp_ns
                self.say_fixes(stamp_ns, stamp_ns < self.welcome.last_stamp_ns)  # of the last one it may have lost them
                continue
            while self.meets and stamp_ns >= self.odometry[-50][0] and not self.knows_another():
                self.hear("situation")
            dt_s = (stamp_ns - before_ns) * 1e-9
            before_ns = stamp_ns
            T_odom_body = Feed.Pose(**dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), pose)))
            covariance = [TRANSLATION**2 * dt_s] * 3 + [ROTATION**2 * dt_s] * 3
            self.say(odometry=Feed.Odometry(stamp_ns=stamp_ns, T_odom_body=T_odom_body, increment_covariance=covariance))
            answer = self.hear("correction", "refused")
            if isinstance(answer, Feed.Correction):
                self.answers.append((stamp_ns, T_odom_body, answer))
                if self.xyz and answer.wants_scan:
                    self.say(scan=Feed.Scan(stamp_ns=stamp_ns, xyz=self.xyz))
            self.say_fixes(stamp_ns)
            time.sleep(SAMPLE_S)
        if self.ends:
            self.say(end_of_recording=Feed.EndOfRecording())
            self.hear("ended")

    def say_fixes(self, until_ns, are_known=False):
        while self.fixes and self.fixes[0].stamp_ns <= until_ns:
            fix = self.fixes.pop(0)
            if not are_known:
                self.say(fix=fix)

    def knows_another(self):
        situations = self.heard.get("situation", [])
        return bool(situations) and any(mate.same_component for mate in situations[-1].team_mate)

    def say(self, **what):
        payload = Feed(**what).SerializeToString()
        self.stream.write(struct.pack("<I", len(payload)) + payload)
        self.stream.flush()

    def hear(self, *kinds):
        while True:
            size, = struct.unpack("<I", self.stream.read(4))
            message = Feed.FromString(self.stream.read(size))
            kind = message.WhichOneof("what")
            self.heard.setdefault(kind, []).append(getattr(message, kind))
            if kind in kinds:
                return self.heard[kind][-1]


@unittest.skipUnless(common.HAS_NATS, "nats-server is not installed")
@unittest.skipUnless(Feed, "python3-protobuf is not installed")
class LiveRobots(common.ProgramsTest):
    def start_server(self, *more):
        server = self.start("server", "--state", self.path / "server", *RATE, *more)
        return server, server.bus()

    def start_robot(self, name, bus, *more):
        return self.start("robot", "--name", name, "--bus", bus, "--state", self.path / name, *more)

    def feed_robot(self, name, bus, *more, rate=RATE):
        return self.start_robot(name, bus, *rate, "--feed", self.path / (name + ".feed"), *more)

    def seen(self, bus):
        done = common.run("status", "--bus", bus, "--json")
        return {robot["name"]: robot for robot in json.loads(done.stdout or "{}").get("robots", [])}

    def joint_graph(self, file):
        exported = common.run("map", "export", file, "--g2o", self.path / "joint.g2o")
        self.assertEqual(exported.returncode, 0, exported.stderr)
        return (self.path / "joint.g2o").read_text()

    def make_mission(self):
        """Recordings of a small simulated mission; the odometry of each robot."""
        done = common.run("run", common.MISSION, "--out", self.path / "simulated")
        self.assertEqual(done.returncode, 0, done.stderr)
        out, fixes = {}, {}
        for name in ("alpha", "bravo"):
            out[name] = halved(samples(self.path / "simulated" / f"{name}_onboard.tum"))
            write(self.path / f"{name}.tum", out[name])
            reference = self.path / "simulated" / f"{name}_reference.tum"
            (self.path / reference.name).write_text(reference.read_text())
            fixes[name] = fixes_of(samples(reference))
            write_fixes(self.path / f"{name}.csv", fixes[name])
        (self.path / "fed.yaml").write_text(MISSION)
        return out, fixes, [self.path / "fed.yaml", "--data", self.path]

    def check_answers(self, client, other):
        """That what the robot said while it was fed holds together."""
        for stamp_ns, T_odom_body, said in client.answers:
            self.assertEqual(said.stamp_ns, stamp_ns)
            body = said.T_map_body
            for a, b in zip(times(said.T_map_odom, T_odom_body), (body.x, body.y, body.z)):
                self.assertLess(abs(a - b), 1e-9)
            self.assertEqual(len(said.T_map_odom_covariance), 36)
        _, _, last = client.answers[-1]
        self.assertTrue(last.in_map)
        self.assertGreater(last.map_revision, 0)
        self.assertGreater(min(last.T_map_odom_covariance[::7]), 0.0)
        mates = client.heard["situation"][-1].team_mate
        self.assertEqual([mate.name for mate in mates], [other])
        self.assertTrue(mates[0].same_component)
        self.assertNotIn("refused", client.heard)

    def test_fed_live_and_killed_makes_the_map_of_the_replay(self):
        odometry, fixes, mission = self.make_mission()
        up = common.run("mission", "up", *mission, "--out", self.path / "up", *RATE)
        self.assertEqual(up.returncode, 0, up.stdout + up.stderr)
        server, bus = self.start_server(*mission)
        words = [*mission, "--session", "0"]
        robots = {name: self.feed_robot(name, bus, *words) for name in odometry}
        client = lambda name: Client(self.path / f"{name}.feed", odometry[name], meets=True, fixes=fixes[name])
        clients = {name: client(name) for name in odometry}

        self.wait_for(lambda: len(clients["alpha"].answers) > len(odometry["alpha"]) / 2, "half of it")
        code, said = self.start("robot", "--name", "charlie", "--bus", bus, "--state", self.path / "charlie", "--feed",
                                self.path / "alpha.feed").end(stop=False)
        self.assertEqual(code, 1, said)
        self.assertIn("another program listens there", said)
        robots["alpha"].kill()
        clients["alpha"].join(common.PATIENCE_S)
        before = clients["alpha"].answers
        self.assertTrue((self.path / "alpha.feed").is_socket())  # as a killed program leaves it
        robots["alpha"] = self.feed_robot("alpha", bus, *words)
        clients["alpha"] = client("alpha")

        for name, robot in robots.items():
            clients[name].join(common.PATIENCE_S)
            self.assertIn("ended", clients[name].heard)
            code, said = robot.end(stop=False)
            self.assertEqual(code, 0, said)
            self.assertEqual(self.status(name)["backlog"], 0)
            self.assertFalse((self.path / f"{name}.feed").exists())
        self.assertTrue(clients["alpha"].welcome.has_odometry)
        self.assertEqual(clients["alpha"].welcome.session, 0)
        self.assertGreater(clients["alpha"].welcome.last_stamp_ns, odometry["alpha"][0][0])
        said_ns = odometry["alpha"][len(before)][0]  # perhaps one more than was answered
        self.assertLessEqual(clients["alpha"].welcome.last_stamp_ns, said_ns)
        self.check_answers(clients["alpha"], "bravo")
        self.check_answers(clients["bravo"], "alpha")
        self.wait_for_map()
        self.assertEqual(server.end()[0], 0)
        self.assertGreater(sum(robot["fixes"] for robot in common.report(self.path / "up")["server"]["fixes"]["robots"]), 250)
        fed, replayed = self.path / "server/map.tutti", self.path / "up/state/server/map.tutti"
        self.assertGreater(len(common.rows(replayed, "submaps")), 5)
        self.assertEqual(common.rows(fed, "submaps"), common.rows(replayed, "submaps"))
        self.assertEqual(self.joint_graph(fed), self.joint_graph(replayed))

    def test_the_example_client_feeds_a_robot_that_is_in_no_mission(self):
        done = common.run("run", common.MISSION, "--out", self.path / "simulated")
        self.assertEqual(done.returncode, 0, done.stderr)
        onboard = self.path / "simulated/alpha_onboard.tum"
        odometry = samples(onboard)
        server, bus = self.start_server()
        robot = self.feed_robot("charlie", bus, rate=[])  # what it hears is written every half second
        client = Client(self.path / "charlie.feed", odometry[:200], ends=False)
        client.join(common.PATIENCE_S)
        self.assertEqual(len(client.answers), 200)
        self.wait_for(lambda: self.seen(bus).get("charlie", {}).get("battery_v") == 24.5, "what its body reports")
        self.assertEqual(robot.end()[0], 0)
        self.assertFalse((self.path / "charlie.feed").exists())
        robot = self.feed_robot("charlie", bus)
        self.wait_for((self.path / "charlie.feed").exists, "socket")
        done = subprocess.run(
            [sys.executable, common.SOURCE / "examples/feed_client.py", self.path / "charlie.feed"], text=True,
            input=onboard.read_text(), capture_output=True, env={**os.environ, "PYTHONPATH": sys.argv[3]},
            timeout=common.PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), len(odometry) - 200)  # a stop loses nothing
        code, said = robot.end(stop=False)
        self.assertEqual(code, 0, said)
        self.assertEqual(self.status("charlie")["keyframes"], len(odometry))
        self.assertGreater(self.seen(bus)["charlie"]["number"], 2**31)
        self.assertEqual(server.end()[0], 0)

    def test_scans_go_into_the_map(self):
        odometry = [(i * 10**8, 0.05 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for i in range(200)]
        draw = random.Random(1)
        cloud = [draw.uniform(-10.0, 10.0) for _ in range(3 * 2000)]
        server, bus = self.start_server()
        robots = [(self.feed_robot(name, bus), Client(self.path / f"{name}.feed", odometry, xyz))
                  for name, xyz in (("blind", ()), ("seeing", cloud))]
        for robot, client in robots:
            code, said = robot.end(stop=False)
            self.assertEqual(code, 0, said)
            self.assertNotIn("refused", client.heard)
        blind, seeing = self.seen(bus)["blind"]["number"], self.seen(bus)["seeing"]["number"]
        self.assertEqual(server.end()[0], 0)
        size = {robot: sum(len(row) for key, row in common.rows(self.path / "server/map.tutti", "submaps")
                           if int.from_bytes(key[:8], "big") == robot) for robot in (blind, seeing)}
        self.assertGreater(size[blind], 0)
        self.assertGreater(size[seeing], size[blind] + 2000)  # a byte per point at least

    def test_a_full_disk_costs_the_map_and_never_the_pose(self):
        odometry = [(i * 10**8, 0.05 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for i in range(800)]
        server, bus = self.start_server()
        alone = Client(self.path / "alone.feed", odometry)
        self.assertEqual(self.feed_robot("alone", bus).end(stop=False)[0], 0)
        self.assertNotIn("refused", alone.heard)
        robot = self.feed_robot("alpha", bus)

        def feed(until, **more):
            client = Client(self.path / "alpha.feed", odometry[:until], **more)
            client.join(common.PATIENCE_S)
            self.assertEqual(len(client.answers), 200)  # every one, at once
            self.assertNotIn("refused", client.heard)
            return client

        feed(200, ends=False)
        self.wait_for(lambda: self.status("alpha").get("keyframes", 0) > 20, "a map")
        # Files may grow no more: of the robot's only its store is longer than this.
        resource.prlimit(robot.process.pid, resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
        feed(400, ends=False)
        self.wait_for(lambda: "cannot store" in self.status("alpha").get("trouble", ""), "a word of it")
        blind = feed(600, ends=False)
        self.assertEqual(blind.welcome.last_stamp_ns, odometry[399][0])  # received, not stored
        alerts = [alert.text for situation in blind.heard["situation"] for alert in situation.alert]
        self.assertTrue(any("cannot store" in text for text in alerts), alerts)
        stored = {said.stored_stamp_ns for _, _, said in blind.answers}
        self.assertEqual(len(stored), 1)
        self.assertGreaterEqual(max(stored), odometry[100][0])
        self.assertLess(max(stored), odometry[399][0])
        self.assertGreater(blind.answers[-1][2].T_map_odom_covariance[0], blind.answers[0][2].T_map_odom_covariance[0])
        self.assertIsNone(robot.process.poll())
        resource.prlimit(robot.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        self.assertIn("ended", feed(800).heard)
        code, said = robot.end(stop=False)
        self.assertEqual(code, 0, said)
        self.assertIn("cannot store anything", said)
        self.assertEqual(self.status("alpha")["keyframes"], self.status("alone")["keyframes"])
        numbers = {robot["number"] for robot in self.seen(bus).values()}
        self.assertEqual(server.end()[0], 0)
        kept = common.rows(self.path / "server/map.tutti", "submaps")
        counts = [sum(int.from_bytes(key[:8], "big") == number for key, _ in kept) for number in numbers]
        self.assertEqual(counts[0], counts[1])
        self.assertGreater(counts[0], 2)

    def test_a_small_budget_of_the_uplink_leaves_a_backlog_and_nothing_is_lost(self):
        server, bus = self.start_server(common.MISSION)
        robot = self.start_robot("alpha", bus, *RATE, common.MISSION, "--uplink-budget", "20")
        self.wait_for(lambda: self.status("alpha").get("finished"), "the recording's end")
        self.wait_for(lambda: self.status("server").get("submaps", 0) > 0, "the first submap")

        def waits():
            waiting = self.seen(bus).get("alpha", {})
            return waiting.get("backlog_submaps", 0) > 1 and waiting["backlog_bytes"] > 500

        self.wait_for(waits, "a backlog")
        code, said = robot.end()
        self.assertEqual(code, 0, said)
        code, said = self.start_robot("alpha", bus, *RATE, common.MISSION).end(stop=False)
        self.assertEqual(code, 0, said)
        self.assertEqual(self.status("alpha")["backlog"], 0)
        self.assertEqual(server.end()[0], 0)
        numbers = [int.from_bytes(key[-8:], "big") for key, _ in common.rows(self.path / "server/map.tutti", "submaps")]
        self.assertGreater(len(numbers), 5)
        self.assertEqual(numbers, list(range(len(numbers))))

    def test_refusals(self):
        words = ["robot", "--name", "alpha", "--bus", "nats://127.0.0.1:1", "--state", self.path / "alpha"]
        for code, word, more in ((2, "--feed SOCKET", []),
                                 (2, "--uplink-budget", [common.MISSION, "--uplink-budget", "-1"]),
                                 (1, "no socket", ["--feed", common.MISSION]),
                                 (1, "bytes", ["--feed", "/tmp/" + 200 * "x"])):
            done = common.run(*words, *more)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
            self.assertIn(word, done.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
