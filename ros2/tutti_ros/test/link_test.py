# SPDX-License-Identifier: BSD-3-Clause
"""Sending to a robot, and sending again: run by tutti_ros_test.py."""
import struct
import unittest

from made_messages import cloud, fix, odometry, pose_at
from tutti_ros.diagnosis import ERROR, OK, WARN, diagnosis
from tutti_ros.link import HISTORY_NS, Feed, Link, frame, stamp_ns
from tutti_ros.node import CLOUD, ODOMETRY

FIRST_NS, STEP_NS = 10**12, 10**8


def at(i):
    return FIRST_NS + i * STEP_NS


class Reconnecting(unittest.TestCase):
    """The state machine alone: what it sends and sends again."""

    def welcome(self, link, last_ns=None, takes=("hello", "odometry", "raw")):
        self.assertEqual(self.parse(link.connected())[0].WhichOneof("what"), "hello")
        self.assertEqual(link.next_frame(), b"")  # not before the robot's answer
        for byte in frame(welcome=Feed.Welcome(takes=takes, has_odometry=last_ns is not None, last_stamp_ns=last_ns or 0)):
            link.hear(bytes([byte]))  # however it comes
        self.assertEqual(link.state, "feeding")

    def parse(self, data):
        out = []
        while data:
            size, = struct.unpack_from("<I", data)
            out.append(Feed.FromString(data[4:4 + size]))
            data = data[4 + size:]
        return out

    def said(self, link):
        """(topic, how many steps after the first) of each message."""
        out = b""
        while more := link.next_frame():
            out += more
        return [(one.raw.topic.decode(), (stamp_ns(one.raw.data) - FIRST_NS) // STEP_NS) for one in self.parse(out)]

    def odometry(self, *steps):
        return [("odom", i) for i in steps]

    def correct(self, link, i, stored=None):
        link.hear(frame(correction=Feed.Correction(stamp_ns=at(i), has_stored=stored is not None,
                                                   stored_stamp_ns=at(stored or 0))))

    def add(self, link, *steps):
        for i in steps:
            link.add("odom", ODOMETRY, odometry(at(i), pose_at(i)), "odometry")

    def add_scan(self, link, i, points=2):
        link.add("points", CLOUD, cloud([(n, 7, [1.0] * points) for n in "xyz"], stamp_ns=at(i)), "scans")

    def test_what_is_published_and_not_heard_is_counted(self):
        link = Link()
        self.add(link, *(i for i in range(100) if i < 20 or i % 3))
        self.assertEqual(link.counts["odometry_missed"], 26)  # the last of all has none behind it
        self.add(link, 1000)
        self.assertEqual(link.counts["odometry_missed"], 26, "a pause")
        for i in range(40):
            if i < 20 or i % 3:
                self.add_scan(link, i)
        self.assertEqual(link.counts["scans_missed"], 6)

    def filled(self, count=10, **limits):
        link = Link(**limits)
        self.add(link, *range(count))
        return link

    def test_everything_is_said_to_a_robot_that_knows_nothing(self):
        link = self.filled()
        self.welcome(link)
        self.assertEqual(self.said(link), self.odometry(*range(10)))
        self.add(link, 10)
        self.assertEqual(self.said(link), self.odometry(10))
        self.assertEqual(link.counts["odometry"], 11)

    def test_goes_on_behind_what_the_robot_has(self):
        """With the odometry of two seconds before: the robot's program may be another one."""
        link = self.filled(50)
        self.add_scan(link, 38)
        self.add_scan(link, 29)
        self.add_scan(link, 41)
        self.welcome(link, at(40))
        self.assertEqual(self.said(link), self.odometry(*range(20, 50)) + [("points", 38), ("points", 41)])

    def test_what_a_killed_robot_lost_is_said_again(self):
        link = self.filled(60)
        self.welcome(link)
        self.said(link)
        self.correct(link, 59, stored=50)
        self.assertEqual(link.kept[0].stamp_ns, at(50) - HISTORY_NS)
        waits = [link.lost("killed") for _ in range(8)]
        self.assertEqual(waits[:3] + waits[-1:], [0.25, 0.5, 1.0, 5.0])
        self.assertEqual(link.why, "killed")
        self.add(link, 60)  # while away
        self.welcome(link, at(50))
        self.assertEqual(self.said(link), self.odometry(*range(30, 61)))
        self.assertEqual(link.lost("again"), 0.25)

    def test_what_is_of_a_clock_before_is_forgotten(self):
        link = self.filled()
        self.welcome(link)
        self.add(link, -100, -99, -98)
        self.said(link)
        self.correct(link, 9)
        self.assertEqual(len(link.kept), 13)
        self.correct(link, -100)  # the robot has begun anew
        self.assertEqual([sample.stamp_ns for sample in link.kept], [at(-100), at(-99), at(-98)])

    def test_transforms_and_calibrations_are_said_on_every_connection(self):
        link = Link()
        for cdr in (b"\0\1\0\0 first", b"\0\1\0\0 second", b"\0\1\0\0 first"):
            link.add_lasting("/tf_static", "tf2_msgs/msg/TFMessage", cdr, key=cdr)
            link.add_lasting("camera_info", "sensor_msgs/msg/CameraInfo", cdr)
        for i in range(150):
            link.add_moving("/tf", "tf2_msgs/msg/TFMessage", b"\0\1\0\0%d" % i)
        link.add_once("battery_state", "sensor_msgs/msg/BatteryState", b"")  # of which nobody wants to know later
        self.add(link, 0)
        expected = [("/tf_static", b" second"), ("/tf_static", b" first"), ("camera_info", b" first")]
        for _ in range(2):
            self.welcome(link)
            frames = [self.parse(link.next_frame())[0].raw for _ in range(103 + 1)]
            self.assertEqual([(raw.topic.decode(), raw.data[4:]) for raw in frames[:3]], expected)
            self.assertEqual([raw.data[4:] for raw in (frames[3], frames[102])], [b"50", b"149"])
            self.assertEqual(frames[103].topic, b"odom")
            self.assertEqual(link.next_frame(), b"")
            link.lost("killed")

    def test_memory_is_bounded(self):
        link = self.filled(20, most_samples=5)
        self.assertEqual(len(link.kept), 5)
        self.assertEqual(link.counts["forgotten_while_away"], 15)
        self.welcome(link)
        self.assertEqual(self.said(link), self.odometry(*range(15, 20)))

    def test_too_many_scans_go_before_any_odometry(self):
        link = self.filled(most_bytes=10_000)
        for i in range(10):
            self.add_scan(link, i, points=300)
        self.assertLessEqual(link.heavy_bytes, 10_000)
        self.assertEqual(link.counts["forgotten_while_away"], 8)
        self.welcome(link)
        self.assertEqual(self.said(link), self.odometry(*range(10)) + [("points", 8), ("points", 9)])
        self.correct(link, 9, stored=60)
        self.assertEqual((len(link.kept), len(link.heavy), link.heavy_bytes), (0, 0, 0))

    def test_refusals_and_garbage(self):
        link = self.filled()
        link.connected()
        link.hear(frame(closed=Feed.Closed(why="a second feeder")))
        link.lost("the robot has ended")
        self.assertEqual((link.state, link.why), ("refused", "a second feeder"))
        link.connected()
        with self.assertRaisesRegex(ValueError, "no Tutti robot"):
            link.hear(b"HTTP/1.1 400")
        with self.assertRaisesRegex(ValueError, "older than this node"):
            self.welcome(link, takes=("hello", "odometry", "health"))
        with self.assertRaisesRegex(ValueError, "expected at most 16777216"):
            link.add("image", "sensor_msgs/msg/Image", bytes(17 << 20), "images")
        with self.assertRaisesRegex(ValueError, "a message of 3 bytes"):
            link.add("fix", "sensor_msgs/msg/NavSatFix", b"\0\1\0", "fixes")
        self.welcome(link)
        self.said(link)
        link.end_recording()
        self.assertEqual(self.parse(link.next_frame())[0].WhichOneof("what"), "end_of_recording")

    def test_stamps_of_either_byte_order(self):
        self.assertEqual(stamp_ns(fix(7 * 10**9 + 5)), 7 * 10**9 + 5)
        self.assertEqual(stamp_ns(b"\0\0\0\0" + struct.pack(">iI", 7, 5)), 7 * 10**9 + 5)

    def test_diagnosis(self):
        link = self.filled()
        self.assertEqual(diagnosis(link, None, None, [])[0], ERROR)
        self.welcome(link)
        self.assertEqual(diagnosis(link, None, None, [])[:2], (WARN, "no odometry was said yet"))
        self.said(link)
        self.assertEqual(diagnosis(link, None, None, [])[0], OK)
        self.assertEqual(diagnosis(link, None, Feed.Situation(alert=[Feed.Alert(text="disk full")]), [])[:2], (WARN, "disk full"))
        self.assertEqual(diagnosis(link, None, None, [], is_alive=False)[0], ERROR)
        reported = [Feed.Value(name="battery_percent", text="41"), Feed.Value(name="odometry", text="not this")]
        values = diagnosis(link, Feed.Correction(in_map=True), Feed.Situation(status=reported), [])[2]
        self.assertEqual((values["battery_percent"], values["odometry"], values["in_map"]), ("41", "10", "True"))
