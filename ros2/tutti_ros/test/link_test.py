# SPDX-License-Identifier: BSD-3-Clause
"""What is said to a robot, and said again: run by tutti_ros_test.py."""
import struct
import unittest

import numpy as np
from made_messages import pose_at
from tutti_ros import from_ros, poses
from tutti_ros.link import Feed, Link, feed_pose, frame, scan_frame
from tutti_ros.situation import ERROR, OK, WARN, OnMap, diagnosis

NOISE = from_ros.OdometryNoise()


class Reconnecting(unittest.TestCase):
    """The state machine alone: what it says and says again."""

    def welcome(self, link, last_ns=None, takes=("hello", "odometry", "scan", "fix", "images", "imu")):
        self.assertEqual(self.parse(link.connected())[0].WhichOneof("what"), "hello")
        self.assertEqual(link.next_frame(), b"")  # not before the robot's answer
        said = frame(welcome=Feed.Welcome(takes=takes, has_odometry=last_ns is not None, last_stamp_ns=last_ns or 0,
                                          T_map_odom=feed_pose(poses.IDENTITY)))
        for byte in said:  # however it comes
            link.hear(bytes([byte]))
        self.assertEqual(link.state, "feeding")

    def parse(self, data):
        out = []
        while data:
            size, = struct.unpack_from("<I", data)
            out.append(Feed.FromString(data[4:4 + size]))
            data = data[4 + size:]
        return out

    def said(self, link):
        out = b""
        while more := link.next_frame():
            out += more
        return [getattr(message, message.WhichOneof("what")) for message in self.parse(out)]

    def stored(self, link, stamp_ns):
        link.hear(frame(correction=Feed.Correction(has_stored=True, stored_stamp_ns=stamp_ns)))

    def filled(self, count=10):
        link = Link(NOISE)
        for i in range(count):
            link.add_odometry(1000 + i * 10**8, pose_at(i))
        return link

    def test_everything_is_said_to_a_robot_that_knows_nothing(self):
        link = self.filled()
        self.welcome(link)
        self.assertEqual([s.stamp_ns for s in self.said(link)], [1000 + i * 10**8 for i in range(10)])
        link.add_odometry(10**10, pose_at(10))
        self.assertEqual([s.stamp_ns for s in self.said(link)], [10**10])

    def test_one_stamp_far_ahead_shuts_nothing_out(self):
        link = self.filled()
        self.welcome(link)
        self.said(link)
        with self.assertRaisesRegex(ValueError, "is 3600 s ahead of 900001000 ns: more than 60 s, so it counts only if"):
            link.add_odometry(1000 + 9 * 10**8 + 3600 * 10**9, pose_at(10))
        with self.assertRaisesRegex(ValueError, "3600 s ahead of odometry's newest, expected at most 60 s"):
            link.add_fix(1000 + 9 * 10**8 + 3600 * 10**9, (46.5, 7.9, 600.0), [1.0] * 3, (0.0, 0.0, 0.0))
        link.add_odometry(1000 + 10 * 10**8, pose_at(10))
        link.add_fix(1000 + 10 * 10**8, (46.5, 7.9, 600.0), [1.0] * 3, (0.0, 0.0, 0.0))
        self.assertEqual([s.stamp_ns for s in self.said(link)], [1000 + 10**9] * 2)

    def test_a_step_ahead_that_the_next_stamp_confirms_is_said(self):
        link = self.filled()
        self.welcome(link)
        self.said(link)
        stamps_ns = [3600 * 10**9, 3600 * 10**9 + 10**8]
        with self.assertRaises(ValueError):
            link.add_odometry(stamps_ns[0], pose_at(10))
        link.add_odometry(stamps_ns[1], pose_at(11))
        self.assertEqual([s.stamp_ns for s in self.said(link)], stamps_ns)

    def test_a_clock_that_begins_anew_is_said_after_two_seconds(self):
        link = self.filled()
        self.welcome(link)
        self.said(link)
        self.stored(link, 1000 + 9 * 10**8)
        taken = []
        for i in range(60):
            try:
                stamp_ns = i * 10**8 // 2 - 10**10
                link.add_odometry(stamp_ns, pose_at(i))
                taken.append(stamp_ns)
            except ValueError as error:
                self.assertIn("expected stamps to increase", str(error))
        self.assertEqual(len(taken), 60 - 41)
        said = self.said(link)
        self.assertEqual([s.stamp_ns for s in said], taken)
        self.assertEqual(said[0].increment_covariance[0], 1.0)  # it does not know how far the robot has come
        self.assertEqual([s.stamp_ns for s in link.kept], taken)

    def test_goes_on_behind_what_the_robot_has(self):
        link = self.filled()
        link.add_scan(1000 + 4 * 10**8, np.ones((2, 3), np.float32), np.zeros(2, np.float32))
        self.welcome(link, 1000 + 4 * 10**8)
        said = self.said(link)
        self.assertEqual([s.stamp_ns for s in said], [1000 + i * 10**8 for i in range(5, 10)] + [1000 + 4 * 10**8])
        np.testing.assert_allclose(said[0].increment_covariance[0], 0.02**2 + 0.003**2 * 0.1)  # 1 m from the one it has
        self.assertEqual(list(said[-1].xyz), [1.0] * 6)

    def test_what_a_killed_robot_lost_is_said_again(self):
        link = self.filled()
        self.welcome(link)
        self.said(link)
        self.stored(link, 1000 + 3 * 10**8)
        self.assertEqual(len(link.kept), 7)
        waits = [link.lost("killed") for _ in range(8)]
        self.assertEqual(waits[:3] + waits[-1:], [0.25, 0.5, 1.0, 5.0])
        self.assertEqual(link.why, "killed")
        link.add_odometry(10**10, pose_at(10))  # while away
        self.welcome(link, 1000 + 3 * 10**8)
        self.assertEqual([s.stamp_ns for s in self.said(link)], [1000 + i * 10**8 for i in range(4, 10)] + [10**10])
        self.assertEqual(link.lost("again"), 0.25)

    def test_memory_is_bounded_and_increments_stay_whole(self):
        link = self.filled(3)
        link.most_samples = 5
        self.welcome(link)
        self.said(link)
        link.lost("away")
        for i in range(3, 20):
            link.add_odometry(1000 + i * 10**8, pose_at(i))
        self.assertEqual(len(link.kept), 5)
        self.assertEqual(link.counts["forgotten_while_away"], 15)
        self.welcome(link)
        first = self.said(link)[0]
        self.assertEqual(first.stamp_ns, 1000 + 15 * 10**8)
        self.assertAlmostEqual(first.increment_covariance[0], 15 * (0.02**2 + 0.003**2 * 0.1))
        link.most_bytes = 100
        for i in range(3):
            link.add_scan(10**12 + i, np.ones((5, 3), np.float32), None)
        self.assertLessEqual(link.framed_bytes, 100)

    def test_too_many_images_go_before_any_odometry(self):
        link = self.filled()
        link.most_bytes = 1000
        for i in range(10):
            link.add_images(1000 + i * 10**8, [(0, True, bytes(300))], None)
        self.assertLessEqual(link.framed_bytes, 1000)
        self.assertEqual(link.counts["forgotten_while_away"], 7)
        self.welcome(link)
        said = self.said(link)
        self.assertEqual(len([one for one in said if isinstance(one, Feed.Odometry)]), 10)
        self.assertEqual([one.stamp_ns for one in said[10:]], [1000 + i * 10**8 for i in (7, 8, 9)])
        for i in range(5):
            link.add_images(10**10 + i, [(0, True, bytes(300))], None)  # before the first is said
        self.assertEqual([one.stamp_ns for one in self.said(link)], [10**10 + i for i in (2, 3, 4)])
        self.stored(link, 10**11)
        self.assertEqual((len(link.kept), len(link.framed), link.framed_bytes), (0, 0, 0))

    def test_images_and_imu_are_said_again_behind_what_the_robot_has(self):
        link = self.filled(3)
        sensors = Feed.Sensors()
        sensors.imu.SetInParent()
        link.set_sensors(sensors)
        images = [(0, True, b"left"), (1, False, b"a file")]
        for i in range(3):
            link.add_images(1000 + i * 10**8, images, b"depth" if i == 2 else None)
            link.add_imu([999 + i * 10**8, 1000 + i * 10**8], [1.0] * 6, [2.0] * 6)
        hello = self.parse(link.connected())[0].hello
        self.assertTrue(hello.sensors.scans and hello.sensors.HasField("imu"))
        self.welcome(link, 1000 + 10**8)
        said = self.said(link)  # what was never said is not too late yet
        self.assertEqual([type(one).__name__ for one in said], ["Odometry"] + ["Images", "Imu"] * 3)
        link.lost("killed")
        self.welcome(link, 1000 + 10**8)
        said = self.said(link)
        self.assertEqual([type(one).__name__ for one in said], ["Odometry", "Images", "Imu"])
        self.assertEqual([(one.camera, one.encoding, one.data) for one in said[1].image],
                         [(0, Feed.Image.RAW, b"left"), (1, Feed.Image.FILE, b"a file")])
        self.assertEqual((said[1].depth.encoding, said[1].depth.data), (Feed.Image.RAW, b"depth"))
        self.assertEqual((list(said[2].stamp_ns), list(said[2].gyro)), ([999 + 2 * 10**8, 1000 + 2 * 10**8], [1.0] * 6))
        self.assertEqual((link.counts["images"], link.counts["imu"]), (4, 8))
        link.lost("killed")
        self.welcome(link, 1000, takes=("hello", "odometry", "scan", "fix"))
        self.assertEqual([type(one).__name__ for one in self.said(link)], ["Odometry", "Odometry"])
        with self.assertRaisesRegex(ValueError, "older than images: it takes none"):
            link.add_images(10**10, images, None)

    def test_an_unknown_stretch_is_stated_as_one(self):
        link = self.filled(2)
        self.welcome(link, 500)
        self.assertEqual(self.said(link)[0].increment_covariance[0], 1.0)

    def test_fixes_go_to_robots_that_take_them(self):
        fix = (46.5, 7.9, 600.0), [1.0] * 9, (0.1, 0.2, 0.3)
        link = self.filled(3)
        link.add_fix(1000 + 10**8, *fix)
        with self.assertRaisesRegex(ValueError, "expected stamps to increase"):
            link.add_fix(1000 + 10**8, *fix)
        self.welcome(link, takes=())
        self.assertEqual(len(self.said(link)), 3)  # of before there were any
        with self.assertRaisesRegex(ValueError, "it takes none"):
            link.add_fix(1001 + 10**8, *fix)
        link.lost("killed")
        self.welcome(link)
        said = self.said(link)[-1]
        self.assertEqual((said.stamp_ns, said.latitude_deg, said.longitude_deg, said.height_m), (1000 + 10**8, *fix[0]))
        self.assertEqual((list(said.covariance_m2), list(said.p_body_antenna)), (fix[1], [0.1, 0.2, 0.3]))
        self.assertEqual(link.counts["fixes"], 1)

    def test_refusals_and_garbage(self):
        link = self.filled()
        with self.assertRaisesRegex(ValueError, "expected stamps to increase"):
            link.add_odometry(1000, pose_at(1))
        link.connected()
        link.hear(frame(closed=Feed.Closed(why="a second feeder")))
        link.lost("the robot has ended")
        self.assertEqual((link.state, link.why), ("refused", "a second feeder"))
        link.connected()
        with self.assertRaisesRegex(ValueError, "no Tutti robot"):
            link.hear(b"HTTP/1.1 400")
        self.welcome(link)
        self.said(link)
        link.end_recording()
        self.assertIsInstance(self.said(link)[0], Feed.EndOfRecording)

    def test_a_scans_frame_is_protobufs(self):
        rng = np.random.default_rng(1)
        for count in (0, 1, 40, 5000):
            points = rng.normal(size=(count, 3)).astype(np.float32)
            for ages in (None, rng.uniform(size=count).astype(np.float32)):
                whole = Feed.Scan(stamp_ns=10**18, xyz=points.ravel(), age_s=[] if ages is None else ages)
                got, = self.parse(scan_frame(10**18, points, ages))
                self.assertEqual(got, Feed(scan=whole))
        with self.assertRaisesRegex(ValueError, "expected at most 16777216"):
            scan_frame(1, np.zeros((1_500_000, 3), np.float32), None)

    def test_the_battery_is_said_once_to_who_takes_it(self):
        for takes, said in (("hello", "odometry", "health"), 1), (("hello", "odometry"), 0):
            link = Link(NOISE)
            link.set_health(24.5, float("nan"))
            self.welcome(link, takes=takes)
            frames = self.parse(link.next_frame())
            self.assertEqual([message.WhichOneof("what") for message in frames], ["health"] * said)
            if frames:
                self.assertEqual(frames[0].health.battery_v, 24.5)
                self.assertFalse(frames[0].health.HasField("battery_percent"))
            self.assertEqual(link.next_frame(), b"")

    def test_diagnosis_has_what_the_robot_reports_of_itself(self):
        on_map = OnMap()
        on_map.take("situation", Feed.Situation(status=[Feed.Value(name="battery_percent", text="41"),
                                                        Feed.Value(name="odometry", text="not this")]))
        _, _, values = diagnosis(self.filled(), on_map, [])
        self.assertEqual(values["battery_percent"], "41")
        self.assertNotEqual(values["odometry"], "not this")

    def test_diagnosis(self):
        link, on_map = self.filled(), OnMap()
        self.assertEqual(diagnosis(link, on_map, [])[0], ERROR)
        self.welcome(link)
        self.assertEqual(diagnosis(link, on_map, [])[:2], (WARN, "no odometry was said yet"))
        self.said(link)
        self.assertEqual(diagnosis(link, on_map, [])[0], OK)
        on_map.take("situation", Feed.Situation(alert=[Feed.Alert(text="disk full")]))
        self.assertEqual(diagnosis(link, on_map, [])[:2], (WARN, "disk full"))
        self.assertEqual(diagnosis(link, on_map, [], is_alive=False)[0], ERROR)

    def test_the_way_and_what_came_since(self):
        on_map = OnMap()
        for i in range(10):
            on_map.add_odometry(i, pose_at(i))
            on_map.add_odometry(i, pose_at(i + 0.01))  # not worth a place
        on_map.take("way", Feed.Way(stamp_ns=[0, 5], T_map_body=[*pose_at(0), *pose_at(50)]))
        on_map.take("correction", Feed.Correction(T_map_odom=feed_pose((0.0, 7.0, 0.0, 0.0, 0.0, 0.0, 1.0))))
        path = on_map.path()
        self.assertEqual([stamp for stamp, _ in path], [0, 5, 6, 7, 8, 9])
        self.assertEqual((path[1][1][0], path[2][1][:2]), (50.0, (6.0, 7.0)))
