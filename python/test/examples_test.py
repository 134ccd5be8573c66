# SPDX-License-Identifier: BSD-3-Clause
"""Every script of examples/python does what it says."""
import os
import subprocess
import sys

import numpy as np
import tutti
from clouds_test import room
from support import SOURCE, InFolder, program, run, shift, turn, walk

MISSION = """mission: small
source: simulation
simulation:
  sensors: lidar
  robots: [{name: alpha, walk: {duration_s: 60}}, {name: bravo, walk: {duration_s: 60}}]
  world: {kind: tunnel, network: {rows: 2, columns: 3, block_m: 15, jitter_m: 2}}
"""


class Examples(InFolder):
    def example(self, name, *arguments):
        done = subprocess.run([sys.executable, SOURCE / "examples/python" / name, *map(str, arguments)], capture_output=True, text=True,
                              env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_all_are_tried(self):
        tried = {name.removeprefix("test_") for name in dir(self) if name.startswith("test_")}
        self.assertLessEqual({path.stem for path in (SOURCE / "examples/python").glob("*.py")}, tried)

    def test_without_arguments_they_print_their_usage(self):
        scripts = {*(SOURCE / "examples").glob("*.py"), *(SOURCE / "examples/python").glob("*.py")} - {SOURCE / "examples/python/embed.py"}
        self.assertGreaterEqual(len(scripts), 5)
        for script in scripts:
            for arguments in ([], ["--help"]):
                done = subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, timeout=60)
                self.assertNotEqual(done.returncode, 0, script)
                self.assertIn(f"{script.name} ", done.stderr)
                self.assertNotIn("Traceback", done.stderr)

    def test_compare_trajectories(self):
        tutti.write_trajectory(self.path / "a.tum", walk(600))
        tutti.write_trajectory(self.path / "b.tum", walk(600, error_rad=2e-3))
        said = self.example("compare_trajectories.py", self.path / "b.tum", self.path / "a.tum")
        self.assertIn("SuspectedOrigin", said)
        lines = (SOURCE / "examples/python/compare_trajectories.py").read_text().split("import tutti\n")[1].strip().splitlines()
        self.assertLessEqual(len(lines), 10)

    def test_optimise_graph(self):
        from pose_graph_test import loop
        tutti.write_graph(self.path / "in.g2o", tutti.PoseGraph(*loop(80, wrong=2, noise=0.01)[1]))
        said = self.example("optimise_graph.py", self.path / "in.g2o", self.path / "out.g2o")
        self.assertIn("18 of 20 closures accepted", said)
        self.assertEqual(len(tutti.read_graph(self.path / "out.g2o").edges), 97)

    def test_register_clouds(self):
        T, rng = np.eye(4), np.random.default_rng(1)
        with tutti.BagWriter(self.path / "bag.mcap") as bag:
            for k in range(4):
                bag.write_points("/points", 10.0 + k, (room(rng) - T[:3, 3]) @ T[:3, :3], "lidar")
                T = T @ shift(0.2, 0.05) @ turn([0, 0, 1], 0.05)
        self.example("register_clouds.py", self.path / "bag.mcap", "/points", self.path / "out.ply")
        distances = tutti.cloud_distances(tutti.read_cloud(self.path / "out.ply"), room(rng, 30000))
        self.assertLess(np.median(distances), 0.02)

    def test_run_mission(self):
        (self.path / "small.yaml").write_text(MISSION)
        said = self.example("run_mission.py", self.path / "small.yaml", self.path / "map.tutti")
        self.assertIn("alpha:", said)
        self.assertIn("% free", said)

    def test_localise(self):
        (self.path / "small.yaml").write_text(MISSION)
        tutti.run_mission(self.path / "small.yaml", map=self.path / "site.tutti")
        program("simulate", self.path / "small.yaml", "-o", self.path / "bags")
        said = self.example("localise.py", self.path / "site.tutti", self.path / "bags/bravo", self.path / "out.tum")
        self.assertIn("searching; it has not seen enough yet", said)
        self.assertIn("s: localised; ", said)
        self.assertGreater(len(tutti.read_trajectory(self.path / "out.tum")), 50)

    def test_embed(self):
        self.assertIn("corrected", self.example("embed.py"))


if __name__ == "__main__":
    run()
