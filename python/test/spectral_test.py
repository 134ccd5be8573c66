# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import tutti
from support import InFolder, run

RNG = np.random.default_rng(1)
PLACES = np.cumsum(RNG.normal(size=(80, 3)), axis=0)


class Spectral(InFolder):
    def setUp(self):
        super().setUp()
        self.graph = tutti.proximity_graph(PLACES, radius_m=6.0, sigma_m=1.0)

    def test_weights_are_those_of_the_paper(self):
        distance = np.linalg.norm(PLACES[:, None] - PLACES[None], axis=2)
        A = np.where((distance <= 6.0) & (distance > 0), np.exp(-distance / 2.0), 0.0)
        np.testing.assert_allclose(self.graph.adjacency(), A, atol=1e-14)
        np.testing.assert_allclose(self.graph.laplacian(), np.diag(A.sum(1)) - A, atol=1e-12)

    def test_edges_make_the_same_graph(self):
        again = tutti.graph_from_edges(len(self.graph), self.graph.edges, self.graph.weights)
        np.testing.assert_allclose(again.laplacian(), self.graph.laplacian(), atol=1e-12)
        self.assertEqual(self.graph.components().max(), 0)

    def test_the_spectrum_is_numpys(self):
        values, vectors = tutti.spectrum(self.graph)
        np.testing.assert_allclose(values, np.maximum(np.linalg.eigvalsh(self.graph.laplacian()), 0), atol=1e-10)
        np.testing.assert_allclose(vectors @ np.diag(values) @ vectors.T, self.graph.laplacian(), atol=1e-10)
        self.assertAlmostEqual(self.graph.largest_eigenvalue(), values[-1], places=8)

    def test_the_transform_is_that_of_the_eigenvectors(self):
        values, U = np.linalg.eigh(self.graph.laplacian())
        g = tutti.meyer_kernels(5, values[-1], np.maximum(values, 0))
        np.testing.assert_allclose((g**2).sum(0), 1, atol=1e-12)  # a tight frame
        f = RNG.normal(size=(80, 2))
        expected = np.stack([U @ np.diag(g[s]) @ U.T @ f for s in range(5)], axis=1)
        exact = tutti.wavelet_transform(self.graph, f, 5, exact=True)
        self.assertEqual(exact.shape, (80, 5, 2))
        np.testing.assert_allclose(exact, expected, atol=1e-9)
        np.testing.assert_allclose(tutti.wavelet_transform(self.graph, f, 5, tolerance=1e-4), expected, atol=1.1e-4)
        one = tutti.wavelet_transform(self.graph, f[:, 0].astype(np.float32), 5, exact=True)
        np.testing.assert_allclose(one, expected[:, :, 0], atol=1e-5)

    def test_kron_reduction_is_the_schur_complement(self):
        keep = np.array([3, 17, 18, 40, 79])
        reduced, kept = tutti.kron_reduce(self.graph, keep[::-1])
        np.testing.assert_array_equal(kept, keep)
        L, rest = self.graph.laplacian(), np.setdiff1d(np.arange(80), keep)
        schur = L[np.ix_(keep, keep)] - L[np.ix_(keep, rest)] @ np.linalg.solve(L[np.ix_(rest, rest)], L[np.ix_(rest, keep)])
        np.testing.assert_allclose(reduced.laplacian(), schur, atol=1e-12)

    def test_selections(self):
        chosen = tutti.select_budget(self.graph, PLACES, 20, must_keep=[5])
        self.assertEqual(len(chosen), 20)
        self.assertIn(5, chosen)
        self.assertIn(7, tutti.select_largest_eigenvector(self.graph, [7]))
        self.assertLessEqual(len(tutti.sparsify(self.graph, 0.1).edges), len(self.graph.edges))

    def test_nothing_and_little(self):
        none = tutti.proximity_graph([])
        self.assertEqual((len(none), none.adjacency().shape, none.edges.shape), (0, (0, 0), (0, 2)))
        self.assertEqual(tutti.wavelet_transform(none, [], 3).shape, (0, 3))
        self.assertEqual(tutti.wavelet_transform(tutti.proximity_graph([[0, 0, 0]]), [2.0], 3).tolist(), [[2.0, 0.0, 0.0]])
        self.assertEqual(len(tutti.kron_reduce(self.graph, [])[0]), 0)

    def test_wrong_input_is_refused(self):
        self.refuses("positions|(n, 3)", tutti.proximity_graph, np.zeros((4, 2)))
        self.refuses("positions[0]|inf", tutti.proximity_graph, [[np.inf, 0, 0]])
        self.refuses("radius_m", tutti.proximity_graph, PLACES, radius_m=0.0)
        self.refuses("signals|79|80", tutti.wavelet_transform, self.graph, np.zeros(79))
        self.refuses("signals", tutti.wavelet_transform, self.graph, np.zeros((80, 2, 2)))
        self.refuses("signals", tutti.wavelet_transform, self.graph, None)
        self.refuses("scales", tutti.wavelet_transform, self.graph, np.zeros(80), 0)
        self.refuses("keep[1]|80", tutti.kron_reduce, self.graph, [1, 80])
        self.refuses("keep|float64|integers", tutti.kron_reduce, self.graph, [1.5])
        self.refuses("edges[0]|(0, 0)", tutti.graph_from_edges, 3, [[0, 0]], [1.0])
        self.refuses("edges[0]|(0, 3)", tutti.graph_from_edges, 3, [[0, 3]], [1.0])
        self.refuses("weights[0]|-1", tutti.graph_from_edges, 3, [[0, 1]], [-1])
        self.refuses("weights[0]|1e+300", tutti.graph_from_edges, 3, [[0, 1]], [1e300])
        self.refuses("nodes|-3", tutti.graph_from_edges, -3, [], [])
        self.refuses("dense", tutti.graph_from_edges(30_000, [], []).laplacian)


if __name__ == "__main__":
    run()
