# SPDX-License-Identifier: BSD-3-Clause
"""Shared by tests with programs at the other end."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

import mcap_reader
import ros_stub
from paths import TUTTI
from tutti_ros.node import TuttiNode

PATIENCE_S = 120.0
HAS_NATS = shutil.which("nats-server") or os.path.exists("/usr/sbin/nats-server")


class WithPrograms(unittest.TestCase):
    """Nodes, and `tutti robot` at the other end."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def start(self, *arguments):
        program = subprocess.Popen([TUTTI, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(lambda: (program.poll() is None and program.kill(), program.communicate()))
        return program

    def start_robot(self, name, bus, *more):
        return self.start("robot", "--name", name, "--bus", bus, "--state", self.path / name, "--feed",
                          self.path / f"{name}.feed", "--stay", *more)

    def start_server(self, *more):
        """The program, and its bus."""
        server = self.start("server", "--state", self.path / "server", *more)
        words = server.stdout.readline().split()
        return server, words[words.index("--bus") + 1]

    def run_tutti(self, *arguments):
        """Its output, once it has ended well."""
        done = subprocess.run([TUTTI, *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def node(self, name, kind=TuttiNode, **parameters):
        ros_stub.Node.given = {"socket": str(self.path / f"{name}.feed"), **parameters}
        node = kind()
        self.addCleanup(node.destroy_node)
        return node

    def recorded(self, name, topics):
        """(topic, CDR) of a bag that `tutti simulate` wrote, in its order. `topics` are below the robot's name."""
        of = {f"/{name}/{topic}": topic for topic in topics}
        for topic, cdr in mcap_reader.messages((self.path / name / f"{name}_0.mcap").read_bytes()):
            if topic in of:
                yield of[topic], cdr

    def place_sensors(self, name, node):
        """Where they are by that bag."""
        for topic, cdr in mcap_reader.messages((self.path / name / f"{name}_0.mcap").read_bytes()):
            if topic == "/tf_static":
                node.callbacks[topic](cdr)

    def diagnosis(self, node):
        """The level of /diagnostics, and its values in lines."""
        node.callbacks["publish_diagnostics"]()
        status = node.made["/diagnostics"].said[-1].status[0]
        return status.level, "\n".join(pair.value for pair in status.values)

    def status(self, name):
        try:
            return json.loads((self.path / name / "status.json").read_text())
        except (OSError, ValueError):
            return {}

    def fed(self, name):
        """The feed's part of its status."""
        return self.status(name).get("feed", {})

    def wait_for_map(self):
        """Until the server has an answer for every pair and a map with it, by a status that is written after this is asked."""
        asked, file = time.time(), self.path / "server/status.json"
        self.wait_for(lambda: file.stat().st_mtime > asked + 0.1 and self.status("server").get("pending_jobs") == 0 and
                      self.status("server").get("has_news") is False, "the server's map")

    def wait_for(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.01)
