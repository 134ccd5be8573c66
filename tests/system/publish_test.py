#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A map that an operator publishes on a bus with rights, and a robot that fetches it, is killed at it, and changes to the
next one; skips without nats-server.

usage: publish_test.py TUTTI_PROGRAM SOURCE_DIR [Publish.TEST...]
"""
import hashlib
import random
import re
import shutil
import sqlite3
import struct
import sys
import unittest

import programs_test as common

MISSION = [common.SOURCE / "missions/next_day.yaml", "--set", "simulation.lidar.rays_share=0.25",
           "--set", "simulation.robots.2.start_s=0", "--set", "duration_s=60"]
PIECE = 128 << 10


def put_row(file, key, value):
    """Writes a row of a map's table `meta`, with its hash (docs/storage.md)."""
    code = 0xcbf29ce484222325
    for byte in key.encode() + value:
        code = ((code ^ byte) * 0x100000001b3) & 0xffffffffffffffff
    with sqlite3.connect(file) as store:
        store.execute("INSERT OR REPLACE INTO meta (key, hash, bytes) VALUES (?, ?, ?)",
                      (key.encode(), code - (1 << 64) if code >> 63 else code, value))
    store.close()


def digest(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()


@unittest.skipUnless(common.HAS_NATS, "nats-server is not installed")
class Publish(common.ProgramsTest):
    def make_map(self):
        file = self.path / "first.tutti"
        self.expect(0, "run", *MISSION, "--map", file, "--out", self.path / "run")
        put_row(file, "padding", random.Random(1).randbytes(12 * PIECE))
        return file

    def make_next(self, first):
        """The same map in its next version."""
        file = self.path / "second.tutti"
        shutil.copy(first, file)
        epoch, revision, *rest = struct.unpack(">4Q", dict(common.rows(file, "meta"))[b"map"])
        put_row(file, "map", struct.pack(">4Q", epoch, revision + 1, *rest))
        return file

    def expect(self, code, *arguments):
        done = common.run(*arguments)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def publish(self, *arguments, code=0, by="anna", pki="pki"):
        return self.expect(code, "map", "publish", *arguments, "--bus", self.bus, "--mission", "next_day", "--credentials",
                           self.path / pki / "credentials" / f"{by}.cred")

    def start_robot(self):
        (self.path / "charlie/status.json").unlink(missing_ok=True)  # of the one before
        return self.start("robot", "--name", "charlie", "--bus", self.bus, "--credentials",
                          self.path / "pki/credentials/charlie.cred", "--state", self.path / "charlie", "--localise",
                          "--stay", *MISSION, "--rate", "5")

    def why(self):
        return self.status("charlie").get("localisation_why", "")

    def missing(self):
        """How many pieces were missing each time that fetching the map was begun."""
        return [int(found) for found in re.findall(r"(\d+) of \d+ pieces are missing", self.log())]

    def log(self):
        return (self.path / "charlie/log.txt").read_text()

    def maps(self):
        return sorted(file.name for file in (self.path / "charlie/maps").glob("*"))

    def test_a_map_is_fetched_by_a_robot_that_is_killed_and_another_is_changed_to(self):
        first = self.make_map()
        second = self.make_next(first)
        pieces = -(-first.stat().st_size // PIECE)
        self.assertGreater(pieces, 8)
        for folder in ("pki", "other"):
            self.expect(0, "pki", "init", "--mission", "next_day", "--pki", self.path / folder)
            self.expect(0, "pki", "add-operator", "anna", "--pki", self.path / folder)
        self.expect(0, "pki", "add-robot", "charlie", "--number", "2", "--pki", self.path / "pki")
        server = self.start("server", "--state", self.path / "server", "--pki", self.path / "pki", *MISSION, "--rate", "5")
        self.bus = server.bus()

        robot = self.start_robot()
        self.wait_for(lambda: "no map is published" in self.why(), "no map yet")
        self.assertEqual(self.status("charlie")["localisation"], "no map")

        self.assertIn("operators alone", self.publish(first, by="charlie", code=2))
        self.assertIn("is not of the credential's authority", self.publish(first, pki="other", code=1))
        self.assertIn("no map was published before", self.publish("--revert", code=1))
        (self.path / "text").write_text("x" * 5000)
        self.assertIn("not an SQLite", self.publish(self.path / "text", code=1))
        said = self.publish(first)
        self.assertIn(digest(first), said)
        self.assertIn("signed by operator anna", said)

        robot.kill()  # it looks every half minute
        robot = self.start_robot()
        part = self.path / "charlie/maps" / f"{digest(first)}.part"
        self.wait_for(lambda: part.exists() and part.stat().st_size > 3 * PIECE, "some of a map")
        robot.kill()
        there = part.stat().st_size // PIECE
        self.assertEqual(self.maps(), [part.name])
        robot = self.start_robot()
        self.wait_for(lambda: self.status("charlie").get("map_id"), "a map")
        self.assertEqual(self.missing(), [pieces, pieces - there])
        self.assertEqual(self.maps(), [f"{digest(first)}.head", f"{digest(first)}.tutti"])
        self.assertEqual(digest(self.path / "charlie/maps" / f"{digest(first)}.tutti"), digest(first))
        version = self.status("charlie")["map_version"]
        self.assertIn(f"localises in version {version} of map", self.log())

        self.publish(second)
        robot.kill()
        robot = self.start_robot()
        self.wait_for(lambda: self.status("charlie").get("map_version", version) != version, "the second map, once it stands")
        self.assertEqual(len(self.maps()), 4)

        self.assertIn(digest(first), self.publish("--revert"))
        robot.kill()
        robot = self.start_robot()
        self.wait_for(lambda: self.status("charlie").get("map_version") == version, "the first map again")
        code, said = robot.end()
        self.assertEqual(code, 0, said)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
