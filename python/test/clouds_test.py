# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import tutti
from support import InFolder, run, shift, turn


def room(rng, n=6000):
    """Walls, floor and a box of a room 8 by 6 by 3 m, seen from its middle."""
    u, v = rng.uniform(size=(2, n))
    sides = rng.integers(0, 6, n)
    points = np.empty((n, 3))
    for side, (x, y, z) in enumerate([(0 * u, 6 * u, 3 * v), (8 + 0 * u, 6 * u, 3 * v), (8 * u, 0 * u, 3 * v), (8 * u, 6 + 0 * u, 3 * v),
                                      (8 * u, 6 * v, 0 * u), (1 + 2 * u, 2 + 0 * u, 1.5 * v)]):
        points[sides == side] = np.stack([x, y, z], axis=1)[sides == side]
    return points - [4, 3, 1.2] + rng.normal(0, 0.005, (n, 3))


class Clouds(InFolder):
    def test_registration_finds_the_motion(self):
        rng = np.random.default_rng(1)
        T = shift(0.3, -0.2, 0.1) @ turn([0.1, 0, 1], 0.1)  # target from source
        target, source = room(rng), room(rng) @ T[:3, :3] - T[:3, 3] @ T[:3, :3]
        found = tutti.register_clouds(target, source, voxel_m=0.2)
        self.assertTrue(found.converged)
        np.testing.assert_allclose(found.T_target_source, T, atol=0.01)
        self.assertGreater(found.overlap, 0.8)
        staged = tutti.register_clouds(tutti.OrientedCloud(target, voxel_m=0.2), tutti.OrientedCloud(source, voxel_m=0.2), T_init=T)
        np.testing.assert_allclose(staged.T_target_source, T, atol=0.01)
        self.assertTrue((np.linalg.eigvalsh(staged.covariance) > 0).all())

    def test_normals_are_of_unit_length_or_none(self):
        cloud = tutti.OrientedCloud(room(np.random.default_rng(2)), voxel_m=0.2)
        lengths = np.linalg.norm(cloud.normals, axis=1)
        self.assertTrue(np.all((abs(lengths - 1) < 1e-5) | (lengths == 0)))
        self.assertEqual(cloud.points.dtype, np.float32)

    def test_little_to_register_is_no_crash(self):
        for points in ([], [[0, 0, 0]], np.full((50, 3), np.nan), np.zeros((50, 3))):
            self.assertFalse(tutti.register_clouds(points, points).converged)

    def test_distances_to_a_plane(self):
        x, y = np.meshgrid(np.arange(0, 5, 0.1), np.arange(0, 5, 0.1))
        plane = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
        np.testing.assert_allclose(tutti.cloud_distances([[2, 2, 0.5], [2.03, 2.04, -0.25]], plane), [0.5, 0.25], atol=1e-3)
        self.assertTrue(np.isnan(tutti.cloud_distances([[np.nan, 0, 0]], plane)[0]))

    def test_files_read_back(self):
        points = np.random.default_rng(3).normal(size=(100, 3)).astype(np.float32)
        for name in ("x.pcd", "x.ply", "x.bin"):
            tutti.write_cloud(self.path / name, points)
            np.testing.assert_array_equal(tutti.read_cloud(self.path / name), points)
        again, times, field = tutti.read_timed_cloud(self.path / "x.pcd")
        self.assertEqual((len(again), times.shape, field), (100, (0,), ""))

    def test_wrong_input_is_refused(self):
        self.refuses(".pcd", tutti.read_cloud, "x.las")
        self.refuses("x.pcd", tutti.read_cloud, self.path / "x.pcd", error=OSError)
        self.refuses("points|(n, 3)", tutti.write_cloud, self.path / "x.ply", np.zeros((3, 4)))
        self.refuses("voxel_m", tutti.voxel_downsample, np.zeros((3, 3)), 0.0)
        self.refuses("2^20", tutti.voxel_downsample, [[1e9, 0, 0]], 0.1)
        self.refuses("T_init", tutti.register_clouds, np.zeros((3, 3)), np.zeros((3, 3)), np.eye(3))
        self.refuses("target|object", tutti.register_clouds, None, np.zeros((3, 3)))


if __name__ == "__main__":
    run()
