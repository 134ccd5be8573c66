# SPDX-License-Identifier: BSD-3-Clause
import json

import numpy as np
import tutti
from support import InFolder, program, run, shift, turn, walk


class Trajectories(InFolder):
    def test_arrays_come_back(self):
        trajectory = walk(20)
        again = tutti.Trajectory.from_ns(trajectory.stamps_ns, trajectory.positions, trajectory.quaternions_xyzw)
        np.testing.assert_allclose(again.matrices, trajectory.matrices, atol=1e-12)
        np.testing.assert_array_equal(again.stamps_ns, trajectory.stamps_ns)
        self.assertEqual(trajectory.positions.shape, (20, 3))
        self.assertEqual(len(trajectory[5:15:2]), 5)
        self.refuses("negative", lambda: trajectory[::-1])
        self.assertNotEqual(trajectory, 3)
        self.assertEqual(tutti.Trajectory([1], [[0, 0, 0]], [[0, 0, 0, 1]]), tutti.Trajectory.from_matrices([1.0], [np.eye(4)]))

    def test_quaternions_are_x_y_z_w(self):
        trajectory = tutti.Trajectory([0.0], [[0, 0, 0]], [[0, 0, np.sqrt(0.5), np.sqrt(0.5)]])
        np.testing.assert_allclose(trajectory.matrices[0], turn([0, 0, 1], np.pi / 2), atol=1e-12)

    def test_any_dtype_and_strides(self):
        turns = np.tile(np.float32([0, 0, 0, 1]), (6, 1))
        trajectory = tutti.Trajectory(np.arange(12, dtype=np.int32)[::2], np.arange(36).reshape(12, 3)[::2], np.asfortranarray(turns))
        np.testing.assert_array_equal(trajectory.positions, np.arange(36.0).reshape(12, 3)[::2])
        np.testing.assert_array_equal(trajectory.stamps, np.arange(0.0, 12.0, 2.0))

    def test_nothing_is_something(self):
        none = tutti.Trajectory([], [], [])
        self.assertEqual((len(none), none.positions.shape, none.matrices.shape), (0, (0, 3), (0, 4, 4)))
        self.assertEqual(none, tutti.Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4))))

    def test_wrong_arrays_are_refused(self):
        right = [0.0, 1.0], np.zeros((2, 3)), np.tile([0, 0, 0, 1.0], (2, 1))
        self.refuses("positions|(2, 2)|(n, 3)", tutti.Trajectory, right[0], np.zeros((2, 2)), right[2])
        self.refuses("positions[1]|nan", tutti.Trajectory, right[0], [[0, 0, 0], [0, np.nan, 0]], right[2])
        self.refuses("stamps[1]", tutti.Trajectory, [1.0, 1.0], *right[1:])
        self.refuses("stamps|nan", tutti.Trajectory, [0.0, np.nan], *right[1:])
        self.refuses("quaternions_xyzw[0]|norm", tutti.Trajectory, right[0], right[1], np.ones((2, 4)))
        self.refuses("3 stamps, 2 positions", tutti.Trajectory, [0, 1, 2], *right[1:])
        for stamps in (["a", "b"], [None, 1], [[0, 1], [2]], [1j, 2j], object(), np.array(3.0), np.zeros((2, 1))):
            self.refuses("stamps", tutti.Trajectory, stamps, *right[1:])
        self.refuses("stamps_ns|float64|integers", tutti.Trajectory.from_ns, *right)
        self.refuses("matrices[0]|rigid", tutti.Trajectory.from_matrices, [0.0], [2 * np.eye(4)])

    def test_files_read_back(self):
        trajectory = walk(30)
        for form in ("tum", "euroc"):
            tutti.write_trajectory(self.path / "way.txt", trajectory, form)
            self.assertEqual(tutti.read_trajectory(str(self.path / "way.txt")), trajectory)
        tutti.write_trajectory(self.path / "way.txt", trajectory, "kitti")
        np.testing.assert_allclose(tutti.read_trajectory(self.path / "way.txt", kitti_rate_hz=5.0).matrices, trajectory.matrices, atol=1e-9)

    def test_trouble_with_files(self):
        self.refuses("nowhere.tum", tutti.read_trajectory, self.path / "nowhere.tum", error=OSError)
        self.refuses("/no/such", tutti.write_trajectory, "/no/such/folder/x.tum", walk(3), error=OSError)
        (self.path / "bad.tum").write_text("1 2 3\n")
        self.refuses("bad.tum:1|3 columns", tutti.read_trajectory, self.path / "bad.tum")
        self.refuses("format|'xml'", tutti.read_trajectory, self.path / "bad.tum", "xml")
        self.refuses("", tutti.read_trajectory, 3, error=TypeError)


class Errors(InFolder):
    def test_a_rigid_motion_is_no_error(self):
        trajectory = walk()
        moved = trajectory.transformed(shift(5, -3, 1) @ turn([1, 2, 3], 2.0))
        ate = tutti.ate(moved, trajectory)
        self.assertLess(ate.rmse_m, 1e-9)
        self.assertLess(tutti.rpe(moved, trajectory, delta_m=5.0).rmse_m, 1e-9)
        np.testing.assert_allclose(ate.T_reference_estimate @ moved.matrices[7], trajectory.matrices[7], atol=1e-9)

    def test_of_a_known_offset(self):
        trajectory = walk()
        positions = trajectory.positions
        positions[::2, 2] += 0.2  # every other one up: 0.1 about the mean
        off = tutti.Trajectory.from_ns(trajectory.stamps_ns, positions, trajectory.quaternions_xyzw)
        self.assertAlmostEqual(tutti.ate(off, trajectory).rmse_m, 0.1, places=3)

    def test_associated_poses_give_what_ate_says(self):
        truth, trajectory = walk(400, 0.05), walk(200, 0.1, error_rad=1e-3)[3::4]
        a, b = tutti.associate(trajectory, truth)
        ate = tutti.ate(trajectory, truth)
        T = ate.T_reference_estimate
        errors = np.linalg.norm(a.positions @ T[:3, :3].T + T[:3, 3] - b.positions, axis=1)
        self.assertAlmostEqual(float(np.sqrt(np.mean(errors**2))), ate.rmse_m, places=9)
        self.assertEqual(ate.pairs, len(a))

    def test_the_program_says_the_same(self):
        truth, trajectory = walk(), walk(error_rad=1e-3)
        tutti.write_trajectory(self.path / "truth.tum", truth)
        tutti.write_trajectory(self.path / "way.tum", trajectory)
        said = json.loads(program("eval", self.path / "way.tum", self.path / "truth.tum", "--json"))
        self.assertEqual(said["ate"]["rmse_m"], tutti.ate(trajectory, truth).rmse_m)
        self.assertEqual(said["rpe_time"]["rmse_m"], tutti.rpe(trajectory, truth).rmse_m)
        self.assertEqual(said["rpe_distance"]["rmse_m"], tutti.rpe(trajectory, truth, delta_m=10.0).rmse_m)

    def test_no_common_times(self):
        self.refuses("no common times", tutti.ate, walk(), walk(start_s=5.0))
        self.refuses("expected one of them", tutti.rpe, walk(), walk(), delta_s=1.0, delta_m=1.0)
        self.refuses("no two poses", tutti.rpe, walk(), walk(), delta_s=1000.0)


class Comparisons(InFolder):
    def test_what_parts_is_found_where_it_parts(self):
        truth = walk(600)
        slipped = truth.matrices
        slipped[300:] = slipped[300] @ turn([0, 0, 1], 0.3) @ np.linalg.inv(slipped[300]) @ slipped[300:]
        found = tutti.compare(estimate=tutti.Trajectory.from_matrices(truth.stamps, slipped), reference=truth)
        self.assertTrue(found.disagrees)
        self.assertEqual(found.significance.shape, (len(found.stamps), len(found.scale_length_m)))
        origin = max(found.origins, key=lambda one: one.rotation_rad)
        self.assertTrue(origin.from_s - 2 < truth.stamps[300] < origin.until_s + 2, origin)
        self.assertLess(found.after.rmse_m, 0.2 * found.before.rmse_m)
        self.assertIn("disagree", repr(found))

    def test_the_program_says_the_same(self):
        truth, trajectory = walk(), walk(error_rad=2e-3)
        tutti.write_trajectory(self.path / "a", truth)
        tutti.write_trajectory(self.path / "b", trajectory)
        said = json.loads(program("compare", self.path / "b", self.path / "a", "--json"))
        own = json.loads(tutti.compare(estimate=trajectory, reference=truth).json())
        self.assertEqual(said["robots"], own["robots"])
        tutti.compare(estimate=trajectory, reference=truth).write(self.path / "out")
        self.assertTrue((self.path / "out/compare.html").stat().st_size > 1000)

    def test_estimate_and_reference_have_the_order_that_ate_has(self):
        truth, trajectory = walk(), walk(200, error_rad=2e-3)
        named = tutti.compare(estimate=trajectory, reference=truth).json()
        self.assertNotEqual(named, tutti.compare(estimate=truth, reference=trajectory).json())
        self.assertEqual(tutti.compare(trajectory, truth).json(), named)
        self.assertAlmostEqual(tutti.ate(trajectory, truth).rmse_m, tutti.compare(estimate=trajectory, reference=truth).before.rmse_m, 3)

    def test_wrong_numbers_are_refused(self):
        self.refuses("tolerance_m|expected", tutti.compare, estimate=walk(), reference=walk(), tolerance_m=-1.0)
        self.refuses("tolerance_m|nan", tutti.compare, estimate=walk(), reference=walk(), tolerance_m=float("nan"))
        self.refuses("0 of B's poses|expected at least 2", tutti.compare, estimate=walk(start_s=0.0), reference=walk())


if __name__ == "__main__":
    run()
