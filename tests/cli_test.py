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
SMALL = [
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
        for command in ("run", "demo", "eval", "optimise"):
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
        for name in ("report.html", "timing.json", "graph.g2o", "config.yaml", "alpha_corrected.tum"):
            self.assertTrue((out / name).stat().st_size > 0, name)
        # The other commands read what it wrote.
        self.expect(tutti("eval", out / "alpha_corrected.tum", out / "alpha_reference.tum"), 0, "rmse")
        self.expect(tutti("optimise", out / "graph.g2o", "-o", self.path / "again.g2o"), 0, "chi2")
        # The effective configuration is a mission file that runs again with the same result.
        self.expect(tutti("run", out / "config.yaml", "--out", self.path / "again", "--seed", 7), 0)
        self.assertEqual((out / "report.json").read_text(), (self.path / "again" / "report.json").read_text())

    def test_eval_and_optimise_say_what_is_wrong(self):
        (self.path / "empty.tum").write_text("")
        (self.path / "bad.g2o").write_text("VERTEX_SE3:QUAT 0 1 2\n")
        self.expect(tutti("eval", self.path / "empty.tum", self.path / "none.tum"), 1)
        self.expect(tutti("optimise", self.path / "bad.g2o", "-o", self.path / "x.g2o"), 1, "bad.g2o:1")

    def test_missions_of_the_repository_are_valid(self):
        for mission in sorted((SOURCE / "missions").glob("*.yaml")):
            self.expect(tutti("run", mission, "--print-config"), 0, "mission: " + mission.stem)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
