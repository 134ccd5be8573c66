# SPDX-License-Identifier: BSD-3-Clause
"""The node with cameras and an IMU on a stub of rclpy, with programs at the other end: run by tutti_ros_test.py."""
import collections
import re
import signal
import time
import unittest

import ros_stub
from made_messages import camera_info, image, imu, odometry, pose_at
from tutti_ros.link import stamp_ns
from programs import HAS_NATS, PATIENCE_S, WithPrograms

FLOWN = """
source: hall
hall:
  {cameras}
  robots:
    - {{name: alpha, flight: {{start_deg: 0.0, duration_s: {seconds}}}}}
    - {{name: bravo, flight: {{start_deg: 20.0, height_m: 2.0, duration_s: {seconds}}}}}
"""
SEEN = """
mission: seen
robots:
  - {name: alpha, bag: alpha}
  - {name: bravo, bag: bravo}
agent: {submap: {duration_s: 5.0, representative_distance_m: 0.3, visual: {send_imu: true}}}
tracking: {tracker: {descriptors: {kind: orb}}}
closures: {verifier: visual, visual: {max_hamming: 0.2}}
"""
TOPICS = ("odom", "imu", "camera0/image_raw", "camera0/camera_info", "camera1/image_raw", "camera1/camera_info",
          "depth/image_raw")


class Images(WithPrograms):
    def simulate(self, cameras, seconds):
        (self.path / "flown.yaml").write_text(FLOWN.format(cameras=cameras, seconds=seconds))
        (self.path / "seen.yaml").write_text(SEEN)
        self.run_tutti("simulate", self.path / "flown.yaml", "-o", self.path)
        return [self.path / "seen.yaml", "--data", self.path]

    def start_alone(self, mission):
        """Without a server: beside the bag of its name."""
        return self.start("robot", "--name", "alpha", "--bus", "nats://127.0.0.1:1", "--state", self.path / "alpha_state",
                          "--feed", self.path / "alpha.feed", "--stay", *mission)

    def fly(self, nodes, rate):
        """All that was recorded, in the order of time, at so many times real time."""
        begin, first_ns = time.monotonic(), None
        for name, node in nodes.items():
            self.place_sensors(name, node)
        flights = {name: self.recorded(name, TOPICS) for name in nodes}
        ahead = {name: next(flight) for name, flight in flights.items()}
        while ahead:
            name = min(ahead, key=lambda one: stamp_ns(ahead[one][1]))
            topic, message = ahead[name]
            first_ns = first_ns or stamp_ns(message)
            time.sleep(max(0.0, begin + (stamp_ns(message) - first_ns) * 1e-9 / rate - time.monotonic()))
            if topic in nodes[name].callbacks:
                nodes[name].callbacks[topic](message)
            ahead[name] = next(flights[name], None)
            ahead = {one: it for one, it in ahead.items() if it}

    def recorded_images(self, name):
        """How many times with images, and IMU samples."""
        counts = collections.Counter(topic for topic, _ in self.recorded(name, TOPICS))
        return counts["camera0/image_raw"], counts["imu"]

    def closures(self, map_file):
        """Submaps, and pairs of them with closures, of a map."""
        return re.findall(r"^submaps +.* robots.*|^found .*|^closures .*|^joint map .*", self.run_tutti("map", "info", map_file), re.M)

    @unittest.skipUnless(HAS_NATS, "nats-server is not installed")
    def test_two_stereo_flights_make_the_map_of_their_bags(self):
        mission = self.simulate("cameras: 2", 10)
        self.run_tutti("run", *mission, "--out", self.path / "out", "--map", self.path / "expected.tutti")
        expected = self.closures(self.path / "expected.tutti")
        self.assertGreater(int(re.search(r"closures between (\d+)", expected[1])[1]), 0)
        server, bus = self.start_server(*mission, "--rate", "4")
        nodes, robots = {}, []
        for name in ("alpha", "bravo"):
            robots.append(self.start("robot", "--name", name, "--bus", bus, "--state", self.path / f"of_{name}", "--feed",
                                     self.path / f"{name}.feed", *mission, "--rate", "4", "--session", "0"))
            nodes[name] = self.node(name, use_scans=False, use_fixes=False, imu="imu",
                                    images="camera0/image_raw,camera1/image_raw")
        self.wait_for(lambda: all(node.link.state == "feeding" for node in nodes.values()), "the robots")
        self.fly(nodes, 4.0)
        for node in nodes.values():
            node.callbacks["~/end_recording"](None, ros_stub.types.SimpleNamespace())
        for name, robot in zip(nodes, robots):
            self.wait_for(lambda: robot.poll() is not None, f"{name}'s end")
            self.assertEqual(robot.returncode, 0)
            fed = self.fed(f"of_{name}")
            self.assertEqual((fed["images"], fed["imu_samples"]), self.recorded_images(name))
            self.assertEqual(nodes[name].link.counts["refused"], 0, nodes[name].link.why)
            self.assertEqual(list(nodes[name].trouble), [])
        self.wait_for_map()
        server.send_signal(signal.SIGTERM)
        self.assertEqual(server.wait(PATIENCE_S), 0)
        self.assertEqual(self.closures(self.path / "server/map.tutti"), expected)
        self.assertEqual((nodes["alpha"].qos["camera0/image_raw"]["reliability"], nodes["alpha"].qos["imu"]["depth"]),
                         ("best effort", 2000))

    def test_depth_and_an_imu_with_one_camera(self):
        mission = self.simulate("depth: true", 3)
        self.start_alone(mission)
        node = self.node("alpha", use_scans=False, images="camera0/image_raw", depth="depth/image_raw", imu="imu")
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        self.fly({"alpha": node}, 2.0)
        images, samples = self.recorded_images("alpha")
        self.assertGreater(images, 20)
        self.wait_for(lambda: self.fed("alpha_state").get("images") == images, "images, counted by the robot")
        self.wait_for(lambda: self.fed("alpha_state").get("imu_samples") == samples, "samples, counted by the robot")
        self.assertEqual(node.link.counts["refused"], 0, node.link.why)
        self.assertEqual(list(node.trouble), [])

    def test_a_killed_robot_is_told_its_images_again(self):
        mission = self.simulate("cameras: 1", 3)
        robot = self.start_alone(mission)
        node = self.node("alpha", use_scans=False, images="camera0/image_raw", imu="imu")
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        said = [(topic, message) for topic, message in self.recorded("alpha", TOPICS) if topic in node.callbacks]

        def drive(messages):
            for topic, message in messages:
                node.callbacks[topic](message)
                time.sleep(0.002)

        self.place_sensors("alpha", node)
        drive(said[:len(said) // 2])
        self.wait_for(lambda: node.link.state == "feeding" and not node.link.waiting, "what was fed")
        robot.kill()
        self.wait_for(lambda: node.link.state == "away", "the end")
        drive(said[len(said) // 2:])
        before = node.link.counts["images"]
        self.start_alone(mission)
        again = lambda: node.link.counts["images"] - before
        at_least = self.recorded_images("alpha")[0] // 3
        self.wait_for(lambda: node.link.state == "feeding" and not node.link.waiting and
                      self.fed("alpha_state").get("images") == again() > at_least, "what was said again, counted by the robot")
        self.assertEqual(self.fed("alpha_state")["images_left_out"], 0)
        self.assertEqual(node.link.counts["refused"], 0, node.link.why)

    def test_what_is_not_wanted_is_not_subscribed_and_what_is_missing_is_said(self):
        topics = {"odom", "points", "fix"}
        self.assertTrue({"camera0/image_raw", "imu"}.isdisjoint(self.node("r2").callbacks))
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", images="camera0/image_raw,right/image_raw/compressed", imu="imu")
        self.assertLessEqual(topics | {"camera0/camera_info", "right/camera_info", "imu"}, set(node.callbacks))
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        node.callbacks["camera0/camera_info"](camera_info("thin_prism", (1.0,)))
        node.callbacks["camera0/camera_info"](camera_info())
        node.callbacks["camera0/image_raw"](image("mono8", 4, 3, 4, bytes(12)))
        node.callbacks["imu"](imu(10**9))
        heard = set()
        for i in range(10):
            node.callbacks["odom"](odometry(10**9 + i * 10**8, pose_at(0)))
        for text in ("camera0/camera_info: ", "thin_prism", "no images are used: right/camera_info: no sensor_msgs/CameraInfo",
                     "no images are used: camera0/image_raw: no transform", "no IMU is used: imu: no transform"):
            self.wait_for(lambda: (heard.add(self.diagnosis(node)[1]), any(text in one for one in heard))[1], text)
