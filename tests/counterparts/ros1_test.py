#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bags of a real ROS 1, read by Tutti, and bags of Tutti's tests, read by ROS 1: run by scripts/test_ros1.sh.

usage: ros1_test.py BUILD_DIR SOURCE_DIR ROOT_WITH_ROS_1 [CLASS.TEST...]
"""
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import genpy.dynamic
import rosbag
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

BUILD, SOURCE, ROOT = map(pathlib.Path, sys.argv[1:4])
sys.path.append(str(SOURCE / "ros2/tutti_ros/test"))
import mcap_reader  # noqa: E402
import ros_stub  # noqa: E402

TUTTI = BUILD / "apps/tutti/tutti"
PATIENCE_S = 60.0
KINDS = {"odom": Odometry, "points": PointCloud2, "tf": TFMessage, "tf_static": TFMessage, "truth": PoseStamped}
LIVOX = genpy.dynamic.generate_dynamic("livox_ros_driver/CustomMsg", f"""std_msgs/Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
CustomPoint[] points
{"=" * 80}
MSG: livox_ros_driver/CustomPoint
uint32 offset_time
float32 x
float32 y
float32 z
uint8 reflectivity
uint8 tag
uint8 line
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
""")


def copied(said, out):
    """ROS 1's message with the content of ROS 2's, whose fields have the same names."""
    for _, field in said.fields_:
        value = getattr(said, field)
        if field == "stamp":
            out.stamp = rospy.Time(value.sec, value.nanosec)
        elif hasattr(value, "fields_"):
            copied(value, getattr(out, field))
        elif isinstance(value, list) and value and hasattr(value[0], "fields_"):
            made = {"transforms": "geometry_msgs.msg.TransformStamped", "fields": "sensor_msgs.msg.PointField"}[field]
            module, name = made.rsplit(".", 1)
            setattr(out, field, [copied(one, getattr(sys.modules[module], name)()) for one in value])
        else:
            setattr(out, field, bytes(value) if field == "data" else value)
    return out


def livox_of(cloud):
    """The same points as a Livox says them: times count up from the stamp, which is the first point's."""
    points = list(struct.iter_unpack("<ffff", cloud.data))
    first_s = min(point[3] for point in points)
    out = LIVOX["livox_ros_driver/CustomMsg"]()
    out.header.stamp, out.header.frame_id = cloud.header.stamp + rospy.Duration(first_s), cloud.header.frame_id
    out.timebase, out.point_num = out.header.stamp.to_nsec(), len(points)
    out.rsvd = b"\0\0\0"
    for x, y, z, time_s in points:
        point = LIVOX["livox_ros_driver/CustomPoint"]()
        point.offset_time, point.x, point.y, point.z = round(1e9 * (time_s - first_s)), x, y, z
        out.points.append(point)
    return out


def run(*words):
    done = subprocess.run([*map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.stdout}{done.stderr}")
    return done.stdout


class Ros1(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        small = ["source=simulation", "simulation.world.network={rows: 2, columns: 2, block_m: 10.0, jitter_m: 1.0}",
                 "simulation.lidar.rays_share=0.4", "simulation.robots.0.walk.duration_s=40",
                 "simulation.robots.1.walk.duration_s=40"]
        run(TUTTI, "simulate", SOURCE / "missions/demo.yaml", "-o", cls.path, *(f"--set={s}" for s in small))
        cls.messages = {name: cls.converted(name) for name in ("alpha", "bravo")}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def converted(cls, robot):
        """[(topic, message, time)] of the bag that `tutti simulate` wrote, in its order."""
        out, now = [], rospy.Time(1)
        for topic, cdr in mcap_reader.messages((cls.path / robot / f"{robot}_0.mcap").read_bytes()):
            kind = KINDS.get(topic.rsplit("/", 1)[1])
            if kind is None:
                continue
            message = copied(ros_stub.decode(kind._type, cdr), kind())
            header = message.transforms[0].header if kind is TFMessage else message.header
            now = max(now, header.stamp)
            out.append((topic, message, now))
        return out

    def map_of(self, name, bags):
        """Closures and poses that a run ends with."""
        out = self.path / name
        run(TUTTI, "run", *(f"--bag={robot}={bag}" for robot, bag in bags.items()), "--out", out)
        return {file.name: file.read_text() for file in [*sorted(out.glob("*_server.tum")), out / "graph.g2o"]}

    def write(self, name, messages, **how):
        path = self.path / name
        with rosbag.Bag(str(path), "w", **how) as bag:
            for topic, message, when in messages:
                bag.write(topic, message, when)
        return path

    def test_what_its_python_writes_gives_the_map_of_ros_2s_bags(self):
        expected = self.map_of("ros2", {name: self.path / name for name in self.messages})
        self.assertTrue(any(len(text.splitlines()) > 4 for text in expected.values()), expected.keys())
        for compression in ("none", "bz2", "lz4"):
            bags = {name: self.write(f"{name}_{compression}.bag", said, compression=compression, chunk_threshold=200_000)
                    for name, said in self.messages.items()}
            self.assertEqual(self.map_of(f"ros1_{compression}", bags), expected, compression)

    def test_scans_of_a_livox_are_those_of_a_cloud(self):
        bags = {}
        for name, said in self.messages.items():
            livox = [(topic, livox_of(m) if topic.endswith("/points") else m, when) for topic, m, when in said]
            bags[name] = self.write(f"{name}_livox.bag", livox, compression="lz4")
        info = run(TUTTI, "bag", "info", bags["alpha"])
        self.assertIn("livox_ros_driver/msg/CustomMsg", info)
        ends = {name: self.map_of(name, of) for name, of in (
            ("livox", bags), ("clouds", {name: self.path / name for name in self.messages}))}
        lines = {name: sum(len(text.splitlines()) for text in end.values()) for name, end in ends.items()}
        self.assertLess(abs(lines["livox"] - lines["clouds"]), 0.1 * lines["clouds"], lines)

    def test_what_rosbag_records_is_read(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_HOSTNAME="127.0.0.1")
        master = subprocess.Popen([sys.executable, ROOT / "usr/bin/rosmaster", "--core", "-p", str(port)],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(lambda: (master.terminate(), master.wait()))
        self.wait_for(lambda: socket.create_connection(("127.0.0.1", port), 1.0).close() is None, "rosmaster")
        rospy.init_node("robot", disable_signals=True, disable_rosout=True)
        self.addCleanup(rospy.signal_shutdown, "the test has ended")
        said = self.messages["alpha"][:1500]
        topics = {topic: type(message) for topic, message, _ in said}
        publishers = {topic: rospy.Publisher(topic, kind, queue_size=2000) for topic, kind in topics.items()}
        bag = self.path / "recorded.bag"
        recorder = subprocess.Popen([ROOT / "usr/lib/rosbag/record", "-O", str(bag), "--lz4", "-b", "0", *topics])
        self.addCleanup(lambda: recorder.poll() is None and recorder.kill())
        self.wait_for(lambda: all(p.get_num_connections() > 0 for p in publishers.values()), "rosbag record")
        for topic, message, _ in said:
            publishers[topic].publish(message)
            time.sleep(0.002)
        time.sleep(2.0)
        recorder.send_signal(signal.SIGINT)
        self.assertEqual(recorder.wait(PATIENCE_S), 0)
        info = run(TUTTI, "bag", "info", bag)
        for topic, kind in topics.items():
            count = sum(1 for of, _, _ in said if of == topic)
            self.assertRegex(info, rf"(?m)^\s*{re.escape(topic)}\s.*\b{count}\b", info)

    def test_rosbag_reads_what_tests_write(self):
        info = f"{sys.executable} {ROOT / 'usr/bin/rosbag'} info"
        done = run("env", f"TUTTI_ROSBAG_INFO={info}", BUILD / "src/tutti/bags/test_bags",
                   "--gtest_filter=Ros1.ARealRosbagReadsWhatTestsWrite")
        self.assertIn("[  PASSED  ] 1 test", done)

    def wait_for(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                if condition():
                    return
            except OSError:
                pass
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]], verbosity=2)
