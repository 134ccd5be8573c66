# SPDX-License-Identifier: BSD-3-Clause
"""Every function with one argument of right ones replaced by nonsense: it is refused, or harmless, and never a crash."""
import inspect
import os
import warnings

import numpy as np
import tutti
from support import InFolder, run, walk

NAN = float("nan")
ARRAYS = [None, 3.0, "text", [], [[]], np.empty((0, 3)), np.empty((3, 0)), np.zeros(5), np.zeros((5, 2)), np.zeros((5, 4)), np.full((5, 3), NAN),
          np.full((5, 3), np.inf), np.full((5, 3), 1e300), np.zeros((5, 3), complex), np.array([[None] * 3]), np.zeros((2, 3, 4, 5)),
          np.array(["a", "b"]), np.full((4, 4), NAN), np.zeros((4, 4)), -np.eye(6), np.full((6, 6), 1e308), np.array([-1, 0, 2**62]),
          np.arange(30, dtype=np.uint8).reshape(10, 3)[::-2], np.asfortranarray(np.ones((7, 3), np.float16)), np.zeros((5, 3), bool),
          np.array([np.datetime64("2026-01-01")]), [[1, 2, 3], [4]]]
SCALARS = [NAN, np.inf, -np.inf, -1, 0, 1e-320, 1e308, 2**40, 2**80, -2**31, None, "text", b"bytes", [], {}, True]
OTHERS = ["", "nowhere", b"\xff", 3, None, [], {}, {"a": 1}, {"": ""}, object()]
MILD = (ValueError, TypeError, OSError, OverflowError)


class Garbage(InFolder):
    def setUp(self):
        super().setUp()
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.path)  # some of it is a name of a file
        warnings.simplefilter("ignore")

    def right(self):
        """Functions with arguments that they take."""
        points, trajectory = np.random.default_rng(1).uniform(size=(20, 3)), walk(20)
        graph = tutti.proximity_graph(points, 0.5)
        poses = tutti.PoseGraph(trajectory.matrices, [(i, i + 1) for i in range(19)], np.tile(np.eye(4), (19, 1, 1)))
        bag = str(self.path / "bag.mcap")
        with tutti.BagWriter(bag) as writer:
            writer.write_odometry("/odom", 1.0, np.eye(4))
        agent = tutti.RobotAgent(0)
        writer = tutti.BagWriter(str(self.path / "other.mcap"))
        yield from {
            "Trajectory": (trajectory.stamps, trajectory.positions, trajectory.quaternions_xyzw),
            "PoseGraph": (poses.poses, poses.edges, poses.measurements),
            "OrientedCloud": (points,), "Closure": (0, 1, np.eye(4), np.eye(6)), "RobotAgent": (0,), "MapServer": ([0],),
            "associate": (trajectory, trajectory), "ate": (trajectory, trajectory), "rpe": (trajectory, trajectory), "compare": (trajectory, trajectory),
            "proximity_graph": (points,),
            "graph_from_edges": (3, [[0, 1]], [1.0]), "spectrum": (graph,), "wavelet_transform": (graph, points), "meyer_kernels": (3, 2.0, [0.5]),
            "kron_reduce": (graph, [1, 2]), "sparsify": (graph, 0.1), "select_budget": (graph, points, 5), "select_largest_eigenvector": (graph,),
            "optimise": (poses,), "optimise_robust": (poses,), "read_graph": ("nowhere.g2o",), "write_graph": (self.path / "x.g2o", poses),
            "read_trajectory": ("nowhere.tum",), "write_trajectory": (self.path / "x.tum", trajectory), "read_cloud": ("nowhere.pcd",),
            "read_timed_cloud": ("nowhere.pcd",), "write_cloud": (self.path / "x.ply", points), "voxel_downsample": (points, 0.1),
            "register_clouds": (points, points), "cloud_distances": (points, points), "bag_info": (bag,), "read_bag": (bag,),
            "read_bag_trajectory": (bag, "/odom"), "open_map": ("nowhere.tutti",), "run_mission": ("nowhere.yaml",), "run_bags": ({"a": "nowhere"},),
            "localise_mission": ("nowhere.yaml", "nowhere.tutti"), "localise_bags": ({"a": "nowhere"}, "nowhere.tutti"),
            "Localiser": ("nowhere.tutti",),
            "BagWriter": (self.path / "x.mcap",),
        }.items()
        yield "Trajectory.transformed", (trajectory, np.eye(4))
        yield "Trajectory.from_matrices", (trajectory.stamps, trajectory.matrices)
        yield "RobotAgent.add_scan", (agent, 0.0, points)
        yield "RobotAgent.receive", (agent, b"")
        yield "RobotAgent.add_odometry", (agent, 0.0, np.eye(4), np.eye(6))
        yield "MapServer.receive", (tutti.MapServer([0]), b"")
        yield "BagWriter.write", (writer, "/x", "nav_msgs/msg/Odometry", 1.0, b"")
        yield "BagWriter.write_points", (writer, "/y", 1.0, points)
        yield "BagWriter.write_transform", (writer, 1.0, np.eye(4), "a", "b")

    def arguments(self, function):
        """Names of all arguments, by pybind11's signatures."""
        doc = (function.__init__ if inspect.isclass(function) else function).__doc__
        names = [part.split(":")[0].strip() for part in doc.split("(", 1)[1].split(", ") if ":" in part]
        return [name for name in names if name.isidentifier() and name != "self"]

    def test_everything(self):
        tried, named = 0, set()
        for path, right in self.right():
            function = getattr(tutti, path.split(".")[0])
            named.add(path.split(".")[0])
            if "." in path:
                function = getattr(function, path.split(".")[1])
            for place in range(len(right)):
                for nonsense in ARRAYS + SCALARS + OTHERS:
                    tried += self.survives(function, *right[:place], nonsense, *right[place + 1:])
            for name in self.arguments(function)[len(right):]:
                for nonsense in ARRAYS + SCALARS + OTHERS:
                    if name not in ("out", "map", "data"):
                        tried += self.survives(function, *right, **{name: nonsense})
        self.assertEqual({name for name in tutti.__all__ if not inspect.isclass(getattr(tutti, name))} - named, set())
        self.assertGreater(tried, 5000)

    def survives(self, function, *arguments, **more):
        try:
            function(*arguments, **more)
        except MILD:
            pass
        except Exception as error:
            self.fail(f"{function.__name__}{arguments!r:.300} {more!r:.300}: {error!r}")
        return 1


if __name__ == "__main__":
    run()
