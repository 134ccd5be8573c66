# SPDX-License-Identifier: BSD-3-Clause
import json

import numpy as np
import tutti
from support import InFolder, program, run, shift, turn

RNG = np.random.default_rng(1)


def loop(n=40, wrong=0, noise=1e-3):
    """Twice round a circle with closures every second pose, of which the last ones are wrong; and the truth."""
    step = shift(0.5) @ turn([0, 0, 1], 4 * np.pi / n)
    truth = [np.eye(4)]
    for _ in range(n - 1):
        truth.append(truth[-1] @ step)
    truth = np.array(truth)
    edges = [(i, i + 1) for i in range(n - 1)] + [(i, i + n // 2) for i in range(0, n // 2, 2)]
    measured = []
    for k, (a, b) in enumerate(edges):
        T = np.linalg.inv(truth[a]) @ truth[b] @ shift(*RNG.normal(0, noise, 3)) @ turn(RNG.normal(size=3), RNG.normal(0, noise))
        measured.append(T @ shift(3.0, 1.0) if k >= len(edges) - wrong else T)
    information = np.tile(np.eye(6) / noise**2, (len(edges), 1, 1))
    return truth, (np.tile(np.eye(4), (n, 1, 1)), edges, np.array(measured), information)


class PoseGraphs(InFolder):
    def test_arrays_come_back(self):
        _, arrays = loop()
        graph = tutti.PoseGraph(*arrays, fixed=[3, 3, 1])
        for name, array in zip(("poses", "edges", "measurements", "information"), arrays):
            np.testing.assert_allclose(getattr(graph, name), array, rtol=1e-9, atol=1e-9)
        self.assertEqual((graph.fixed.tolist(), graph.robots, graph.stamps), ([1, 3], None, None))

    def test_files_read_back(self):
        _, arrays = loop()
        graph = tutti.PoseGraph(*arrays, robots=np.repeat([0, 1], 20), stamps=np.tile(np.arange(20.0), 2))
        for name in ("graph.g2o", "graph.pyfg"):
            tutti.write_graph(self.path / name, graph)
            again = tutti.read_graph(self.path / name)
            np.testing.assert_allclose(again.measurements, graph.measurements, atol=1e-9)
            np.testing.assert_allclose(again.information, graph.information, rtol=1e-6, atol=1e-3)
            np.testing.assert_array_equal(again.robots, graph.robots)
            np.testing.assert_array_equal(again.stamps, graph.stamps)

    def test_stamps_of_another_graph_are_in_the_way(self):
        _, arrays = loop()
        tutti.write_graph(self.path / "graph.g2o", tutti.PoseGraph(*arrays, stamps=np.arange(40)))
        self.refuses("graph_stamps.csv", tutti.write_graph, self.path / "graph.g2o", tutti.PoseGraph(*arrays))

    def test_the_optimum_is_the_truth(self):
        truth, arrays = loop()
        result = tutti.optimise(tutti.PoseGraph(*arrays))
        self.assertEqual(result.termination, "converged")
        self.assertLess(result.chi2_after, result.chi2_before)
        np.testing.assert_allclose(result.graph.poses, truth, atol=0.05)

    def test_gnc_lets_wrong_closures_go(self):
        truth, arrays = loop(wrong=2)
        result = tutti.optimise(tutti.PoseGraph(*arrays), loss="gnc")
        self.assertEqual(result.weights[-3:].round().tolist(), [1, 0, 0])
        np.testing.assert_allclose(result.graph.poses, truth, atol=0.05)

    def test_robust_says_which_closures_are_wrong(self):
        truth, arrays = loop(80, wrong=2, noise=0.01)
        result = tutti.optimise_robust(tutti.PoseGraph(*arrays))
        np.testing.assert_array_equal(result.odometry, np.arange(len(arrays[1])) < 79)
        self.assertEqual(result.accepted[-3:].tolist(), [True, False, False])
        self.assertEqual([bool(reason) for reason in result.reasons], (~result.accepted).tolist())
        np.testing.assert_allclose(result.graph.poses, truth, atol=0.3)
        self.assertEqual(len(result.graph.edges), result.accepted.sum())

    def test_the_program_says_the_same(self):
        _, arrays = loop(80, wrong=2, noise=0.01)
        graph = tutti.PoseGraph(*arrays)
        tutti.write_graph(self.path / "in.g2o", graph)
        said = json.loads(program("optimise", self.path / "in.g2o", "-o", self.path / "out.g2o", "--json"))
        graph = tutti.read_graph(self.path / "in.g2o")
        result = tutti.optimise(graph)
        self.assertEqual(said["chi2_after"], result.chi2_after)
        np.testing.assert_array_equal(tutti.read_graph(self.path / "out.g2o").poses, result.graph.poses)
        said = json.loads(program("optimise", "--robust", self.path / "in.g2o", "-o", self.path / "out.g2o", "--json"))
        result = tutti.optimise_robust(graph)
        self.assertEqual(said["accepted"], (result.accepted & ~result.odometry).sum())
        np.testing.assert_array_equal(tutti.read_graph(self.path / "out.g2o").poses, result.graph.poses)

    def test_robots_in_any_order(self):
        truth, (poses, edges, measured, information) = loop(80, noise=0.01)
        order = np.r_[40:80, 0:40]  # the second robot first
        place = np.argsort(order)
        keep = [k for k, (a, b) in enumerate(edges) if (a, b) != (39, 40)]
        graph = tutti.PoseGraph(poses, place[np.array(edges)[keep]], measured[keep], information[keep], robots=[1] * 40 + [0] * 40)
        result = tutti.optimise_robust(graph)
        self.assertEqual((result.components.max(), result.robots.tolist()), (0, [1] * 40 + [0] * 40))
        relative = np.linalg.inv(result.graph.poses[place[0]]) @ result.graph.poses[place]
        np.testing.assert_allclose(relative, truth, atol=0.3)

    def test_any_graph_is_solved_or_refused(self):
        """Robots in segments, edges with next to no or far too much information: whatever it is, it is no bug of Tutti's."""
        rng, solved = np.random.default_rng(5), 0
        for _ in range(60):
            n = rng.integers(1, 30)
            edges = [(a, b) for a, b in rng.integers(0, n, (rng.integers(0, 40), 2)) if a != b]
            if rng.random() < 0.5:
                edges = [(i, i + 1) for i in range(n - 1)] + edges
            poses, measured = np.tile(np.eye(4), (n, 1, 1)), np.tile(np.eye(4), (len(edges), 1, 1))
            poses[:, :3, 3] = rng.normal(0, 10 ** rng.uniform(-3, 6), (n, 3))
            measured[:, :3, 3] = rng.normal(0, 10 ** rng.uniform(-3, 6), (len(edges), 3))
            roots = [rng.normal(0, 10 ** rng.uniform(-6, 6), (6, rng.integers(1, 7))) for _ in edges]
            graph = tutti.PoseGraph(poses, edges, measured, [root @ root.T for root in roots],
                                    robots=rng.integers(0, rng.integers(1, 4), n), stamps=rng.permutation(n))
            for loss in ("none", "huber", "gnc", "robust"):
                try:
                    tutti.optimise_robust(graph) if loss == "robust" else tutti.optimise(graph, loss)
                    solved += 1
                except ValueError:
                    pass
        self.assertGreater(solved, 30)

    def test_wrong_input_is_refused(self):
        _, (poses, edges, measured, information) = loop()
        make = tutti.PoseGraph
        self.refuses("edges[0]|(0, 99)", make, poses, [(0, 99)], measured[:1])
        self.refuses("edges[0]|(1, 1)", make, poses, [(1, 1)], measured[:1])
        self.refuses("edges|float64", make, poses, np.array(edges, float), measured)
        self.refuses("49 edges, 48 measurements", make, poses, edges, measured[1:])
        self.refuses("measurements[0]|rigid", make, poses, edges, 3 * measured)
        self.refuses("measurements[0]|nan", make, poses, edges, np.nan * measured)
        self.refuses("information[0]|semidefinite", make, poses, edges, measured, -information)
        self.refuses("information[0]|symmetric", make, poses, edges, measured, information + np.triu(np.ones((6, 6)), 1) * 1e6)
        self.refuses("information|(n, 6, 6)", make, poses, edges, measured, np.ones((49, 3, 3)))
        self.refuses("ids", make, poses, edges, measured, ids=np.zeros(40, int))
        self.refuses("fixed[0]|-1", make, poses, edges, measured, fixed=[-1])
        self.refuses("robots: are 3", make, poses, edges, measured, robots=[0, 1, 2])
        self.refuses("loss|'l1'", tutti.optimise, make(poses, edges, measured), loss="l1")
        self.refuses("holds no pose", tutti.optimise_robust, make([], [], []))
        self.refuses("determine", tutti.optimise, make(poses, edges, measured, 0 * information))
        self.assertEqual(len(tutti.optimise(make([], [], [])).graph), 0)


if __name__ == "__main__":
    run()
