#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a person meets at the command line: exit codes and messages. Usage: cli_test.py TUTTI_PROGRAM SOURCE_DIR"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

TUTTI, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
SMALL = [  # two minutes with LiDAR in a small tunnel
    "--set", "simulation.robots=[{walk: {duration_s: 120}}, {walk: {duration_s: 120}}]",
    "--set", "simulation.world.network={rows: 2, columns: 3, block_m: 15, jitter_m: 2}",
]


def tutti(*arguments, cwd=None):
    return subprocess.run([TUTTI, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=300)


class CommandLine(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        self.addCleanup(self.folder.cleanup)

    def expect(self, result, code, *words):
        text = result.stdout + result.stderr
        self.assertEqual(result.returncode, code, text)
        for word in words:
            self.assertIn(word, text)

    def mission(self, text):
        file = self.path / "mission.yaml"
        file.write_text(text)
        return file

    def test_help_of_every_command(self):
        self.expect(tutti("--help"), 0, "run", "demo", "eval", "optimise")
        for command in ("run", "demo", "eval", "optimise", "world"):
            self.expect(tutti(command, "--help"), 0, "--help")

    def test_usage_errors_exit_2(self):
        self.expect(tutti(), 2)
        self.expect(tutti("dance"), 2)
        self.expect(tutti("run"), 2, "mission")
        self.expect(tutti("demo", "--rate", "-1"), 2, "rate")
        self.expect(tutti("eval", "one"), 2)

    def test_configuration_errors_exit_2_and_name_the_place(self):
        self.expect(tutti("run", self.path / "none.yaml"), 2, "none.yaml")
        self.expect(tutti("run", self.mission("mission: x\nagent: {subamp: {}}\n")), 2, "mission.yaml:2", "subamp",
                    "submap")
        self.expect(tutti("run", self.mission("agent:\n  submap: {voxel_m: -1}\n")), 2, "agent.submap.voxel_m", "-1",
                    "[0.1, 10]")
        self.expect(tutti("run", self.mission("mission: [unclosed\n")), 2, "mission.yaml")
        self.expect(tutti("run", self.mission("mission: x\n")), 2, "robots")
        self.expect(tutti("demo", "--set", "agent.policy.name=magic"), 2, "magic", "spectral")
        self.expect(tutti("demo", "--set", "nonsense"), 2, "nonsense")

    def test_bad_data_exits_1_and_names_file_and_line(self):
        mission = self.mission(
            "robots: [{name: a, odometry: {file: a.tum}, reference: {file: a.tum}}]\nclosures: {finder: reference}\n")
        run = lambda: tutti("run", mission, "--data", self.path, "--out", self.path / "out")
        self.expect(run(), 1, "robot a", "a.tum")
        bad_lines = {
            "columns": "1.0 0 0 0 0 0 0 1\n2.0 1 2 3\n",
            "quaternion": "1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 2\n",
            "stamp": "2.0 0 0 0 0 0 0 1\n1.0 1 0 0 0 0 0 1\n",
            "nan": "1.0 0 0 0 0 0 0 1\n2.0 nan 0 0 0 0 0 1\n",
        }
        for word, text in bad_lines.items():
            (self.path / "a.tum").write_text(text)
            result = run()
            self.expect(result, 1, "a.tum:2")
            self.assertIn(word, (result.stdout + result.stderr).lower())
        (self.path / "a.tum").write_text("1.0 0 0 0 0 0 0 1\n")
        self.expect(run(), 1, "at least 2")

    def test_demo_writes_the_whole_report(self):
        out = self.path / "demo"
        self.expect(tutti("demo", *SMALL, "--out", out, "--seed", 7), 0, "report.html", "alpha", "bravo")
        report = json.loads((out / "report.json").read_text())
        self.assertEqual(report["seed"], 7)
        self.assertEqual({robot["name"] for robot in report["robots"]}, {"alpha", "bravo"})
        for name in ("report.html", "timing.json", "graph.g2o", "config.yaml", "alpha_corrected.tum", "map.ply",
                     "survey.ply"):
            self.assertTrue((out / name).stat().st_size > 0, name)
        # The other commands read what it wrote.
        self.expect(tutti("eval", out / "alpha_corrected.tum", out / "alpha_reference.tum"), 0, "rmse")
        self.expect(tutti("optimise", out / "graph.g2o", "-o", self.path / "again.g2o"), 0, "chi2")
        map_error = json.loads(tutti("eval", "--map", out / "map.ply", out / "survey.ply", "--report",
                                     out / "report.json", "--json").stdout)
        for figure in ("mean_m", "p95_m", "within_10cm"):
            self.assertAlmostEqual(map_error["map_to_survey"][figure], report["server"]["map_error"][figure], delta=1e-5)
        # The effective configuration is a mission file that runs again with the same result.
        self.expect(tutti("run", out / "config.yaml", "--out", self.path / "again", "--seed", 7), 0)
        self.assertEqual((out / "report.json").read_text(), (self.path / "again" / "report.json").read_text())

    def test_world_writes_the_walls_of_a_simulated_mission(self):
        mission = self.mission("source: simulation\nclosures: {finder: reference}\n")
        self.expect(tutti("world", mission, "-o", self.path / "walls.ply"), 0, "triangles")
        header = (self.path / "walls.ply").read_bytes()[:400]
        self.assertIn(b"element face", header)
        self.expect(tutti("world", mission, "--points", 1, "-o", self.path / "points.ply"), 0)
        self.assertNotIn(b"element face", (self.path / "points.ply").read_bytes()[:400])
        replayed = self.mission("robots: [{name: a, odometry: {file: a}, scans: s}]\n")
        self.expect(tutti("world", replayed, "-o", self.path / "x.ply"), 2, "recordings", "simulation")
        self.expect(tutti("world", mission), 2, "--output")

    def test_eval_and_optimise_say_what_is_wrong(self):
        (self.path / "empty.tum").write_text("")
        (self.path / "bad.g2o").write_text("VERTEX_SE3:QUAT 0 1 2\n")
        self.expect(tutti("eval", self.path / "empty.tum", self.path / "none.tum"), 1)
        self.expect(tutti("optimise", self.path / "bad.g2o", "-o", self.path / "x.g2o"), 1, "bad.g2o:1")

    def write_ply(self, name, points):
        header = "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        (self.path / name).write_text(header % len(points) + "".join("%.4f %.4f %.4f\n" % p for p in points))
        return self.path / name

    def room(self, shift=0.0):
        """Floor and three walls of a room, a point every 0.2 m."""
        steps = [0.2 * i for i in range(31)]
        points = [(x, y, 0.0) for x in steps for y in steps]
        for u in steps:
            for z in steps[1:12]:
                points += [(0.0, u, z), (u, 0.0, z), (6.0, u, z)]
        return [(x + shift, y, z) for x, y, z in points]

    def test_eval_map_measures_and_refines(self):
        survey = self.write_ply("survey.ply", self.room())
        shifted = self.write_ply("map.ply", self.room(shift=0.3))
        measure = lambda *more: json.loads(tutti("eval", "--map", shifted, survey, "--json", *more).stdout)
        raw = measure()
        self.assertEqual(raw["map"]["points"], len(self.room()))
        self.assertGreater(raw["map_to_survey"]["mean_m"], 0.05)
        back = measure("--transform", "-0.3 0 0 0 0 0 1")
        self.assertLess(back["map_to_survey"]["p95_m"], 1e-3)
        self.assertEqual(back["map_to_survey"]["within_10cm"], 1.0)
        refined = measure("--refine")
        self.assertAlmostEqual(refined["refinement"]["moved_m"], 0.3, delta=0.02)
        self.assertAlmostEqual(refined["T_survey_map"]["translation_m"][0], -0.3, delta=0.02)
        self.assertLess(refined["map_to_survey"]["mean_m"], 0.5 * raw["map_to_survey"]["mean_m"])
        report = self.path / "report.json"
        pose = {"translation_m": [-0.3, 0, 0], "quaternion_xyzw": [0, 0, 0, 1]}
        report.write_text(json.dumps({"server": {"T_reference_world": pose}}))
        self.assertEqual(measure("--report", report), back)
        self.expect(tutti("eval", "--map", shifted, survey, "--refine"), 0, "95 %", "moved its centre by 0.3")

    def test_eval_map_says_what_is_wrong(self):
        survey = self.write_ply("survey.ply", self.room())
        empty = self.write_ply("empty.ply", [])
        self.expect(tutti("eval", "--map", survey, self.path / "none.ply"), 1, "none.ply")
        self.expect(tutti("eval", "--map", empty, survey), 1, "empty.ply", "no point")
        (self.path / "bad.ply").write_text("ply\nformat ascii 1.0\nelement vertex 1\n")
        self.expect(tutti("eval", "--map", self.path / "bad.ply", survey), 1, "bad.ply")
        for transform in ("1 2 3", "0 0 0 0 0 0 2", "0 0 0 0 0 nan 1", "0 0 0 0 0 0 1 8"):
            self.expect(tutti("eval", "--map", survey, survey, "--transform", transform), 2, "--transform")
        self.expect(tutti("eval", survey, survey, "--refine"), 2, "--map")
        self.expect(tutti("eval", "--map", survey, survey, "--voxel", "0"), 2, "--voxel")
        far = self.write_ply("far.ply", self.room(shift=500.0))
        self.expect(tutti("eval", "--map", far, survey, "--refine"), 1, "does not settle")
        report = self.path / "report.json"
        for text, word in (("{", "report.json"), ("{}", "T_reference_world"),
                           ('{"server": {"T_reference_world": null}}', "null"),
                           ('{"server": {"T_reference_world": {"translation_m": [1, 2]}}}', "3 numbers")):
            report.write_text(text)
            self.expect(tutti("eval", "--map", survey, survey, "--report", report), 1, word)

    def test_missions_of_the_repository_are_valid(self):
        for mission in sorted((SOURCE / "missions").glob("*.yaml")):
            self.expect(tutti("run", mission, "--print-config"), 0, "mission: " + mission.stem)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
