# SPDX-License-Identifier: BSD-3-Clause
"""The map of a server as an occupancy grid: run by tutti_ros_test.py."""
import os
import pathlib
import random
import shutil
import signal
import tempfile
import time
import unittest

import numpy as np
import ros_stub
from paths import SOURCE, TUTTI
from programs import HAS_NATS, PATIENCE_S, WithPrograms
from tutti_ros import server_map
from tutti_ros.map_node import MapNode
from tutti_ros.server_map import ServerMap, grid_of
from tutti_ros.diagnosis import ERROR, OK, WARN

YAML = """# up is z
image: grid.pgm
mode: trinary
resolution: 0.5
origin: [-1, 2.5, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PGM = b"P5\n3 2\n255\n\xcd\xfe\0\xfe\0\xcd"  # as src/tutti/grids/occupancy_grid_test.cpp has it


class Reading(unittest.TestCase):
    def test_what_tutti_writes(self):
        grid = grid_of(YAML, PGM)
        self.assertEqual((grid.resolution_m, grid.origin_m), (0.5, (-1.0, 2.5)))
        self.assertEqual(grid.cells.tolist(), [[0, 100, -1], [-1, 0, 100]])  # the image's last row is the least y
        self.assertEqual(grid, grid_of(YAML, PGM))
        self.assertNotEqual(grid, grid_of(YAML.replace("-1,", "-2,"), PGM))
        self.assertNotEqual(grid, grid_of("# component 2 of the map\n" + YAML, PGM))
        notes = "# T_level_world 0 0 0 0.6 0 -0 0.8 (x y z, quaternion x y z w) takes\n# ground at -2.000 m\n"
        at, turn = grid_of(notes + YAML, PGM).origin_in_world()  # a turn about x, of which y is 0.28 and z is 0.96
        self.assertTrue(np.allclose([*at, *turn], [-1.0, 0.28 * 2.5 - 0.96 * 2.0, -0.96 * 2.5 - 0.28 * 2.0, -0.6, 0.0, 0.0, 0.8]))
        self.assertEqual(grid_of("# component 2 of the map\n" + YAML, PGM).component, 2)
        self.assertNotEqual(grid, grid_of(YAML, PGM.replace(b"\xcd\xfe", b"\xfe\xfe")))

    def test_thresholds_as_nav2s_map_server_reads_them(self):
        shades = bytes([0, 88, 89, 90, 205, 206, 254, 255])
        pgm = b"P5\n# by somebody\n8 1\n255\n" + shades
        self.assertEqual(grid_of(YAML, pgm).cells.tolist(), [[100, 100, 100, -1, -1, 0, 0, 0]])
        self.assertEqual(grid_of(YAML.replace("0.196", "0.25"), pgm).cells.tolist()[0][4], 0)  # why Tutti writes 0.196
        self.assertEqual(grid_of(YAML.replace("negate: 0", "negate: 1"), pgm).cells.tolist(),
                         [[0, -1, -1, -1, 100, 100, 100, 100]])

    def test_what_is_no_map_is_said(self):
        for yaml, pgm, text in ((YAML.replace("mode: trinary", "mode: scale"), PGM, "mode 'scale'"), ("", PGM, "without image"),
                                (YAML.replace("0.5", "nan"), PGM, "expected a positive one"), (YAML, PGM[:-1], "of 5 bytes"),
                                (YAML.replace(", 0]", ", 0.1]"), PGM, r"expected a positive one, \[x, y, 0\]"),
                                (YAML.replace("[-1, 2.5, 0]", "here"), PGM, "could not convert"), (YAML, b"", "does not end"),
                                (YAML, b"P2\n3 2\n255\n1", "expected P5"), (YAML, b"P5\n3 -2\n255\n", "expected P5"),
                                (YAML, b"P5\n99999999 99999999\n255\n", "expected P5")):
            with self.assertRaisesRegex(ValueError, text):
                grid_of(yaml, pgm)
        draw = random.Random(1)
        for _ in range(300):
            pgm = bytearray(PGM)
            pgm[draw.randrange(len(pgm))] = draw.randrange(256)
            try:
                grid_of(YAML, bytes(pgm[:draw.randrange(len(pgm) + 1)]))
            except ValueError:
                pass


class Exporting(unittest.TestCase):
    """Against a program that plays `tutti map export`: what is checked when, and what is reported."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.map, self.program, self.pgm = self.path / "state/map.tutti", self.path / "tutti", PGM
        self.runs = 0
        self.play("")
        self.source = ServerMap(self.map, 5.0, self.program)
        self.addCleanup(self.source.close)

    def play(self, script):
        """Has the program do as the script says."""
        (self.path / "made.yaml").write_text(YAML)
        (self.path / "made.pgm").write_bytes(self.pgm)
        self.program.write_text(f'#!/bin/sh\necho "$@" >>{self.path}/runs\n{script}\n'
                                f'cp {self.path}/made.yaml "$6"; cp {self.path}/made.pgm "${{6%.yaml}}.pgm"\n')
        self.program.chmod(0o755)

    def store(self, text):
        self.map.parent.mkdir(exist_ok=True)
        self.map.write_text(text)

    def look(self, now_s):
        """Until the program that it starts, if it does, has ended."""
        grid = self.source.look(now_s)
        if self.source.running:
            self.source.running.wait()
            grid = self.source.look(now_s)
        self.runs = len((self.path / "runs").read_text().splitlines()) if (self.path / "runs").exists() else 0
        return grid

    def test_a_map_comes_whenever_it_is_another(self):
        self.assertIsNone(self.look(0.0))
        self.assertEqual((self.runs, self.source.diagnosis(0.0)[0]), (0, ERROR))
        self.assertIn("is not there yet", self.source.diagnosis(0.0)[1])
        self.store("one")
        self.assertEqual(self.look(1.0).cells.shape, (2, 3))
        self.assertEqual(self.source.diagnosis(1.0)[:2], (OK, "the map is shown"))
        self.assertEqual((self.path / "runs").read_text().split()[:5], ["map", "export", str(self.map), "--live", "--grid"])
        self.assertIsNone(self.look(20.0))
        self.assertEqual(self.runs, 1)  # nothing was stored
        self.store("one and two")
        self.assertIsNone(self.look(21.0))  # is the same
        self.assertEqual(self.runs, 2)
        self.pgm = PGM.replace(b"\xcd", b"\xfe")
        self.play("")
        (self.map.parent / "map.tutti-wal").write_text("three")
        self.assertIsNone(self.look(25.9))
        self.assertEqual(self.runs, 2)  # not yet
        self.assertIsNotNone(self.look(26.0))
        shutil.rmtree(self.map.parent)
        self.look(40.0)
        self.assertEqual(self.source.diagnosis(40.0)[0], WARN)
        self.assertIn("the map is an older one", self.source.diagnosis(40.0)[1])

    def test_what_fails_is_tried_again_and_said(self):
        self.play("echo 'error: no submap has a cloud' >&2; exit 1")
        self.store("empty")
        runs = []
        for now_s in range(200):
            self.assertIsNone(self.look(float(now_s)))
            runs += [now_s] * (self.runs - len(runs))
        self.assertEqual(runs, [0, 5, 15, 35, 75, 135, 195])
        self.assertEqual(self.source.diagnosis(200.0)[:2], (ERROR, "error: no submap has a cloud"))
        self.play("")
        self.assertIsNotNone(self.look(300.0))
        self.assertEqual(self.source.diagnosis(300.0)[0], OK)
        self.store("more")
        self.play("cp /dev/null \"$6\"; exit 0")
        self.look(400.0)
        self.assertIn("what tutti map export wrote: a map's yaml without image", self.source.diagnosis(400.0)[1])

    def test_long_work_is_followed_by_rest(self):
        self.play("sleep 100")
        self.store("large")
        self.assertIsNone(self.source.look(0.0))
        self.assertIsNone(self.source.look(10.0))
        self.assertIn("10", self.source.diagnosis(10.0)[2]["being_made_for_s"])
        self.assertEqual(os.getpriority(os.PRIO_PROCESS, self.source.running.pid), server_map.NICENESS)
        self.source.running.kill()
        self.source.running.wait()
        self.source.look(10.0)
        self.assertEqual(self.source.not_before_s, 100.0)

    def test_a_program_that_is_not_there(self):
        self.program.unlink()
        self.store("one")
        self.look(0.0)
        self.assertIn("No such file", self.source.diagnosis(0.0)[1])


class OfAServer(WithPrograms):
    @unittest.skipUnless(HAS_NATS, "nats-server is not installed")
    def test_a_running_server_that_is_killed_once(self):
        """A robot's node feeds its scans; beside the server the other node shows the map, which is that of the file."""
        self.run_tutti("simulate", SOURCE / "missions/demo.yaml", "-o", self.path, "--set",
                       "simulation.robots.0.walk.duration_s=40", "--set", "simulation.robots.1.walk.duration_s=1")
        self.addCleanup(setattr, server_map, "REST_PER_WORK", server_map.REST_PER_WORK)
        server_map.REST_PER_WORK = 0.0
        map_file = self.path / "server/map.tutti"
        shown = self.node("none", MapNode, map=str(map_file), program=TUTTI, period_s=0.5)
        grids = shown.made["map"].said

        def looked():
            shown.callbacks["look"]()
            return len(grids)

        def status():
            shown.callbacks["publish_diagnostics"]()
            return shown.made["/diagnostics"].said[-1].status[0]

        looked()
        self.assertEqual(status().level, b"\2")
        self.assertIn("is not there yet", status().message)
        server, bus = self.start_server("--rate", "20")
        self.wait_for(lambda: looked() == 0 and shown.source.failures > 0, "an attempt at a map without submaps")
        self.assertEqual(status().level, b"\2")
        robot = self.start("robot", "--name", "alpha", "--bus", bus, "--state", self.path / "of_alpha", "--feed",
                           self.path / "alpha.feed", "--rate", "20")
        node = self.node("alpha", T_body_lidar="0 0 0.5 0 0 0 1", use_fixes=False)
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        for topic, message in self.recorded("alpha", ("odom", "points")):
            node.callbacks[topic](message)
            time.sleep(0.001)
            looked()
        node.callbacks["~/end_recording"](None, ros_stub.types.SimpleNamespace())
        self.wait_for(lambda: looked() > 0, "a map")
        self.wait_for(lambda: looked() and robot.poll() is not None, "the robot's end")
        self.assertEqual(robot.returncode, 0)
        self.assertEqual(status().level, b"\0", status().message)

        server.kill()  # its log stays beside the map
        server.wait()
        self.assertTrue(pathlib.Path(f"{map_file}-wal").exists())
        server, _ = self.start_server("--rate", "20")
        server.send_signal(signal.SIGTERM)
        self.assertEqual(server.wait(PATIENCE_S), 0)
        source = shown.source
        self.wait_for(lambda: looked() and not source.running and source.signature == source.signature_now(),
                      "the map of what was stored last")
        self.run_tutti("map", "export", map_file, "--grid", self.path / "out.yaml")
        expected = grid_of((self.path / "out.yaml").read_text(), (self.path / "out.pgm").read_bytes())
        last = grids[-1]
        self.assertEqual((last.header.frame_id, last.info.width), ("world", expected.cells.shape[1]))
        self.assertAlmostEqual(last.info.resolution, 0.1)
        self.assertEqual((last.info.origin.position.x, last.info.origin.position.y), expected.origin_in_world()[0][:2])
        self.assertEqual(list(last.data), expected.cells.ravel().tolist())
        for cell in (server_map.FREE, server_map.OCCUPIED, server_map.UNKNOWN):
            self.assertGreater(np.count_nonzero(expected.cells == cell), 50)
        self.assertEqual(shown.qos["map"]["durability"], "transient local")
        left = {path.name for path in pathlib.Path(shown.source.folder.name).iterdir()}
        self.assertEqual(left, {"map.yaml", "map.pgm", "said"})  # and no copy
        cdr = ros_stub.encode("nav_msgs/OccupancyGrid", last)
        self.assertEqual(ros_stub.encode("nav_msgs/OccupancyGrid", ros_stub.decode("nav_msgs/OccupancyGrid", cdr)), cdr)
