# SPDX-License-Identifier: BSD-3-Clause
import json
import pathlib
import tempfile

import numpy as np
import tutti
from support import InFolder, program, run, shift

# A piece of tunnel: alpha and bravo map it, and charlie comes when they have ended.
TUNNEL = {"simulation.sensors": "lidar", "simulation.lidar.rays_share": 0.5, "simulation.world.network.rows": 2,
          "simulation.world.network.columns": 2, "simulation.world.network.block_m": 22.0, "simulation.world.featureless_share": 0.0,
          "simulation.robots": [{"walk": {"duration_s": 100, "rate_hz": 5.0}}] * 2 +
          [{"start_s": 101, "walk": {"duration_s": 40, "rate_hz": 5.0}}]}
SURE = np.diag([1e-6] * 6)


def words(settings):
    return [word for key, value in settings.items()
            for word in ("--set", f"{key}={value if isinstance(value, str) else json.dumps(value)}")]


class Localise(InFolder):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.map = pathlib.Path(folder.name) / "site.tutti"
        tutti.run_mission("demo", settings={**TUNNEL, "duration_s": 100}, map=cls.map)

    def test_a_robot_finds_itself_as_the_program_says(self):
        heard = []
        found = tutti.localise_mission("demo", self.map, settings=TUNNEL, progress=lambda name, share: heard.append((name, share)))
        self.assertEqual({name for name, _ in heard}, {"charlie"})
        self.assertTrue(all(0.0 <= share <= 1.0 for _, share in heard))
        charlie, = found.robots
        first, last = charlie.course[0], charlie.course[-1]
        self.assertEqual((first.state, first.T_world_body, first.covariance, first.overlap), ("searching", None, None, None))
        self.assertEqual((last.state, last.floor, last.T_world_body.shape, last.covariance.shape), ("localised", 1, (4, 4), (6, 6)))
        self.assertEqual(len(charlie.published()), sum(place.state == "localised" for place in charlie.course))
        self.assertEqual(len(charlie.published(floor=2)), 0)
        self.assertEqual(charlie.troubles, [])
        program("run", "demo", "--map-in", self.map, "--frozen", "--out", self.path / "said", *words(TUNNEL))
        found.write(self.path / "own")
        for name in ("charlie_localised.tum", "charlie_states.csv"):
            self.assertEqual((self.path / "own" / name).read_bytes(), (self.path / "said" / name).read_bytes())
        said = json.loads((self.path / "said/localise.json").read_text())
        own = found.report
        for report in (said, own):
            self.assertGreater(report["robots"][0].pop("timing")["cpu_s"], 0.0)
        self.assertEqual(own, said)
        self.assertGreater(own["robots"][0]["score"]["scored"], 50)
        self.assertEqual(own["robots"][0]["score"]["wrong"], 0)
        self.assertGreater(own["robots"][0]["fresh_share_since_fix"], 0.95)
        self.assertIn("charlie", str(found))

    def test_a_robot_of_ones_own_finds_itself(self):
        bags = self.path / "bags"
        program("simulate", "demo", "-o", bags, *words(TUNNEL))
        replayed = tutti.localise_bags({"charlie": bags / "charlie"}, self.map).robots[0].published()
        self.assertGreater(len(replayed), 50)
        robot = tutti.Localiser(self.map, settings={"localise.candidates": 8})
        self.assertEqual((robot.floors, len(robot.map_id)), (1, 16))
        self.assertGreater(robot.map_version, 0)
        self.assertEqual((robot.located.state, robot.located.T_world_body), ("searching", None))
        topics = {topic.type.split("/")[-1]: topic.topic for topic in tutti.bag_info(bags / "charlie").topics if "truth" not in topic.topic}
        T_body_lidar = shift(0.0)
        for message in tutti.read_bag(bags / "charlie", ["/tf_static"]):
            for one in message.decode()["transforms"]:
                T_body_lidar = one["T"] if "lidar" in one["child_frame_id"] else T_body_lidar
        odometry = tutti.read_bag_trajectory(bags / "charlie", topics["Odometry"])
        scans = [message.decode() for message in tutti.read_bag(bags / "charlie", [topics["PointCloud2"]])]
        places, used = [], 0
        for stamp, T in zip(odometry.stamps, odometry.matrices):
            robot.add_odometry(stamp, T, SURE)
            while scans and scans[0]["stamp"] <= stamp:
                scan = scans.pop(0)
                if robot.wants_scan(scan["stamp"]):
                    used += 1
                    robot.add_scan(scan["stamp"], scan["points"] @ T_body_lidar[:3, :3].T + T_body_lidar[:3, 3])
            places.append(robot.located)
        self.assertGreater(used, 50)
        self.assertEqual(places[-1].state, "localised", places[-1].why)
        self.assertLess(places[-1].age_s, 1.0)
        self.assertGreater(places[-1].overlap, 0.5)
        there = replayed.matrices[np.argmin(np.abs(replayed.stamps - places[-1].stamp))]
        self.assertLess(np.linalg.norm(there[:3, 3] - places[-1].T_world_body[:3, 3]), 0.5)
        robot.search_anew()
        self.assertEqual((robot.located.state, robot.located.T_world_body), ("searching", None))
        robot.set_start(there, np.diag([0.1] * 3 + [0.01] * 3), floor=1)
        self.assertIn("start pose", robot.located.why)

    def test_a_map_is_extended_and_does_not_move(self):
        new = self.path / "new.tutti"
        settings = {**TUNNEL, "simulation.robots": TUNNEL["simulation.robots"][:2] + [{"walk": {"duration_s": 60, "rate_hz": 5.0}}]}
        before = tutti.open_map(self.map).trajectories()
        self.refuses("map_in|site.tutti|map=", tutti.run_mission, "demo", settings=settings, map_in=self.map)
        tutti.run_mission("demo", settings=settings, map_in=self.map, map=new)
        after = tutti.open_map(new).trajectories()
        self.assertIn("charlie", after)
        for name, trajectory in before.items():
            same = [other for known, other in after.items() if known.split(" ")[0] == name and other == trajectory]
            self.assertEqual(len(same), 1, (name, list(after)))

    def test_wrong_input_is_refused(self):
        self.refuses("nowhere", tutti.Localiser, self.path / "nowhere", error=OSError)
        self.refuses("candidates", tutti.Localiser, self.map, settings={"localise.candidates": 0})
        self.refuses("made this map", tutti.localise_mission, "demo", self.map,
                     settings={**TUNNEL, "simulation.robots": TUNNEL["simulation.robots"][:2]})
        (self.path / "text").write_text("no map")
        self.refuses("text", tutti.localise_mission, "demo", self.path / "text", error=(ValueError, OSError))
        robot = tutti.Localiser(self.map)
        self.refuses("T_world_body", robot.set_start, np.zeros((4, 4)), SURE)
        self.refuses("floor", robot.set_start, shift(0.0), SURE, floor=7)
        self.refuses("stamp", robot.add_odometry, float("nan"), shift(0.0), SURE)


if __name__ == "__main__":
    run()
