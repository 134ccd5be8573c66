#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The command line as a person meets it: exit codes and messages. Usage: cli_test.py TUTTI_PROGRAM SOURCE_DIR [CommandLine.TEST...]"""
import contextlib
import json
import math
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

TUTTI, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
SMALL = [  # two minutes with LiDAR in a small tunnel
    "--set", "simulation.robots=[{walk: {duration_s: 120}}, {walk: {duration_s: 120}}]",
    "--set", "simulation.world.network={rows: 2, columns: 3, block_m: 15, jitter_m: 2}",
]

BRIEF = [  # half a minute of trajectories only
    "--set", "simulation.robots=[{walk: {duration_s: 30}}, {walk: {duration_s: 30}}]",
    "--set", "simulation.sensors=none", "--set", "closures.verifier=reference",
]


def tutti(*arguments, cwd=None):
    return subprocess.run([TUTTI, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=300)


def wait_until_it_listens(program):
    """to SIGTERM"""
    status = pathlib.Path(f"/proc/{program.pid}/status")
    while not int(status.read_text().split("SigCgt:")[1].split()[0], 16) >> (signal.SIGTERM - 1) & 1:
        time.sleep(0.001)


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
        self.expect(tutti("--help"), 0, "run", "demo", "eval", "optimise", "compare")
        for command in ("run", "demo", "eval", "optimise", "world", "simulate", "export", "compare", "settings", "status", "map", "server", "robot", "worker", "pki"):
            self.expect(tutti(command, "--help"), 0, "--help")
        self.expect(tutti("mission", "up", "--help"), 0, "--workers")
        for command in ("list", "info", "export", "merge", "log", "diff", "revert", "closure"):
            self.expect(tutti("map", command, "--help"), 0, "--help")
        for command in ("list", "show", "accept", "reject", "withdraw"):
            self.expect(tutti("map", "closure", command, "--help"), 0, "--help")

        self.expect(tutti("bag", "info", "--help"), 0, "BAG")

    def test_what_people_type_before_they_know_the_commands(self):
        self.assertEqual(tutti("version").stdout, tutti("--version").stdout)
        self.assertEqual(tutti("help").stdout, tutti("--help").stdout)
        self.assertEqual(tutti("help", "map", "export").stdout, tutti("map", "export", "--help").stdout)
        self.expect(tutti("expotr", "out"), 2, "'expotr' is no command of tutti; did you mean 'tutti export'?")
        self.expect(tutti("map", "closure", "lits", "x"), 2, "'lits' is no command of tutti map closure; did you mean 'tutti map closure list'?")
        self.expect(tutti("dance"), 2, "'dance' is no command of tutti, expected one of demo, run, ", " map, ")
        self.expect(tutti("dance", "--help"), 2, "'dance' is no command of tutti")
        self.expect(tutti("help", "map", "exprot"), 2, "did you mean 'tutti map export'?")

    def test_an_option_takes_one_value_and_leaves_the_arguments_alone(self):
        mission = self.mission("source: simulation\nclosures: {verifier: reference}\nsimulation: {robots: [{name: alpha, walk: {duration_s: 5}}]}\n")
        some = ("--set", "agent.submap.duration_s=7", "--set", "simulation.sensors=none")
        self.expect(tutti("run", "--print-config", *some, mission), 0, "duration_s: 7", "sensors: none")
        self.expect(tutti("world", *some, mission, "-o", self.path / "walls.ply"), 0, "triangles")
        self.expect(tutti("simulate", *some, mission, "-o", self.path / "bags"), 0, "messages")
        self.expect(tutti("mission", "up", "--out", self.path / "up", "--set", "closures.verifier=magic", mission), 2, "magic", "lidar")

    def test_the_demo_is_a_mission_of_every_command(self):
        for program, settings in (("server", "judge"), ("robot", "agent:"), ("worker", "refinement:")):
            self.expect(tutti(program, "--print-config", "--set", "closures.verifier=visual"), 0, settings)
        self.expect(tutti("server", "--print-config", "--set", "closures.verifier=visual"), 0, "verifier: visual")
        self.expect(tutti("run", "demo", "--print-config", cwd=self.path), 0, "mission: demo\n")
        self.assertEqual(tutti("run", "demo", "--print-config").stdout, tutti("demo", "--print-config").stdout)
        self.expect(tutti("world", "demo", "-o", self.path / "walls.ply"), 0, "world of demo")
        (self.path / "demo").write_text("mission: mine\n")
        self.expect(tutti("run", "demo", cwd=self.path), 2, "demo", "robots: none")  # the file of this name

    def test_bag_info_says_what_is_there_and_what_is_missing(self):
        def counted(data, size=4):
            return len(data).to_bytes(size, "little") + data

        def record(opcode, content):
            return bytes([opcode]) + counted(content, 8)

        one, time = (1).to_bytes(2, "little"), (1_700_000_000_250_000_000).to_bytes(8, "little")
        bag = self.path / "cut.mcap"
        bag.write_bytes(b"\x89MCAP0\r\n" + record(3, one + counted(b"std_msgs/msg/String") + counted(b"ros2msg") + counted(b""))
                        + record(4, one + one + counted(b"/talk\x1b[2J") + counted(b"cdr") + counted(b""))
                        + record(5, one + bytes(4) + time + time + b"hello") + b"\x05cut")
        self.expect(tutti("bag", "info", bag), 0, "/talk?[2J", "std_msgs/msg/String", "2023-11-14 22:13:20.250",
                    "odometry     missing", "scans        none", "cut off", "\nnot ready: ", "no odometry: expected a topic of")
        self.expect(tutti("bag", "info", self.path), 0, "no metadata.yaml", "cut off")
        self.expect(tutti("bag", "info", self.path / "none.mcap"), 1, "none.mcap: cannot be opened")
        other = self.path / "other.mcap"
        other.write_bytes(b"SQLite format 3")
        self.expect(tutti("bag", "info", other), 1, "other.mcap", "not a database")

    def test_a_file_of_another_kind_is_named_with_the_way_on(self):
        def named(name, content, *words, commands=("bag info", "run", "eval", "compare", "optimise")):
            file = self.path / name
            file.write_bytes(content)
            for command in commands:
                more = {"eval": [file], "compare": [file], "optimise": ["-o", self.path / "out.g2o"]}.get(command, [])
                self.expect(tutti(*command.split(), file, *more), 1, name + ": is ", *words)

        named("velodyne.pcap", b"\xd4\xc3\xb2\xa1" + bytes(60), "network packets", "through the LiDAR's driver")
        named("log.ulg", b"ULog\x01\x12\x35" + bytes(60), "PX4 (ULog)", "ulog2csv")
        named("data.h5", b"\x89HDF\r\n\x1a\n" + bytes(60), "HDF5", "stamp x y z")
        named("one.png", b"\x89PNG\r\n\x1a\n" + bytes(60), "a single image", "docs/data.md")
        named("a.mcap.gz", b"\x1f\x8b\x08" + bytes(60), "packed with gzip", "gunzip -k ")
        named("map.pbstream", b"\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b" + bytes(60), "Cartographer (.pbstream)")
        named("lfs.mcap", b"version https://git-lfs.github.com/spec/v1\noid sha256:ab\n", "Git LFS", "git lfs pull")
        named("bag.mcap", b"\x89MCAP0\r\n" + bytes(60), "a recording", "tutti bag info ", commands=("eval", "compare", "optimise"))
        named("fleet.g2o", b"VERTEX_SE2 0 0 0 0\n", "a pose graph", "tutti run --graph ", commands=("bag info", "run"))
        named("a.tum", b"1 0 0 0 0 0 0 1\n", "text", "mission file", commands=("bag info", "run"))
        with contextlib.closing(sqlite3.connect(self.path / "rtabmap.db")) as database:
            database.execute("CREATE TABLE Node (id INTEGER NOT NULL)")
        database = (self.path / "rtabmap.db").read_bytes()
        named("rtabmap.db", database, "RTAB-Map", "rtabmap-export --poses --poses_format 11 ", commands=("eval", "compare"))
        named("rtabmap.db", database, "RTAB-Map", "rtabmap-export --poses --poses_format 4 ", commands=("optimise",))
        named("rtabmap.db", database, "RTAB-Map", "give the bag", commands=("bag info", "run"))

    def test_a_folder_that_is_no_bag_is_named_with_the_way_on(self):
        (self.path / "MH_01/mav0/cam0").mkdir(parents=True)
        (self.path / "MH_01/mav0/cam0/data.csv").write_text("#timestamp [ns],filename\n")
        (self.path / "00/velodyne").mkdir(parents=True)
        for command, code in ((("run",), 2), (("bag", "info"), 1)):
            self.expect(tutti(*command, self.path / "MH_01"), code, "EuRoC's", "images: {euroc_folder: ", "verifier: visual")
            self.expect(tutti(*command, self.path / "00"), code, "KITTI's", "/velodyne}", "verifier: lidar")

    def test_status_without_a_bus(self):
        here = tutti("status", "--wait", "0.3")  # other tests may run buses on this machine
        self.assertIn("--bus", here.stdout + here.stderr)
        self.expect(tutti("status", "--bus", "nats://192.0.2.1:4222"), 2, "another machine", "TLS")
        self.expect(tutti("status", "--bus", "nats://127.0.0.1:1", "--wait", "0.3"), 1, "no link to a bus at nats://127.0.0.1:1")
        self.expect(tutti("status", "--bus", "nats://127.0.0.1.example.invalid:1"), 2, "another machine", "TLS")
        self.expect(tutti("status", "--bus", "nats://127.0.0.1:one"), 2, "expected nats://HOST:PORT")
        self.expect(tutti("status", "--bus", "nats://127.0.0.1:1", "--credentials", self.path / "none"), 2, "none")

    def test_pki_says_who_may_use_a_bus(self):
        pki = self.path / "pki"

        def run(*words):
            return tutti("pki", *words, "--pki", pki)

        self.expect(run("list"), 1, "users", "tutti pki init")
        self.expect(run("init", "--mission", "cave", "--name", "base/local"), 2, "'base/local'", "10.0.0.1")
        self.expect(run("init", "--mission", "cave", "--name", "base.local", "--name", "10.0.0.1"), 0, "mission cave")
        self.expect(run("list"), 0, "for bus.tutti, base.local, 10.0.0.1")
        self.expect(run("init", "--mission", "cave"), 2, "already")
        alpha = pathlib.Path(run("add-robot", "alpha").stdout.strip())
        self.assertEqual(alpha.stat().st_mode & 0o777, 0o600)
        self.assertIn("BEGIN USER NKEY SEED", alpha.read_text())
        self.expect(run("add-robot", "bravo", "--number", "3"), 0, "bravo.cred")
        self.expect(run("add-robot", "carla", "--number", "3"), 2, "bravo")
        for role in ("worker", "operator", "viewer"):
            self.expect(run(f"add-{role}", f"a-{role}"), 0, f"a-{role}.cred")
        self.expect(run("renew", "--name", "cellar.local"), 0)
        self.expect(run("renew"), 0)
        self.expect(run("list"), 0, "for bus.tutti, base.local, 10.0.0.1, cellar.local")
        self.expect(run("renew", "alpha", "--days", "5"), 0, "alpha.cred")
        self.expect(run("revoke", "alpha"), 0)
        self.expect(run("revoke", "nobody"), 2, "nobody")
        lines = run("list").stdout.splitlines()
        self.assertEqual([line.split()[:2] + line.split()[3:4] for line in lines[2:]],
                         [["server", "server", "valid"], ["robot", "alpha", "revoked"], ["robot", "bravo", "valid"],
                          ["worker", "a-worker", "valid"], ["operator", "a-operator", "valid"], ["viewer", "a-viewer", "valid"]])
        self.expect(tutti("status", "--bus", "tls://127.0.0.1:1", "--credentials", pki / "credentials/bravo.cred"), 2,
                    "robot bravo (number 3)", "viewer")
        viewer = pki / "credentials/a-viewer.cred"
        wish = ["map", "closure", "reject", "a/1-b/2", "--bus", "tls://127.0.0.1:1", "--credentials", viewer]
        begun = time.monotonic()
        done = tutti(*wish)
        self.assertLess(time.monotonic() - begun, 20, "without a bus: it is not asked")
        self.expect(done, 2, "viewer a-viewer", "operators alone decide", "tutti pki add-operator")
        self.assertNotIn("chmod", done.stderr)
        viewer.chmod(0o644)
        self.expect(tutti(*wish), 2, "0644", f"chmod 600 {viewer}")
        self.expect(tutti("server", "--state", self.path / "s", "--listen", "0.0.0.0", "--mission", "cave"), 2, "--pki")
        self.expect(tutti("server", "--state", self.path / "s", "--pki", pki, "--mission", "tunnel"), 2, "'cave'", "'tunnel'")

    def test_passwords_are_not_printed(self):
        done = tutti("status", "--bus", "nats://alpha:hidden@127.0.0.1:1", "--wait", "0.3")
        self.expect(done, 1, "no link to a bus at nats://127.0.0.1:1")
        self.assertNotIn("hidden", done.stdout + done.stderr)

    def test_a_word_says_what_it_waits_for(self):
        self.expect(tutti("map", "closure", "reject", "a/1-b/2", "--bus", "nats://127.0.0.1:1", "--mission", "alps",
                          "--wait", "2"), 1, "waits for a link to the bus nats://127.0.0.1:1", "at most 2 s")

    def test_usage_errors_exit_2(self):
        self.expect(tutti(), 2)
        self.expect(tutti("dance"), 2)
        self.expect(tutti("run"), 2, "MISSION.yaml, BAG.., --bag NAME=BAG or --graph FLEET.pyfg")
        self.expect(tutti("run", "mine.yaml", "--bag", "alpha=bag"), 2, "excludes")
        self.expect(tutti("run", "--bag", "alpha"), 2, "'alpha': expected --bag NAME=BAG")
        self.expect(tutti("run", "--bag", "alpha=none", "--topic", "alpha.scan=/a"), 2, "alpha.scan=/a", "NAME.scans=")
        self.expect(tutti("run", "--bag", "alpha=none.mcap", "--out", self.path / "out"), 1, "none.mcap")
        for rate in ("-1", "nan", "1e-300", "inf"):
            self.expect(tutti("demo", "--rate", rate), 2, "rate", "0.001 to 1e+06")
        for seed in ("-1", "1.5", "18446744073709551616"):
            self.expect(tutti("demo", "--seed", seed), 2, "seed", "whole number")
        self.expect(tutti("demo", "--seed", "18446744073709551615", "--print-config"), 0)
        self.expect(tutti("demo", "--sensors", "sonar"), 2, "sensors", "lidar", "visual", "both")
        self.expect(tutti("demo", "--sensors", "visual", "--print-config"), 0, "mission: hall\n")
        for points in ("nan", "1e300", "0", "-1"):
            self.expect(tutti("world", "one", "-o", "two", "--points", points), 2, "points", "0.001 to 1000")
        self.expect(tutti("world", "one", "-o", "two", "--seed", "-1"), 2, "seed")
        self.expect(tutti("eval", "one"), 2)
        self.expect(tutti("compare", "one"), 2)
        for wrong in (("--tolerance", "nan"), ("--tolerance", "0"), ("--false-alarms", "1"), ("--false-alarms", "nan"), ("--a-estimate", "best"),
                      ("--spacing", "-1"), ("--odometry-sigma", "inf")):
            self.expect(tutti("compare", "two", "one", *wrong), 2, wrong[0])

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
            "robots: [{name: a, odometry: {file: a.tum}, reference: {file: a.tum}}]\nclosures: {verifier: reference}\n")
        run = lambda: tutti("run", mission, "--data", self.path, "--out", self.path / "out")
        self.expect(run(), 1, "robot a", "a.tum")
        bad_lines = {
            "columns": "1.0 0 0 0 0 0 0 1\n2.0 1 2 3\n",
            "quaternion": "1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 2\n",
            "stamp": "2.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n",
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
        # The server's map is compared with the robots' odometry, from the files alone.
        self.expect(tutti("compare", out, out, "--out", out / "compare"), 0, "alpha", "bravo", "compare.html")
        compared = json.loads((out / "compare" / "compare.json").read_text())
        self.assertEqual([robot["name"] for robot in compared["robots"]], ["alpha", "bravo"])
        same = json.loads(tutti("compare", out, out, "--b-estimate", "server", "--json").stdout)
        self.assertFalse(same["disagree"])
        graph = json.loads(tutti("compare", out / "graph.g2o", out / "graph.g2o", "--json").stdout)
        self.assertFalse(graph["disagree"])
        self.assertEqual([robot["nodes"] for robot in graph["robots"]], [robot["nodes"] for robot in same["robots"]])
        if os.environ.get("TUTTI_SANITIZE"):
            return
        # The effective configuration is a mission file that runs again with the same result.
        self.expect(tutti("run", out / "config.yaml", "--out", self.path / "again", "--seed", 7), 0)
        self.assertEqual((out / "report.json").read_text(), (self.path / "again" / "report.json").read_text())

    def test_a_stopped_mission_writes_what_is_there(self):
        out, kept = self.path / "out", self.path / "kept.tutti"
        command = [TUTTI, "demo", *BRIEF, "--rate", "10", "--out", str(out), "--map", str(kept)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as mission:
            while "%" not in mission.stderr.readline():
                pass
            mission.send_signal(signal.SIGINT)
            printed, said = mission.communicate(timeout=60)
        self.assertEqual(mission.returncode, 0, said)
        self.assertIn("stopping: report and map of what is there are made", said)
        self.assertRegex(printed, r"stopped at [0-9]+ of 30 s")
        self.assertTrue((out / "report.json").exists())
        self.expect(tutti("map", "info", kept), 0, "alpha")

    def stopped(self, *arguments, after):
        """stdout and stderr of a program that gets SIGTERM after a line with this in it"""
        with subprocess.Popen([TUTTI, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
            while after not in program.stderr.readline():
                self.assertIsNone(program.poll(), "ended before it could be stopped")
            program.send_signal(signal.SIGTERM)
            printed, said = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 0, said)
        return printed, said

    def test_a_second_signal_of_either_kind_ends_at_once(self):
        for first, second in ((signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT), (signal.SIGINT, signal.SIGINT)):
            command = [TUTTI, "demo", "--out", str(self.path / "out")]  # simulates its recordings for seconds
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as mission:
                wait_until_it_listens(mission)
                mission.send_signal(first)
                while "once more ends at once" not in mission.stderr.readline():
                    pass
                mission.send_signal(second)
                self.assertEqual(mission.wait(timeout=5), -second)

    def test_a_stopped_simulation_leaves_bags_that_can_be_read(self):
        printed, said = self.stopped("simulate", "demo", "-o", self.path / "bags", after="%")
        self.assertIn("stopping: the bags are closed with what is there; once more ends at once", said)
        self.assertRegex(printed, r"bags/alpha: [0-9]+ messages, stopped at [0-9]+ of [0-9]+ s\nstopped: 1 bags are there")
        self.assertFalse((self.path / "bags/bravo").exists())
        self.assertTrue((self.path / "bags/alpha/metadata.yaml").exists())
        self.expect(tutti("bag", "info", self.path / "bags/alpha"), 0, "/alpha/points", "ready: tutti run --bag alpha=")

    def test_a_simulation_says_how_long_yet(self):
        with subprocess.Popen([TUTTI, "simulate", "demo", "-o", str(self.path / "bags")], stderr=subprocess.PIPE, text=True) as program:
            self.assertRegex(program.stderr.readline(), r"^ +1?[0-9] %   alpha(, about [0-9]+ (s|min) yet)?$")
            program.kill()

    def test_a_mission_removes_nothing_of_the_users(self):
        data = self.path / "data"
        (data / "clouds").mkdir(parents=True)
        (data / "clouds" / "000000.pcd").write_text("mine")
        mission = self.mission("robots: [{name: a, odometry: {file: a.tum}, scans: clouds}]\nclosures: {verifier: lidar}\n")
        self.expect(tutti("run", mission, "--data", data, "--out", data), 1, "a.tum")  # never starts
        self.assertEqual([p.relative_to(data).as_posix() for p in sorted(data.rglob("*"))],
                         ["clouds", "clouds/000000.pcd"])
        (self.path / "clouds").write_text("a plain file")
        self.expect(tutti("demo", *BRIEF, "--out", self.path), 0)
        self.assertEqual((self.path / "clouds").read_text(), "a plain file")
        self.assertEqual([p.name for p in self.path.glob(".*")], [])

    def test_robot_names_are_those_of_files(self):
        names = "simulation.robots=[{name: \u00e9}, {name: \u00fc}]"
        self.expect(tutti("demo", "--set", names, "--out", self.path / "out"), 2, "simulation.robots.0.name", "letters")

    def test_wanted_scans_that_are_not_there_are_counted(self):
        self.write_way("a.tum", seconds=20)
        (self.path / "scans").mkdir()
        mission = self.mission("robots: [{name: a, odometry: {file: a.tum}, scans: scans}]\nclosures: {verifier: lidar}\n")
        run = lambda: tutti("run", mission, "--data", self.path, "--out", self.path / "out")
        (self.path / "scans" / "0.pcd").write_text("named otherwise")
        self.expect(run(), 1, "robot a", "scans: holds none of 000000.pcd (or .bin) to 000100.pcd")
        (self.path / "scans" / "000000.pcd").write_text(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
            "DATA ascii\n1 2 3\n")
        result = run()
        self.expect(result, 0)
        self.assertTrue(result.stdout.startswith("\nWarning: the server's map is odometry alone: "), result.stdout)
        self.assertNotIn("odometry and map agree", result.stdout)
        report = json.loads((self.path / "out" / "report.json").read_text())
        self.assertEqual(len(report["warnings"]), 1)
        self.assertFalse(report["robots"][0]["tied"])
        note, = [note for note in report["notes"] if "wanted scans that are not there" in note]
        self.assertEqual(int(note.split()[1]), 99, note)  # all from 000002 to 000100: 000001 shows nothing new
        self.assertIn("000002.pcd (or .bin): is not there", note)
        (self.path / "scans" / "000000.pcd").write_text("no point cloud")
        self.expect(run(), 1, "robot a: not one of 1 scans that were tried can be used, the first because", "000000.pcd")

    def test_settings_say_what_can_be_set(self):
        few = tutti("settings")
        self.expect(few, 0, "server.update_least_s = ", "closures.verifier = ", "link.loss = 0", "--all", "--simulation")
        self.assertLess(len(few.stdout.splitlines()), 35, few.stdout)
        keys = lambda listed: [line.split()[0] for line in listed.stdout.splitlines() if not line.startswith(" ")]
        product, simulated, both = (keys(tutti("settings", *flags)) for flags in (["--all"], ["--simulation"], ["--all", "--simulation"]))
        self.assertEqual(product + simulated, both)
        self.assertEqual(len(both), len(set(both)))
        self.assertIn("closures.verifier", product)
        self.assertEqual([key for key in product if key.startswith(("simulation.", "hall.", "receivers", "ranging.", "mistakes"))], [])
        self.assertIn("simulation.robots[].start_s", simulated)
        self.assertEqual([key for key in simulated if key.startswith(("agent.", "server.", "link."))], [])
        self.expect(tutti("settings", "antenna"), 0, "robots[].antenna_m", "receivers[].antenna_m")  # a word is looked for everywhere
        self.expect(tutti("settings", "--all", "dance"), 1, "no key or meaning contains 'dance'")
        one = tutti("settings", "disagreement", "alarm")
        self.expect(one, 0, "agent.disagreement.false_alarm_rate = 0.01   (a number, ")
        self.assertEqual(len(one.stdout.splitlines()), 2, one.stdout)
        self.expect(tutti("settings", "transmissions", "lost"), 0, "link.loss = 0")  # words of its meaning
        for program, key, other in (("server", "server.update_least_s = ", "agent."), ("robot", "agent.policy.name = ", "server."),
                                    ("worker", "closures.lidar.", "server.")):
            its = tutti("settings", "--of", program)
            self.expect(its, 0, key)
            for line in its.stdout.splitlines():
                self.assertFalse(line.startswith((other, "simulation.", "hall.", "closures.wrong")), line)
        self.expect(tutti("settings", "dance"), 1, "no key or meaning contains 'dance'")

    def write_empty_map(self, name):
        file = self.path / name
        with contextlib.closing(sqlite3.connect(file)) as database:
            database.execute("CREATE TABLE store (kind TEXT NOT NULL)")
            database.execute("INSERT INTO store VALUES('map')")
            for table in ("submaps", "verdicts", "answers", "decisions", "meta"):
                database.execute(f"CREATE TABLE {table} "
                                 "(key BLOB PRIMARY KEY NOT NULL, hash INTEGER NOT NULL, bytes BLOB NOT NULL)")
            database.execute(f"PRAGMA application_id={0x54757474}")
            database.execute("PRAGMA user_version=1")
            database.commit()
        return file

    def test_maps_are_listed_and_joined(self):
        self.expect(tutti("map", "list", self.path), 0, "no maps")
        one, other = self.write_empty_map("one.tutti"), self.write_empty_map("other.tutti")
        (self.path / "notes.txt").write_text("none of ours")
        listed = tutti("map", "list", self.path)
        self.expect(listed, 0, "one.tutti", "other.tutti", "sessions")
        self.assertNotIn("notes", listed.stdout)
        self.expect(tutti("map", "info", one), 0, "submaps      0", "0 accepted")
        self.expect(tutti("map", "merge", one, other, "-o", self.path / "both"), 0, "0 submaps")
        self.expect(tutti("map", "merge", one, other, "-o", self.path / "new/folder/both"), 0, "0 submaps")
        self.expect(tutti("map", "info", self.path / "both"), 0, "with news since")
        self.expect(tutti("map", "merge", one, other, "-o", self.path / "both"), 1, "both", "there already")
        self.expect(tutti("map", "closure", "list", one), 0, "closure")

    @unittest.skipIf(os.environ.get("TUTTI_SANITIZE"), "takes long")
    def test_robots_are_localised_in_a_map_and_the_maps_are_merged(self):
        missions = pathlib.Path(__file__).resolve().parents[1] / "missions"
        mission, out, site = missions / "next_day.yaml", self.path / "loc", self.path / "site.tutti"
        short = ["--set", "simulation.lidar.rays_share=0.25"]
        self.expect(tutti("run", mission, *short, "--set", "duration_s=150", "--map", site, "--out", self.path / "mapped"), 0)
        before = site.read_bytes()
        self.expect(tutti("run", mission, *short, "--map-in", site, "--out", out), 1, "--frozen")
        self.expect(tutti("run", mission, "--frozen", "--out", out), 2, "--map-in")
        self.expect(tutti("run", mission, *short, "--map-in", self.path / "none", "--frozen", "--out", out), 1, "no such file")
        (self.path / "text").write_text("x" * 5000)
        self.expect(tutti("run", mission, *short, "--map-in", self.path / "text", "--frozen", "--out", out), 1, "not an SQLite")
        self.expect(tutti("run", mission, *short, "--map-in", site, "--frozen", "--out", out), 0, "charlie", "delta", "localised")
        self.assertEqual(site.read_bytes(), before)
        localised = json.loads((out / "localise.json").read_text())
        robots = localised["robots"]
        self.assertEqual([robot["robot"] for robot in robots], ["charlie", "delta"])
        self.assertGreater(len(localised["places"]), localised["submaps"] // 3)
        for place in localised["places"]:  # nothing has changed
            self.assertEqual((place["missing"], place["appeared"], place["trust"]), (0, 0, 1), place)
        for robot in robots:
            self.assertEqual(robot["score"]["wrong"], 0)
            self.assertGreater(robot["share_of_time"]["localised"], 0.3)
            self.assertLess(robot["score"]["rmse_m"], 0.3)
        self.assertTrue((out / "charlie_localised.tum").stat().st_size > 0)
        brief = [word for i in (2, 3) for word in ("--set", f"simulation.robots.{i}.walk.duration_s=75")]
        self.expect(tutti("run", mission, "--true-start", "--out", out), 2, "--frozen")
        carried = ["run", mission, *short, *brief, "--map-in", site, "--frozen", "--true-start", "--out", out, "--kidnap-every"]
        self.expect(tutti(*carried, 80), 1, "charlie", "kidnap")
        self.expect(tutti(*carried, 20), 0, "carried elsewhere")
        robots = json.loads((out / "localise.json").read_text())["robots"]
        on_map = [robot for robot in robots if robot["starts"][0]["from_map_m"] < 5.0]
        self.assertGreater(len(on_map), 0)
        for robot in on_map:  # given its start pose, and scored until it said that it was carried, too
            self.assertLess(robot["starts"][0]["fix_after_s"], 2.0)
            self.assertGreater(robot["score_since_kidnap"]["scored"], 0)
            self.assertGreaterEqual(robot["score_since_kidnap"]["wrong"], robot["score"]["wrong"])
            self.assertGreater(robot["score"]["right_last_s"], 15.0)
        kidnaps = [kidnap for robot in robots for kidnap in robot["kidnaps"]]
        self.assertGreater(len(kidnaps), 0)
        for kidnap in kidnaps:
            self.assertLess(kidnap["said_after_s"], 2.0)
        self.expect(tutti("map", "merge", site, self.path / "loc" / "none", "-o", self.path / "both"), 1)
        other = self.path / "other.tutti"
        self.expect(tutti("run", mission, *short, "--seed", "2", "--set", "duration_s=60", "--map", other, "--out",
                          self.path / "second"), 0)
        self.expect(tutti("map", "merge", site, other, "-o", self.path / "both"), 0, "robot 0, session 0 of", "session 1")
        self.expect(tutti("map", "info", self.path / "both"), 0, "submaps")
        self.expect(tutti("map", "diff", site, self.path / "both"), 1, "no clouds in the joint map")  # of another place

    def finds_no_place(self, *run):
        """Robots in the map of another site: nothing is ever published, and why is said."""
        out = self.path / "nowhere"
        self.expect(tutti("run", *run, "--frozen", "--out", out), 0)
        for robot in json.loads((out / "localise.json").read_text())["robots"]:
            self.assertEqual([start["fix_after_s"] for start in robot["starts"]], [None], robot)
            self.assertEqual(robot["share_of_time"]["localised"], 0)
            self.assertEqual(robot["share_of_time"]["off the map"], 0, "it never knew where it was")
            self.assertGreater(robot["work"]["submaps_compared"], 0)
            self.assertEqual((out / f"{robot['robot']}_localised.tum").read_text().strip().count("\n"), 0)
            states = (out / f"{robot['robot']}_states.csv").read_text()
            self.assertRegex(states, r",(searching|ambiguous),")

    @unittest.skipIf(os.environ.get("TUTTI_SANITIZE"), "takes long")
    def test_cameras_in_the_map_of_another_hall_find_no_place(self):
        mission, other = pathlib.Path(__file__).resolve().parents[1] / "missions" / "hall.yaml", self.path / "other.tutti"
        late = ["--set", "hall.robots.2.start_s=1000"]
        self.expect(tutti("run", mission, "--seed", "2", *late, "--set", "duration_s=40", "--map", other, "--out",
                          self.path / "mapped"), 0)
        self.finds_no_place(mission, *late, "--map-in", other)

    def test_a_map_is_extended_and_taken_back(self):
        day, next_day, back = (self.path / name for name in ("day.tutti", "next.tutti", "back.tutti"))
        extend = ["run", "demo", *BRIEF, "--seed", "2", "--map-in", day, "--extend"]
        self.expect(tutti("demo", *BRIEF, "--map", day, "--out", self.path / "one"), 0)
        before = day.read_bytes()
        self.expect(tutti(*extend, "--out", self.path / "two"), 1, "--map NEW.tutti")
        self.expect(tutti(*extend, "--map", next_day, "--out", self.path / "two"), 0)
        self.expect(tutti(*extend, "--map", next_day, "--out", self.path / "two"), 2, "is there already")
        self.expect(tutti("map", "log", day), 0, "not held", "alpha, bravo")
        log = tutti("map", "log", next_day)
        self.expect(log, 0, "alpha, bravo", "alpha.2, bravo.2")  # robots of the same names
        self.assertEqual([line.split()[0] for line in log.stdout.splitlines()], ["version", "1", "2"])
        self.expect(tutti("map", "revert", next_day, "--to", "1", "-o", back), 0, "6 submaps")
        self.expect(tutti("map", "revert", next_day, "--to", "2", "-o", self.path / "x"), 1, "versions 1 to 2")
        for file in (day, next_day, back):
            self.expect(tutti("map", "export", file, "--tum", f"{file}.tum"), 0)
        for robot in ("alpha.tum", "bravo.tum"):
            first, later, reverted = (pathlib.Path(f"{file}.tum", robot).read_text() for file in (day, next_day, back))
            self.assertEqual(first, later)
            self.assertEqual(first, reverted)
        self.assertEqual(day.read_bytes(), before)
        self.expect(tutti("map", "diff", day), 1, "has one version", "two maps")
        self.expect(tutti("map", "diff", next_day, day), 1, "every session")
        self.expect(tutti("map", "diff", next_day, "--version", "7"), 1, "no version 7")
        self.expect(tutti("map", "diff", day, next_day, "--version", "2"), 2, "--version")
        self.expect(tutti("map", "diff", next_day), 1, "no clouds")

    def test_what_changed_in_a_map_is_shown(self):
        day, next_day, changes = self.path / "day.tutti", self.path / "next.tutti", self.path / "new" / "changes.ply"
        short = ["--set", "simulation.robots=[{walk: {duration_s: 20}}]", "--set", "simulation.lidar.rays_share=0.25"]
        self.expect(tutti("demo", *short, "--map", day, "--out", self.path / "one"), 0)
        self.expect(tutti("run", "demo", *short, "--map-in", day, "--extend", "--map", next_day, "--out", self.path / "two"), 0)
        self.expect(tutti("map", "log", next_day), 0, "alpha.2")
        for compared in ([day, next_day], [next_day]):
            self.expect(tutti("map", "diff", *compared, "--ply", changes), 0, "before: alpha\n", "since:  alpha.2\n", " 0 new, 0 gone,",
                        "is there since: nothing", "is there no more: nothing")
        self.assertTrue(changes.read_bytes().startswith(b"ply"))

    def test_map_says_what_is_wrong(self):
        self.expect(tutti("map"), 2)
        self.expect(tutti("map", "list", self.path / "missing"), 1, "missing", "no such folder")
        self.expect(tutti("map", "info", self.path / "missing"), 1, "missing", "no such file")
        self.assertFalse((self.path / "missing").exists())
        (self.path / "text").write_text("x" * 5000)
        self.expect(tutti("map", "info", self.path / "text"), 1, "not an SQLite file")
        (self.path / "a.mcap").write_bytes(b"\x89MCAP0\r\n")
        bag = tutti("map", "info", self.path / "a.mcap")
        self.expect(bag, 1, "is a recording, expected a map", "tutti run")
        self.assertNotIn("salvage", bag.stderr)
        empty = self.write_empty_map("empty")
        self.expect(tutti("map", "export", empty), 2, "-o FILE", "--g2o")
        self.expect(tutti("map", "export", empty, "--ply", self.path / "x.ply"), 1, "cloud")
        self.expect(tutti("map", "closure", "accept", "a/1-b/2"), 2, "--bus")
        for word in ("accept", "reject", "withdraw"):
            self.expect(tutti("map", "closure", word, "a/1-b/2", empty), 1, "a/1-b/2", "ROBOT/SUBMAP-ROBOT/SUBMAP")
        self.expect(tutti("map", "closure", "accept", "a/1-b/2", "--bus", "nats://192.0.2.1:4222"), 1, "TLS")

    def test_export_writes_a_file_for_viewers(self):
        self.expect(tutti("demo", *BRIEF, "--out", self.path / "out", "--map", self.path / "map"), 0)
        new = self.path / "new"
        self.expect(tutti("export", self.path / "map", "-o", new / "one/map.mcap"), 0, "messages of")
        self.expect(tutti("map", "export", self.path / "map", "--g2o", new / "two/graph.g2o", "--tum", new / "three"), 0, "vertices")
        self.expect(tutti("optimise", new / "two/graph.g2o", "-o", new / "four/graph.g2o"), 0, "chi2")
        self.expect(tutti("export", self.path / "map", "-o", self.path / "map/x.mcap"), 1, "cannot make the folder")
        self.expect(tutti("map", "info", self.path / "map"), 0, "joint map")
        self.expect(tutti("export", self.path / "map", "-o", self.path / "map.mcap"), 0, "messages of")
        self.expect(tutti("export", self.path / "map", "-o", new / "map.g2o", "-o", f"{new}/tum/"), 0, "vertices", "alpha.tum")
        self.expect(tutti("export", self.path / "out", "-o", new / "out.g2o", "-o", f"{new}/server/"), 0, "out.g2o", "bravo.tum")
        self.assertEqual((new / "out.g2o").read_text(), (self.path / "out/graph.g2o").read_text())
        self.expect(tutti("export", self.path / "map", "-o", "map.foo"), 2, "map.foo", ".g2o (g2o)", ".mcap (mcap)")
        self.expect(tutti("export", self.path / "out", "-o", "map.yaml"), 2, "map.yaml", "map's file")
        self.assertEqual(tutti("export", "--help").stdout.split("\n")[3:], tutti("map", "export", "--help").stdout.split("\n")[3:])
        self.expect(tutti("run", "x", "--map", self.path / "map"), 2)
        self.expect(tutti("map", "export", self.path / "map", "--grid", self.path / "g.yaml"), 1, "no points below any robot")
        self.expect(tutti("map", "export", self.path / "map", "--grid", "g.yaml", "--low", 2, "--high", 1), 2, "--low")
        self.expect(tutti("export", self.path / "out", "-o", self.path / "out.mcap"), 0, "messages of", "topics")
        self.expect(tutti("bag", "info", self.path / "out.mcap"), 0, "/alpha/corrected", "nav_msgs/msg/Path", "/tf_static")
        self.assertIn(b"jsonschema", (self.path / "out.mcap").read_bytes())
        self.expect(tutti("export", self.path / "out", "-o", self.path / "out.mcap", "--ros-only"), 0, "messages of", "topics")
        self.assertNotIn(b"jsonschema", (self.path / "out.mcap").read_bytes())
        self.expect(tutti("export", self.path, "-o", self.path / "x.mcap"), 1, "report.json")
        self.expect(tutti("export", self.path / "none", "-o", self.path / "x.mcap"), 1, "none")

    def test_simulate_writes_a_bag_a_robot(self):
        mission = self.mission("source: simulation\nclosures: {verifier: reference}\n"
                               "simulation: {robots: [{name: alpha, walk: {duration_s: 5}}]}\n")
        self.expect(tutti("simulate", mission, "-o", self.path / "bags"), 0, "bags/alpha: ", " messages")
        self.expect(tutti("bag", "info", self.path / "bags/alpha"), 0, "/alpha/odom (alpha/odom -> alpha/base_link)")
        self.expect(tutti("simulate", mission, "-o", self.path / "bags"), 1, "expected a folder that is empty")
        replayed = self.mission("robots: [{name: a, odometry: {file: a}, scans: s}]\n")
        self.expect(tutti("simulate", replayed, "-o", self.path / "x"), 2, "recordings", "simulation")

    def test_a_bag_is_checked_against_itself_and_corrected_if_asked_for(self):
        mission = self.mission("source: simulation\nsimulation: {sensors: lidar, world: {kind: tunnel, network: {rows: 2, columns: 2,"
                               " block_m: 10.0}}, robots: [{name: alpha, walk: &walk {duration_s: 60}}, {name: bravo, walk: *walk}]}\n")
        bags = self.path / "spoilt"
        self.expect(tutti("simulate", mission, "-o", bags, "--break", "bravo=lidar_ahead"), 0, "messages")
        self.expect(tutti("bag", "info", bags / "alpha", "--check"), 0, "ready: ", "check: alpha: scans and odometry say the same motion")
        self.expect(tutti("bag", "info", bags / "bravo", "--check"), 1, "check: bravo: by", "LiDAR sits", "--set robots.bravo.T_body_lidar")
        corrected = tutti("run", "--bag", f"bravo={bags}/bravo", "--set", "agent.submap.fit.scans=correct", "--out", self.path / "corrected")
        self.expect(corrected, 0, "LiDAR sits", "corrected, as is asked for: --set robots.bravo.T_body_lidar.translation_m=[")
        self.assertEqual(json.loads((self.path / "corrected/report.json").read_text())["robots"][0]["misfits"], [])

    def test_world_writes_the_walls_of_a_simulated_mission(self):
        mission = self.mission("source: simulation\nclosures: {verifier: reference}\n")
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

    def test_bad_rows_of_a_trajectory_are_left_out_and_said(self):
        way = self.write_way("way.tum")
        rows = way.read_text().splitlines(keepends=True)
        (self.path / "twice.tum").write_text("".join(rows[:4] + rows[3:]))
        for command in ("eval", "compare"):
            self.expect(tutti(command, self.path / "twice.tum", way), 0, "1 rows left out")

    def test_eval_gives_no_figure_below_three_pairs(self):
        way = self.write_way("way.tum").read_text().splitlines(keepends=True)
        for poses in (1, 2):
            (self.path / "few.tum").write_text("".join(way[:poses]))
            self.expect(tutti("eval", self.path / "few.tum", self.path / "way.tum"), 1,
                        f"{poses} of {poses} poses of", "expected 3 or more")
        (self.path / "few.tum").write_text("".join(way[:3]))
        self.expect(tutti("eval", self.path / "few.tum", self.path / "way.tum"), 0)

    def test_eval_takes_another_scale_and_another_clock(self):
        truth = self.write_way("truth.tum")
        rows = [[float(x) for x in line.split()] for line in truth.read_text().splitlines()]
        small = self.path / "small.tum"  # half as large, its clock 50 s behind
        small.write_text("".join("%.1f %.6f %.6f %.6f %.9f %.9f %.9f %.9f\n" % (row[0] - 50.0, row[1] / 2, row[2] / 2, row[3] / 2, *row[4:]) for row in rows))
        both = json.loads(tutti("eval", small, truth, "--offset", 50, "--scale", "--json").stdout)
        self.assertAlmostEqual(both["scale"], 2.0, places=4)
        self.assertLess(both["ate"]["max_m"], 1e-3)
        self.assertEqual((both["offset_s"], both["alignment"], both["association"]["pairs"]), (50.0, "Sim3", len(rows)))
        self.assertGreater(json.loads(tutti("eval", small, truth, "--offset", 50, "--json").stdout)["ate"]["rmse_m"], 5.0)
        self.assertEqual(json.loads(tutti("eval", small, truth, "--scale", "--json").stdout)["association"]["pairs"], len(rows) - 250)
        self.expect(tutti("eval", small, truth, "--offset", 50, "--scale"), 0, "Sim(3), scale 2.0000", "50 s added")
        self.expect(tutti("eval", small, truth, "--offset", -500), 1, "--offset")
        self.expect(tutti("eval", "--map", small, truth, "--scale"), 2, "--map")

    def write_way(self, name, bend_at=None, seconds=100, start=10.0):
        """A pose every 0.2 s along a way of 1 m/s; from `bend_at` seconds on it runs off to the left."""
        lines, x, y, heading = [], 0.0, 0.0, 0.0
        for i in range(5 * seconds + 1):
            lines.append("%.1f %.6f %.6f 0 0 0 %.9f %.9f" % (start + 0.2 * i, x, y, math.sin(heading / 2),
                                                             math.cos(heading / 2)))
            if bend_at is not None and i == 5 * bend_at:
                heading += 0.3
            heading += 0.01 * math.sin(0.05 * i)
            x, y = x + 0.2 * math.cos(heading), y + 0.2 * math.sin(heading)
        (self.path / name).write_text("\n".join(lines) + "\n")
        return self.path / name

    def test_compare_finds_where_a_trajectory_went_wrong(self):
        truth, bent = self.write_way("truth.tum"), self.write_way("bent.tum", bend_at=60)
        out = self.path / "compared"
        self.expect(tutti("compare", bent, truth), 0, "judges:    " + str(truth))  # as tutti eval has them
        self.expect(tutti("compare", bent, truth, "--out", out), 0, "They disagree", "failure?",
                    "would fix B", "compare.html")
        report = json.loads(tutti("compare", bent, truth, "--json").stdout)
        self.assertEqual(report, json.loads((out / "compare.json").read_text()))
        self.assertTrue(report["disagree"])
        robot = report["robots"][0]
        origin, = robot["origins"]
        self.assertLessEqual(origin["from_s"], 60.2)
        self.assertGreaterEqual(origin["until_s"], 60.0)
        self.assertLess(origin["until_s"] - origin["from_s"], 6.0)
        self.assertTrue(origin["alert"])
        self.assertAlmostEqual(origin["rotation_rad"], 0.3, delta=0.05)
        self.assertEqual(origin["from_stamp_ns"], round((10.0 + origin["from_s"]) * 1e9))
        self.assertLess(robot["fixed"]["rmse_m"], 0.1 * robot["aligned"]["rmse_m"])
        page = (out / "compare.html").read_text()
        mission = json.loads(page.split('id="tutti-mission">', 1)[1].split("</script>", 1)[0])
        keys = {message["key"] for message in mission["messages"]}
        self.assertLessEqual({"mission", "compare", "trajectory/B/server", "trajectory/B/onboard", "disagreement/B"}, keys)
        self.assertNotIn("src=\"http", page)

    def test_compare_says_when_two_trajectories_agree(self):
        truth = self.write_way("truth.tum")
        self.expect(tutti("compare", truth, truth), 0, "They agree")
        bent = self.write_way("bent.tum", bend_at=60)
        loose = json.loads(tutti("compare", bent, truth, "--tolerance", 100, "--json").stdout)
        self.assertFalse(loose["disagree"])
        self.assertEqual(loose["robots"][0]["constraints"], [])

    def write_graph(self, name, heading, steps=80):
        """A straight way of 1 m per vertex; from the 40th on it drifts to the left."""
        text = "".join("VERTEX_SE3:QUAT %d %d %.3f 0 0 0 0 1\n" % (i, i, heading * max(0, i - 40)) for i in
                       range(steps))
        information = "1e4 0 0 0 0 0 1e4 0 0 0 0 1e4 0 0 0 1e4 0 0 1e4 0 1e4"
        text += "".join("EDGE_SE3:QUAT %d %d 1 %.3f 0 0 0 0 1 %s\n" % (i, i + 1, heading * (i >= 40), information)
                        for i in range(steps - 1))
        (self.path / name).write_text(text)
        return self.path / name

    def write_stamps(self, name, seconds_per_vertex=5, steps=80):
        (self.path / name).write_text("id,robot,keyframe,stamp_ns\n" + "".join(
            "%d,3,%d,%d\n" % (i, i, seconds_per_vertex * 1_000_000_000 * i) for i in range(steps)))

    def test_compare_reads_graphs_with_and_without_stamps(self):
        a, b = self.write_graph("a.g2o", 0.0), self.write_graph("b.g2o", 0.5)
        report = json.loads(tutti("compare", b, a, "--json").stdout)
        self.assertTrue(report["disagree"])
        self.assertEqual([note.split(":")[0] for note in report["notes"]], [str(a), str(b)])  # invented times
        self.assertIn("n seconds", report["notes"][0])
        self.assertEqual(report["robots"][0]["duration_s"], 79)
        self.write_stamps("b_stamps.csv")
        self.expect(tutti("compare", b, b), 0, "They agree")
        report = json.loads(tutti("compare", b, b, "--json").stdout)
        self.assertEqual(report["robots"][0]["duration_s"], 395)
        self.assertEqual(report["notes"], [])  # every pose has an edge to the next, and a time
        (self.path / "b_stamps.csv").write_text("id,robot,keyframe,stamp_ns\n0,3,0,0\n")
        self.expect(tutti("compare", b, b), 1, "b_stamps.csv", "vertex 1")

    def test_compare_invents_no_times_beside_real_ones(self):
        graph, copy = self.write_graph("graph.g2o", 0.5), self.write_graph("copy.g2o", 0.5)
        self.write_stamps("graph_stamps.csv")
        for a, b in ((graph, copy), (copy, graph)):  # the same vertices
            report = json.loads(tutti("compare", b, a, "--json").stdout)
            self.assertFalse(report["disagree"])
            self.assertEqual(report["robots"][0]["duration_s"], 395)
            self.assertIn("copy.g2o: no times of its own", report["notes"][0])
        fewer, way = self.write_graph("fewer.g2o", 0.5, steps=60), self.write_way("way.tum")
        self.expect(tutti("compare", fewer, graph), 1, "fewer.g2o: 60 vertices, expected the 80 of")
        for a, b in ((way, copy), (copy, way)):
            self.expect(tutti("compare", b, a), 1, "copy.g2o", "no times", "copy_stamps.csv")

    def test_optimise_takes_the_stamps_along(self):
        graph = self.write_graph("graph.g2o", 0.5)
        self.write_stamps("graph_stamps.csv")
        self.expect(tutti("optimise", graph, "-o", self.path / "better.g2o"), 0)
        self.assertEqual((self.path / "better_stamps.csv").read_text(), (self.path / "graph_stamps.csv").read_text())
        self.expect(tutti("optimise", graph, "-o", graph), 0)
        report = json.loads(tutti("compare", self.path / "better.g2o", graph, "--json").stdout)
        self.assertFalse(report["disagree"])
        self.assertEqual(report["notes"], [])
        (self.path / "better_stamps.csv").unlink()
        (self.path / "better_stamps.csv").mkdir()
        self.expect(tutti("optimise", graph, "-o", self.path / "better.g2o"), 1, "better_stamps.csv")

    def test_a_stopped_optimisation_writes_what_is_there(self):
        graph, out = self.write_graph("graph.g2o", 0.5, steps=20000), self.path / "better.g2o"
        for loss in ("none", "gnc"):
            with subprocess.Popen([TUTTI, "optimise", graph, "-o", out, "--loss", loss], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True) as program:
                wait_until_it_listens(program)
                program.send_signal(signal.SIGTERM)  # while it reads the graph
                printed, said = program.communicate(timeout=60)
            self.assertEqual(program.returncode, 0, said)
            self.assertIn("stopping: the poses so far are written; once more ends at once", said)
            self.assertRegex(printed, "iterations +0\n(.*\n)*termination +interrupted")
            self.assertEqual(len(out.read_text().splitlines()), len(graph.read_text().splitlines()))

    def test_optimise_takes_graphs_as_published(self):
        """Information that is not semidefinite, a vertex that hangs on such an edge alone, and fixed vertices."""
        good, indefinite = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1", "2 0 0 3 0 0 2 0 0 0 0 2 0 0 0 2 0 0 2 0 2"
        graph, better = self.path / "published.g2o", self.path / "better.g2o"
        lines = ["VERTEX_SE3:QUAT %d %s 0 0 0 0 1" % (i, x) for i, x in enumerate(("0.5 0", "1 0.25", "2 0.5", "3 9"))]
        lines += ["FIX 2", "FIX 1"]
        lines += ["EDGE_SE3:QUAT %d %d 1 0 0 0 0 0 1 %s" % (i, i + 1, indefinite if i == 2 else good) for i in range(3)]
        graph.write_text("\n".join(lines) + "\n")
        self.expect(tutti("optimise", graph, "-o", better), 0, "1 of 3 matrices are not positive semidefinite",
                    "worst: 0.2 ", "2 vertices (FIX)")
        written = [line.split() for line in better.read_text().splitlines()]
        for i in (1, 2):
            self.assertEqual(written[i], lines[i].split())
        self.assertAlmostEqual(float(written[0][2]), 0.0, places=6)  # free: where its edge puts it
        for value, there in zip(written[3][2:5], (3.0, 0.5, 0.0)):
            self.assertAlmostEqual(float(value), there, places=6)
        self.assertEqual([line[1] for line in written if line[0] == "FIX"], ["1", "2"])
        summary = json.loads(tutti("optimise", graph, "-o", better, "--loss", "gnc", "--json").stdout)
        self.assertEqual((summary["indefinite_edges"], summary["fixed_vertices"]), (1, 2))
        self.assertAlmostEqual(summary["worst_indefinite_share"], 0.2)
        for bad in (good.replace("1", "-1"), good.replace("1", "inf")):
            graph.write_text("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 %s\n" % bad)
            self.expect(tutti("optimise", graph, "-o", better), 1, "published.g2o:1", "expected a")

    def write_fleet(self, wrong=True):
        """Two robots go twice round a circle of 60 steps of 1 m, the second 20 steps ahead of the first; every 4th pose
        has a closure to the same place one lap later, or of the other robot, and three closures are wrong."""
        def turned(steps):  # the pose `steps` on
            angle, radius = math.radians(6 * steps), 1 / (2 * math.sin(math.radians(3)))
            start = math.radians(-3) + math.pi / 2
            x = radius * (math.cos(start - math.pi + angle) - math.cos(start - math.pi))
            y = radius * (math.sin(start - math.pi + angle) - math.sin(start - math.pi))
            return "%.9f %.9f 0 0 0 %.9f %.9f" % (x, y, math.sin(angle / 2), math.cos(angle / 2))
        vertices = ["VERTEX_SE3:QUAT %s %s" % ((robot, k), turned(k + 20 * (robot == "B")))
                    for robot in "AB" for k in range(120)]
        edges = [(robot, k, robot, k + 1, turned(1)) for robot in "AB" for k in range(119)]
        edges += [(robot, k, robot, k + 60, turned(60)) for robot in "AB" for k in range(0, 60, 4)]
        edges += [("A", k + 20, "B", k, turned(0)) for k in range(0, 100, 4)]
        right = len(edges)
        if wrong:
            edges += [("A", 7, "B", 50, turned(0)), ("A", 90, "A", 15, turned(2)), ("B", 33, "A", 2, turned(-3))]
        variances = (0.0025,) * 3 + (0.0004,) * 3
        return vertices, edges, right, variances

    def write_pyfg(self, name, wrong=True):
        vertices, edges, _, variances = self.write_fleet(wrong)
        covariance = " ".join("%.9f" % (variances[i] if i == j else 0) for i in range(6) for j in range(i, 6))
        lines = [v.replace("('A', ", "0.0 A").replace("('B', ", "0.0 B").replace(")", "") for v in vertices]
        lines += ["EDGE_SE3:QUAT %.1f %s%d %s%d %s %s" % (1.5 * b[1], *a, *b, T, covariance)
                  for a, b, T in ((e[:2], e[2:4], e[4]) for e in edges)]
        (self.path / name).write_text("\n".join(lines) + "\n")
        return self.path / name

    def write_fleet_g2o(self, name, key):
        """`key`: the id of a robot's k-th vertex."""
        vertices, edges, _, variances = self.write_fleet()
        information = " ".join("%g" % (1 / variances[i] if i == j else 0) for i in range(6) for j in range(i, 6))
        lines = ["EDGE_SE3:QUAT %d %d %s %s" % (key(*e[:2]), key(*e[2:4]), e[4], information) for e in edges]
        (self.path / name).write_text("\n".join(lines) + "\n")
        return self.path / name

    def test_optimise_robust_judges_a_pyfg(self):
        graph, out = self.write_pyfg("fleet.pyfg"), self.path / "out.g2o"
        self.expect(tutti("optimise", "--robust", graph, "-o", out, "--trajectories", self.path / "ways"), 0,
                    "robots       2 (A B)", "55 accepted, 3 refused", "of the odometry edges", "ATE          0.000 m")
        closures = (self.path / "out_closures.csv").read_text().splitlines()
        self.assertEqual(closures[0], "from,to,accepted,reason")
        self.assertEqual([line.split(",")[:3] for line in closures[-3:]],
                         [["A7", "B50", "0"], ["A90", "A15", "0"], ["B33", "A2", "0"]])
        self.assertTrue(all(line.split(",")[3] for line in closures[-3:]))
        self.assertEqual(len((self.path / "ways" / "B.tum").read_text().splitlines()), 121)
        self.assertEqual(out.read_text().split()[1], str((65 << 56)))  # A0 as GTSAM's symbol key
        self.write_pyfg("fleet_no_outliers.pyfg", wrong=False)
        report = json.loads(tutti("optimise", "--robust", graph, "-o", self.path / "out.pyfg", "--json").stdout)
        self.assertEqual(report["closures"], {"right": 55, "right_accepted": 55, "wrong_accepted": 0, "precision": 1.0,
                                              "recall": 1.0})
        self.assertEqual((report["accepted"], report["refused"], report["failed_odometry"]), (55, 3, []))
        self.assertEqual(report["ate_m"]["perfect"]["robots_in_joint"], 2)
        self.assertLess(report["ate_m"]["perfect"]["joint"], 1e-3)
        self.assertGreater(report["factorisations"], 0)
        all_right = json.loads(tutti("optimise", "--robust", graph, "-o", out, "--json", "--right", graph).stdout)
        self.assertGreater(all_right["ate_m"]["perfect"]["joint"], 0.1)  # least squares of the wrong ones, too
        again = json.loads(tutti("optimise", "--robust", self.path / "out.pyfg", "-o", out, "--json").stdout)
        self.assertEqual((again["accepted"], again["refused"]), (55, 0))
        unscored = json.loads(tutti("optimise", "--robust", graph, "-o", out, "--json", "--truth", "none").stdout)
        self.assertNotIn("ate_m", unscored)

    def test_optimise_robust_tells_the_robots_of_a_g2o(self):
        symbols = self.write_fleet_g2o("symbols.g2o", lambda robot, k: (ord(robot.lower()) << 56) + k)
        ranges = self.write_fleet_g2o("ranges.g2o", lambda robot, k: k + 120 * (robot == "B"))
        out = self.path / "out.g2o"
        self.expect(tutti("optimise", "--robust", symbols, "-o", out), 0, "2 (a b), by symbol keys",
                    "55 accepted, 3 refused", "counts as at n seconds")
        self.expect(tutti("optimise", "--robust", ranges, "-o", out, "--robots", "0,120"), 0, "2 (0 1), by --robots",
                    "55 accepted, 3 refused")
        self.expect(tutti("optimise", "--robust", ranges, "-o", out), 0, "2 (0 1), by gaps", "55 accepted, 3 refused")
        self.expect(tutti("optimise", "--robust", out, "-o", self.path / "again.g2o", "--truth", out), 0,
                    "2 (0 1), by %s" % (self.path / "out_stamps.csv"), "55 accepted, 0 refused", "ATE          0.000 m")
        right = self.path / "right.g2o"  # the right closures alone, without vertices
        right.write_text("".join(line + "\n" for line in ranges.read_text().splitlines()[2 * 119:][:55]))
        self.expect(tutti("optimise", "--robust", ranges, "-o", out, "--right", right), 0, "precision    100.0 % (55 of 55")
        graph = self.write_pyfg("fleet.pyfg")
        for arguments, code, words in (((ranges, "--robots", "120,0"), 2, ["--robots", "increase"]),
                                       ((ranges, "--robots", "5,120"), 2, ["vertex 0", "first robot's 5"]),
                                       ((graph, "--robots", "0"), 2, ["by letters"]),
                                       ((ranges, "--truth", graph), 1, ["none of the vertices"]),
                                       ((ranges, "--loss", "gnc"), 2, ["--robust"])):
            self.expect(tutti("optimise", "--robust", *arguments, "-o", out), code, *words)
        self.expect(tutti("optimise", "--robust", ranges, "-o", self.path / "out.pyfg"), 2, "expected OUT.g2o")
        self.expect(tutti("optimise", ranges, "-o", out, "--robots", "0,120"), 2, "--robust")

    def test_compare_says_what_is_wrong(self):
        truth = self.write_way("truth.tum")
        self.expect(tutti("compare", self.path / "none.tum", truth), 1, "none.tum")
        (self.path / "empty.tum").write_text("# nothing\n")
        self.expect(tutti("compare", self.path / "empty.tum", truth), 1, "empty.tum", "no pose")
        (self.path / "nan.tum").write_text("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n")
        self.expect(tutti("compare", self.path / "nan.tum", truth), 1, "nan.tum:2")
        (self.path / "one.tum").write_text("11 0 0 0 0 0 0 1\n")
        self.expect(tutti("compare", self.path / "one.tum", truth), 1, "one.tum", "at least 2")
        later = self.write_way("later.tum", start=1000.0)
        self.expect(tutti("compare", later, truth), 1, "later.tum", "1000.000", "110.000")
        self.expect(tutti("compare", truth, self.path), 1, "_server.tum")
        for endless in ("x" * 5000, "x" * 5000 + ".g2o"):
            self.expect(tutti("compare", truth, endless), 1, "tutti compare: xxx", "too long")
            self.expect(tutti("compare", endless, truth), 1, "tutti compare: xxx", "too long")
            self.expect(tutti("optimise", endless, "-o", self.path / "x.g2o"), 1, "too long")
            self.expect(tutti("eval", truth, endless), 1, "too long")
            self.expect(tutti("eval", "--map", truth, endless), 1, "truth.tum")
        (self.path / "file").write_text("")
        self.expect(tutti("compare", truth, truth, "--out", self.path / "file" / "x"), 1, "--out")

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
        self.expect(tutti("eval", "--map", self.write_ply("beyond.ply", self.room() + [(2e5, 0, 0)]), survey), 1,
                    "beyond.ply", "(200000, 0, 0)", "within 104858 m", "--voxel")
        far = self.write_ply("far.ply", self.room(shift=500.0))
        self.expect(tutti("eval", "--map", far, survey, "--refine"), 1, "does not settle")
        report = self.path / "report.json"
        for text, word in (("{", "report.json"), ("{}", "T_reference_world"),
                           ('{"server": {"T_reference_world": null}}', "null"),
                           ('{"server": {"T_reference_world": {"translation_m": [1, 2]}}}', "3 numbers"),
                           ('{"server": {"T_reference_world": 5}}', "3 numbers"),
                           ('{"server": {"T_reference_world": [[0, 0, 0], [0, 0, 0, 1]]}}', "3 numbers"),
                           ('{"server": [1]}', "T_reference_world"), ('[5]', "T_reference_world")):
            report.write_text(text)
            self.expect(tutti("eval", "--map", survey, survey, "--report", report), 1, "report.json", word)
        self.expect(tutti("eval", "--map", survey, survey, "--report", self.path), 1, "tutti eval: %s: " % self.path)
        self.expect(tutti("eval", "--map", survey, survey, "--report", self.path / "none"), 1, "none")

    def test_a_graph_is_run_as_a_mission(self):
        covariance = " ".join("1e-4" if i in (0, 6, 11, 15, 18, 20) else "0" for i in range(21))
        pose, one = "0 0 0 0 0 0 1", self.path / "one.pyfg"
        edges = [f"EDGE_SE3:QUAT {1.67e9 + k:.1f} a{k - 1} a{k} 1 0 0 0 0 0 1 {covariance}" for k in range(1, 40)]
        one.write_text("\n".join(edges) + "\n")
        self.expect(tutti("run", "--graph", one, "--out", self.path / "one"), 0, "report.html")
        robot = json.loads((self.path / "one/report.json").read_text())["robots"][0]
        self.assertEqual((robot["name"], robot["keyframes"], robot["onboard_rmse_m"]), ("a", 40, None))
        self.expect(tutti("run", "--graph", one, "--print-config"), 0, "verifier: recorded", "mission: one")
        self.expect(tutti("run", "--graph", self.path / "none.pyfg"), 2, "none.pyfg")
        self.expect(tutti("run", "--graph", one, "--bag", "a=b"), 2, "--bag")
        one.write_text("\n".join(edges[:9] + edges[10:]) + "\n")
        self.expect(tutti("run", "--graph", one, "--out", self.path / "gap"), 1, "no odometry from a9 to a10")
        one.write_text("\n".join(edges) + f"\nEDGE_SE3:QUAT 1.67e9 a3 b7 {pose} {covariance}\n")
        self.expect(tutti("run", "--graph", one), 2, "one.pyfg:40: names vertex b7")

    def test_graphs_of_robots_in_files_of_their_own_are_one(self):
        def vertex(name, x):
            return f"VERTEX_SE3:QUAT {(ord(name[0]) << 56) + int(name[1:])} {x} 0 0 0 0 0 1\n"

        def edge(a, b, x):
            ids = [(ord(name[0]) << 56) + int(name[1:]) for name in (a, b)]
            information = " ".join("100" if i in (0, 6, 11, 15, 18, 20) else "0" for i in range(21))
            return f"EDGE_SE3:QUAT {ids[0]} {ids[1]} {x} 0 0 0 0 0 1 {information}\n"

        between = edge("a3", "b3", 1.0)
        for robot in "ab":
            (self.path / f"{robot}.g2o").write_text(
                "EDGE_SE3_PRIOR 0 0 0 0\n" + "".join(vertex(f"{robot}{k}", k) for k in range(20)) +
                "".join(edge(f"{robot}{k - 1}", f"{robot}{k}", 1.0) for k in range(1, 20)) + between)
        a, b, out = self.path / "a.g2o", self.path / "b.g2o", self.path / "o.g2o"
        for robust in ([], ["--robust"]):
            self.expect(tutti("optimise", *robust, a, b, "-o", out), 0, "1 edges are there twice", "2 x EDGE_SE3_PRIOR")
        self.expect(tutti("optimise", a, "-o", out), 1, "names vertex b3", "give the file that has robot b")
        both = self.path / "both.g2o"
        both.write_text(a.read_text() + b.read_text())
        self.expect(tutti("run", "--graph", both, "--out", self.path / "run"), 0, "report.html")
        robots = json.loads((self.path / "run/report.json").read_text())["robots"]
        self.assertEqual([(robot["name"], robot["keyframes"]) for robot in robots], [("a", 20), ("b", 20)])

    def test_missions_of_the_repository_are_valid(self):
        for mission in sorted((SOURCE / "missions").glob("*.yaml")):
            self.expect(tutti("run", mission, "--print-config"), 0, "mission: " + mission.stem)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
