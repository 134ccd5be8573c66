#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A robot that localises in yesterday's map of a hall, in which boxes were put up meanwhile, and what its server says of it;
skips without nats-server.

usage: places_test.py TUTTI_PROGRAM SOURCE_DIR [Places.TEST...]
"""
import re
import sys
import unittest

import programs_test as common

MISSION = [common.SOURCE / "missions/hall_next.yaml", "--set", "duration_s=150"]
TODAY = [*MISSION, "--set", "hall.boxes=44", "--set", "hall.robots.2.start_s=0"]
RATE = ["--rate", "4"]


@unittest.skipUnless(common.HAS_NATS, "nats-server is not installed")
class Places(common.ProgramsTest):
    def start_server(self, *more):
        server = self.start("server", "--state", self.path / "server", *TODAY, *RATE, *more)
        return server, server.bus()

    def said(self, bus, *more):
        done = common.run("status", "--bus", bus, *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def changed(self, bus):
        """The map's submaps of which a robot has said that something is gone or new."""
        places = common.json.loads(self.said(bus, "--json"))["places"]
        return {place["name"]: place for place in places if place["missing"] + place["appeared"] > 0}

    def test_where_a_map_fits_no_more_is_said_by_the_server_of_its_robots_also_after_a_kill(self):
        file = self.path / "hall.tutti"
        done = common.run("run", *MISSION, "--map", file, "--out", self.path / "run")
        self.assertEqual(done.returncode, 0, done.stderr)
        server, bus = self.start_server("--map", file, "--frozen")
        robot = self.start("robot", "--name", "delta", "--bus", bus, "--state", self.path / "delta", "--map", file,
                           "--localise", "--session", "0", *TODAY, *RATE)
        code, said = robot.end(stop=False)
        self.assertEqual(code, 0, said)
        # Its last word, which the server stores at once; what it said in the minute before, a kill may lose.
        self.wait_for(lambda: re.search(r"(?m)^delta .*finished", self.said(bus)), "that the robot has finished")

        changed = self.changed(bus)
        self.assertGreater(sum(place["appeared"] for place in changed.values()), 20)
        self.assertEqual(sum(place["missing"] for place in changed.values()), 0)
        for name, place in changed.items():
            self.assertRegex(name, r"^(alpha|bravo)/\d+$")
            self.assertEqual(place["robots"], [2])
            self.assertTrue(0.3 < place["trust"] < 1.0, place)
        text = self.said(bus)
        self.assertRegex(text, r"map \w{16}, version \d+: \d+ of its submaps were seen, .* something has changed in\n")
        self.assertRegex(text, r"(?m)^alpha/\d+ +0 +\d+ +\d+\.\d % .* ago +delta$")

        local = self.status("delta")  # what the robot itself says
        self.assertTrue({place["submap"] for place in local["changed_places"]} & changed.keys(), local)
        self.assertIn("something has changed in", local["line"])

        server.kill()
        server, bus = self.start_server()
        self.wait_for(lambda: self.changed(bus).keys() == changed.keys(), "the same of the server that was started again")
        self.assertEqual(server.end()[0], 0)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
