# SPDX-License-Identifier: BSD-3-Clause
import json
import signal
import subprocess
import sys

import numpy as np
import tutti
from support import InFolder, program, run

BRIEF = {"simulation.robots": [{"walk": {"duration_s": 120}}, {"walk": {"duration_s": 120}}], "simulation.sensors": "none",
         "closures.verifier": "reference"}


class Missions(InFolder):
    def test_the_program_says_the_same(self):
        result = tutti.run_mission("demo", settings=BRIEF, out=self.path / "own", map=self.path / "own.tutti", threads=1)
        sets = [word for key, value in BRIEF.items() for word in ("--set", f"{key}={value if isinstance(value, str) else json.dumps(value)}")]
        program("demo", "--out", self.path / "said", *sets)
        self.assertEqual((self.path / "own/report.json").read_bytes(), (self.path / "said/report.json").read_bytes())
        self.assertEqual(result.report, json.loads((self.path / "said/report.json").read_text()))
        robot = result.robots[0]
        self.assertEqual(tutti.read_trajectory(self.path / "said" / f"{robot.name}_server.tum"), robot.server)
        self.assertAlmostEqual(tutti.ate(robot.odometry, robot.reference).rmse_m, robot.odometry_rmse_m, places=6)
        self.assertIn(robot.name, str(result))
        self.look_into(self.path / "own.tutti", result)

    def look_into(self, path, result):
        joint = tutti.open_map(path)
        self.assertEqual((joint.robots, joint.components), (["alpha", "bravo"], 1))
        ways = joint.trajectories()
        for name, robot in zip(joint.robots, result.robots):  # nobody gave the server their names
            np.testing.assert_allclose(ways[name].positions, robot.server.positions, atol=1e-6)
        self.assertEqual(len(joint.graph()), len(result.graph))
        accepted = [closure for closure in joint.closures() if closure.state == "accepted"]
        self.assertGreater(len(accepted), 0)
        self.assertTrue(all(closure.misfit_m < 1.0 for closure in accepted))
        self.refuses("", joint.grid)  # nobody saw anything
        self.assertEqual(joint.cloud().shape, (0, 3))
        self.refuses("open", tutti.open_map, path, error=(ValueError, OSError))  # in this very program

    def test_progress_may_end_it(self):
        heard = []

        def stop(time_s, duration_s, submaps, closures):
            heard.append((time_s, duration_s, submaps, closures))
            if len(heard) == 2:
                raise InterruptedError("enough")

        with self.assertRaisesRegex(InterruptedError, "enough"):
            tutti.run_mission("demo", settings=BRIEF, progress=stop)
        self.assertEqual(len(heard), 2)

    def test_ctrl_c_ends_it(self):
        script = "import tutti; tutti.run_mission('demo', threads=1, progress=lambda *now: print(now, flush=True))"
        child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        child.stdout.readline()
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=60)[1]
        self.assertIn("KeyboardInterrupt", said)
        self.assertEqual(child.returncode, -signal.SIGINT)

    def test_wrong_input_is_refused(self):
        self.refuses("nowhere.yaml", tutti.run_mission, self.path / "nowhere.yaml", error=OSError)
        self.refuses("nonsense", tutti.run_mission, "demo", settings={"agent.nonsense": 1})
        self.refuses("is there already", tutti.run_mission, "demo", map=self.path, error=OSError)
        self.refuses("threads", tutti.run_mission, "demo", threads=-1)
        self.refuses("bags", tutti.run_bags, {})
        self.refuses("nowhere", tutti.run_bags, {"alpha": self.path / "nowhere"}, error=OSError)
        (self.path / "no.tutti").write_text("no map")
        self.refuses("no.tutti", tutti.open_map, self.path / "no.tutti")
        self.refuses("nowhere", tutti.open_map, self.path / "nowhere.tutti", error=OSError)


if __name__ == "__main__":
    run()
