# SPDX-License-Identifier: BSD-3-Clause
"""What messages say, of real CDR bytes: run by tutti_ros_test.py."""
import math
import pathlib
import random
import struct
import subprocess
import tempfile
import unittest

import mcap_reader
import numpy as np
import ros_stub
from made_messages import cloud, fix, livox, odometry
from paths import SHARED, SOURCE, TUTTI
from tutti_ros import from_ros, poses
from tutti_ros.link import Link

NOISE = from_ros.OdometryNoise()


class Conversion(unittest.TestCase):
    def test_odometry(self):
        pose = (1.5, -2.0, 0.25, 0.0, 0.0, math.sin(0.3), math.cos(0.3))
        stamp_ns, got = from_ros.odometry_of(odometry(1_767_225_600_123_456_789, pose))
        self.assertEqual(stamp_ns, 1_767_225_600_123_456_789)
        np.testing.assert_allclose(got, pose, atol=1e-15)
        for bad in ((math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (0.0,) * 7):
            with self.assertRaisesRegex(ValueError, "that is none"):
                from_ros.odometry_of(odometry(1, bad))

    def test_fixes(self):
        self.assertEqual(from_ros.fix_of(fix(7)), (7, (46.5, 7.9, 600.0), [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 4.0]))
        self.assertIsNone(from_ros.fix_of(fix(7, math.nan, status=-1)))
        for variances in ((0.0, 0.0, 0.0), (-1.0, 1.0, 1.0)):
            self.assertEqual(from_ros.fix_of(fix(7, variances=variances))[2], [])
        unknown = fix(7)
        unknown.position_covariance_type = 0
        self.assertEqual(from_ros.fix_of(unknown)[2], [])
        with self.assertRaisesRegex(ValueError, "that is none"):
            from_ros.fix_of(fix(7, math.nan))

    def test_noise_adds_up_along_the_way(self):
        turned = lambda a: (2.0 * a, 0.0, 0.0, 0.0, 0.0, math.sin(a / 2), math.cos(a / 2))
        whole = NOISE.variances(turned(0.0), turned(0.2), 1.0)
        halves = [NOISE.variances(turned(0.1 * i), turned(0.1 * (i + 1)), 0.5) for i in range(2)]
        np.testing.assert_allclose(whole, np.sum(halves, axis=0))
        self.assertAlmostEqual(whole[0], 0.02**2 * 0.4 + 0.001**2 * math.degrees(0.2) + 0.003**2)

    def test_clouds_of_every_layout(self):
        draw = random.Random(1)
        xyz = [[draw.uniform(-20.0, 20.0) for _ in range(12)] for _ in range(3)]
        expected = np.array(xyz, np.float32).T
        for datatype in (7, 8):
            for rows, order, padding in ((1, "<", 0), (3, "<", 5), (4, ">", 16)):
                columns = [("z", datatype, xyz[2]), ("x", datatype, xyz[0]), ("y", datatype, xyz[1])]
                points, times = from_ros.points_of(cloud(columns, rows, order, padding))
                np.testing.assert_array_equal(points, expected)
                self.assertIsNone(times)
        xyz[1][4] = math.nan
        points, _ = from_ros.points_of(cloud([(n, 7, xyz[i]) for i, n in enumerate("xyz")]))
        np.testing.assert_array_equal(points, np.delete(expected, 4, axis=0))
        xyz[1][4] = 1.0
        for row in xyz:
            row[7] = 0.0
        points, _ = from_ros.points_of(cloud([(n, 7, xyz[i]) for i, n in enumerate("xyz")]))
        self.assertEqual(len(points), 11)  # one beam had no echo
        empty = cloud([(n, 7, []) for n in "xyz"])
        self.assertEqual(len(from_ros.scan_of(empty, poses.IDENTITY)[1]), 0)

    def test_bad_clouds_are_told(self):
        xyz = [(n, 7, [1.0, 2.0]) for n in "xyz"]
        with self.assertRaisesRegex(ValueError, "no field 'z'"):
            from_ros.points_of(cloud(xyz[:2]))
        for what, value, message in (("width", 3, "expected 1 rows of 3"), ("height", 2, "bytes of points"),
                                     ("point_step", 12, "of points of 12 bytes")):
            bad = cloud(xyz)
            setattr(bad, what, value)
            with self.assertRaisesRegex(ValueError, message):
                from_ros.points_of(bad)

    def test_times_of_points_in_every_unit(self):
        T_body_lidar = (1.0, 2.0, 3.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # 90 degrees about z
        stamp_ns, xyz = 1_767_225_600_500_000_000, [(n, 7, [1.0, 0.5, 2.0]) for n in "xyz"]
        after_s = [0.0, 0.03, 0.1]
        for name, datatype, numbers in (("t", 6, [0, 30_000_000, 100_000_000]), ("time", 7, after_s),
                                        ("offset_time", 6, [0, 30_000, 100_000]), ("t", 7, [0.0, 30.0, 100.0]),
                                        ("timestamp", 8, [stamp_ns * 1e-9 + x for x in after_s])):
            message = cloud(xyz + [(name, datatype, numbers)], stamp_ns=stamp_ns)
            got_ns, points, ages = from_ros.scan_of(message, T_body_lidar)
            self.assertLess(abs(got_ns - stamp_ns - 10**8), 1000, name)
            np.testing.assert_allclose(ages, [0.1, 0.07, 0.0], atol=1e-6, err_msg=name)
            np.testing.assert_allclose(points[0], [0.0, 3.0, 4.0], atol=1e-6)
            self.assertIsNone(from_ros.scan_of(message, T_body_lidar, deskewed=True)[2])
        for numbers in ([0.0, 2.0, 700.0], [5000.0, 5000.05, 5000.1]):
            with self.assertRaisesRegex(ValueError, "points' times go from"):
                from_ros.scan_of(cloud(xyz + [("t", 8, numbers)]), T_body_lidar)

    def test_a_livox_is_a_cloud_with_the_same_points_and_times(self):
        draw = random.Random(1)
        for count in (1, 2, 50):
            xyz = [[draw.uniform(-20.0, 20.0) for _ in range(count)] for _ in range(3)]
            times_ns = [draw.randrange(10**8) for _ in range(count)]
            expected = cloud([(n, 7, xyz[i]) for i, n in enumerate("xyz")] + [("offset_time", 6, times_ns)])
            for order in "<>":
                for frame_id in ("lidar", "livox_frame", "r1/livox"):
                    got = from_ros.cloud_of_livox(livox(list(zip(*xyz)), times_ns, 10**9, frame_id, order))
                    self.assertEqual(got.header.frame_id, frame_id)
                    for a, b in zip(from_ros.scan_of(got, poses.IDENTITY), from_ros.scan_of(expected, poses.IDENTITY)):
                        np.testing.assert_array_equal(a, b)

    def test_a_livox_that_lies_is_told(self):
        whole = livox([(1.0, 2.0, 3.0)] * 3, [0, 1, 10**8])
        for size in range(len(whole)):
            with self.assertRaises(ValueError):
                from_ros.points_of(from_ros.cloud_of_livox(whole[:size]))
        with self.assertRaisesRegex(ValueError, "3 points, expected 4 as point_num says"):
            from_ros.cloud_of_livox(whole.replace(struct.pack("<I", 3), struct.pack("<I", 4), 1))
        with self.assertRaisesRegex(ValueError, "bytes of points"):
            from_ros.points_of(from_ros.cloud_of_livox(whole.replace(struct.pack("<I", 3), b"\xff" * 4)))

    def test_covariance_of_the_body(self):
        """Against what perturbing T_map_odom does to the body, in the axes of the map."""
        rng = np.random.default_rng(1)
        unit = lambda: (lambda q: tuple(q / np.linalg.norm(q)))(rng.normal(size=4))
        T_map_odom, T_odom_body = ((*rng.normal(size=3), *unit()) for _ in range(2))
        T_map_body = poses.times(T_map_odom, T_odom_body)
        J, step = np.zeros((6, 6)), 1e-6
        for i in range(6):
            xi = step * np.eye(6)[i]
            small = (*xi[:3], *(0.5 * xi[3:]), 1.0)
            moved = poses.times(poses.times(T_map_odom, small), T_odom_body)
            turn = poses.rotation(moved) @ poses.rotation(T_map_body).T
            J[:, i] = [*(np.subtract(moved[:3], T_map_body[:3])), turn[2, 1], turn[0, 2], turn[1, 0]]
        J /= step
        C = np.diag([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
        got = poses.body_covariance_in_map(C.ravel(), T_odom_body, T_map_body)
        np.testing.assert_allclose(got, J @ C @ J.T, atol=1e-4)


class RealBytes(unittest.TestCase):
    def test_a_simulated_robots_bag(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([TUTTI, "simulate", SOURCE / "missions/demo.yaml", "-o", folder,
                                   "--set", "simulation.robots.0.walk.duration_s=1",
                                   "--set", "simulation.robots.1.walk.duration_s=1",
                                   "--set", "receivers=[{rate_hz: 1.0, sigma_m: 0.5}]"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            said = list(mcap_reader.messages((pathlib.Path(folder) / "alpha/alpha_0.mcap").read_bytes()))
        clouds = [ros_stub.decode("sensor_msgs/PointCloud2", cdr) for topic, cdr in said if topic == "/alpha/points"]
        self.assertGreater(len(clouds), 5)
        for message in clouds:
            stamp_ns, points, ages = from_ros.scan_of(message, poses.IDENTITY)
            self.assertGreater(len(points), 1000)
            self.assertEqual(len(points), len(ages))
            self.assertGreaterEqual(ages.min(), 0.0)
            self.assertLess(ages.max(), 0.2)
            self.assertLess(abs(stamp_ns - from_ros.nanoseconds(message.header.stamp)), 2 * 10**8)
        fixes = [from_ros.fix_of(ros_stub.decode("sensor_msgs/NavSatFix", cdr)) for topic, cdr in said
                 if topic == "/alpha/fix"]
        self.assertEqual(len(fixes), 2)
        self.assertAlmostEqual(fixes[0][1][0], 46.5, delta=0.01)
        self.assertEqual(fixes[0][2][0], 0.25)  # m^2
        stamps = [from_ros.odometry_of(ros_stub.decode("nav_msgs/Odometry", cdr))[0] for topic, cdr in said
                  if topic == "/alpha/odom"]
        self.assertEqual(stamps, sorted(set(stamps)))

    def test_a_bag_that_a_real_robot_recorded(self):
        bag = SHARED / "data/mcap/nav2_turtlebot.mcap"
        if not bag.exists():
            self.skipTest(f"{bag} is not here")
        odom = [cdr for topic, cdr in mcap_reader.messages(bag.read_bytes()) if topic == "/odom"]
        self.assertEqual(len(odom), 2639)
        link = Link(NOISE)
        for cdr in odom:
            message = ros_stub.decode("nav_msgs/Odometry", cdr)
            self.assertEqual(ros_stub.encode("nav_msgs/Odometry", message), cdr)  # the stub's types are ROS 2's
            link.add_odometry(*from_ros.odometry_of(message))
        self.assertEqual((message.header.frame_id, message.child_frame_id), ("odom", "base_link"))
