# SPDX-License-Identifier: BSD-3-Clause
"""The node on a stub of rclpy, with programs at the other end: run by tutti_ros_test.py."""
import random
import signal
import time
import unittest

import ros_stub
from made_messages import cloud, fix, livox, odometry, pose_at
from paths import SOURCE
from programs import HAS_NATS, PATIENCE_S, WithPrograms
from tutti_ros import from_ros


class Programs(WithPrograms):
    def test_a_robot_alone_that_is_killed_once(self):
        bus = "nats://127.0.0.1:1"  # nobody is there: a robot needs no link
        node = self.node("r1")
        lidar = ros_stub.TYPES["geometry_msgs/TransformStamped"]()
        lidar.transform.translation.z, lidar.transform.rotation.w = 0.5, 1.0
        draw = random.Random(1)
        columns = [(n, 7, [draw.uniform(-10.0, 10.0) for _ in range(2000)]) for n in "xyz"]

        def drive(begin, end):
            for i in range(begin, end):
                node.callbacks["odom"](odometry((1 + i) * 10**8, pose_at(0.05 * i)))
                if i % 5 == 0:
                    node.callbacks["points"](cloud(columns, stamp_ns=(1 + i) * 10**8))
                    node.callbacks["fix"](fix((1 + i) * 10**8))
                time.sleep(0.002)

        drive(0, 50)  # nobody is there yet, and tf2 knows nothing
        self.assertEqual(ros_stub.Tf.sent, [])
        node.callbacks["publish_diagnostics"]()
        status = node.made["/diagnostics"].said[-1].status[0]
        self.assertEqual(status.level, b"\2")
        said = "".join(pair.value for pair in status.values)
        self.assertIn("points: no transform from 'r1/lidar'", said)
        self.assertIn("fixes are taken as of an antenna at the body's origin: no transform from 'r1/gnss'", said)
        for frame in ("r1/lidar", "r1/gnss"):
            ros_stub.Tf.known["r1/base_link", frame] = lidar
        robot = self.start_robot("r1", bus)
        self.wait_for(lambda: node.link.counts["corrections"] == 50, "the first samples, said again")
        drive(50, 150)
        self.wait_for(lambda: node.link.counts["corrections"] == 150, "an answer for each sample")
        self.wait_for(lambda: len(ros_stub.Tf.sent) == 150, "map -> odom at odometry's rate")
        sent = ros_stub.Tf.sent[-1]
        self.assertEqual((sent.header.frame_id, sent.child_frame_id), ("r1/map", "r1/odom"))
        self.assertEqual(from_ros.nanoseconds(sent.header.stamp), 151 * 10**8 - 10**8 + 10**8)
        self.assertGreater(node.link.counts["scans"], 15)
        self.assertEqual(node.link.counts["fixes"], 30)
        self.wait_for(lambda: self.fed("r1").get("fixes") == 30, "fixes, counted by the robot")
        self.assertEqual(self.fed("r1")["fixes_left_out"], 0)
        self.assertEqual(node.antenna("r1/gnss"), (0.0, 0.0, 0.5))
        self.assertEqual(node.link.counts["refused"], 0, node.link.why)

        robot.kill()
        self.wait_for(lambda: node.link.state == "away", "the end")
        drive(150, 200)
        self.assertEqual(len(ros_stub.Tf.sent), 200)  # the last correction goes on
        robot = self.start_robot("r1", bus)
        self.wait_for(lambda: node.link.state == "feeding" and not node.link.waiting, "the robot again")
        self.wait_for(lambda: node.on_map.correction.stamp_ns == 200 * 10**8, "all that was said again")
        drive(200, 250)
        poses = node.made["corrected_pose"].said
        self.wait_for(lambda: from_ros.nanoseconds(poses[-1].header.stamp) == 250 * 10**8, "the last sample")
        stamps = [from_ros.nanoseconds(sent.header.stamp) for sent in ros_stub.Tf.sent]
        self.assertEqual(stamps, [(2 + i) * 10**8 for i in range(250)])  # none twice: tf2 warns of each
        node.callbacks["publish_path"]()
        path = node.made["corrected_path"].said[-1]
        self.assertEqual(path.header.frame_id, "r1/map")
        self.assertGreater(len(path.poses), 50)
        at = poses[-1]
        self.assertAlmostEqual(at.pose.pose.position.x, 0.05 * 249, places=6)
        self.assertGreater(at.pose.covariance[0], 0.0)
        node.callbacks["publish_diagnostics"]()
        answer = ros_stub.types.SimpleNamespace()
        node.callbacks["~/end_recording"](None, answer)
        self.assertTrue(answer.success)
        robot.send_signal(signal.SIGTERM)
        self.assertEqual(robot.wait(PATIENCE_S), 0)
        self.assertEqual(node.qos["odom"], "sensor data")
        self.assertEqual(node.qos["corrected_path"]["durability"], "transient local")

    def test_scans_of_a_livox(self):
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", T_body_lidar="0 0 0 0 0 0 1")
        look = lambda: (node.callbacks["look_for_scans"](), node.raw["points"])[1]
        self.assertFalse(look())  # nobody publishes yet
        node.published["points"] = ["livox_ros_driver/msg/CustomMsg"]
        self.assertFalse(look())  # there is no such package
        node.callbacks["publish_diagnostics"]()
        said = node.made["/diagnostics"].said[-1].status[0]
        self.assertIn("whose package is not sourced here", "".join(pair.value for pair in said.values))
        node.published["points"] = ["livox_ros_driver2/msg/CustomMsg"]
        self.assertTrue(look())
        self.assertEqual(len(node.destroyed), 1)
        self.assertTrue(look())
        self.assertEqual(len(node.destroyed), 1)
        draw = random.Random(1)
        points = [tuple(draw.uniform(-10.0, 10.0) for _ in range(3)) for _ in range(500)]
        for i in range(20):
            node.callbacks["odom"](odometry((1 + i) * 10**8, pose_at(0.1 * i)))
            node.callbacks["points"](livox(points, [i * 200_000 for i in range(500)], (1 + i) * 10**8))
        self.wait_for(lambda: node.link.counts["scans"] == 20, "scans")
        self.wait_for(lambda: node.link.counts["corrections"] == 20, "an answer for each sample")
        self.assertEqual(node.link.counts["refused"], 0, node.link.why)
        node.published["points"] = ["sensor_msgs/msg/PointCloud2"]
        self.assertFalse(look())

    @unittest.skipUnless(HAS_NATS, "nats-server is not installed")
    def test_two_robots_find_each_other(self):
        small = SOURCE / "tests/system/small_mission.yaml"
        self.run_tutti("run", small, "--out", self.path)
        mission = [self.path / "fed.yaml", "--data", self.path]
        lines = "".join(f"  - {{name: {name}, odometry: {{file: {name}_onboard.tum}}, reference: "
                        f"{{file: {name}_reference.tum}}}}\n" for name in ("alpha", "bravo"))
        mission[0].write_text(f"mission: fed\ninput: simulated\nrobots:\n{lines}closures:\n  finder: reference\n"
                              "  reference: {min_time_gap_s: 20.0}\n")
        server, bus = self.start_server(*mission, "--rate", "50")
        names = ("alpha", "bravo")
        nodes = {name: self.node(name, use_scans=False) for name in names}
        robots = [self.start_robot(name, bus, *mission, "--rate", "50", "--session", "0") for name in names]
        rows = {name: [line.split() for line in (self.path / f"{name}_onboard.tum").read_text().splitlines()
                       if not line.startswith("#")] for name in names}
        for pair in zip(*rows.values()):
            for name, row in zip(names, pair):
                stamp_ns = int(row[0].replace(".", ""))
                frames = (f"{name}/odom", f"{name}/base_link")
                nodes[name].callbacks["odom"](odometry(stamp_ns, tuple(map(float, row[1:])), frames))
            time.sleep(0.004)
        for name, other in zip(names, reversed(names)):
            made = nodes[name].made
            said = made["team_mates"].said
            self.wait_for(lambda: said and len(said[-1].markers) == 3, f"{name} hears of {other}")
            self.wait_for(lambda: len(made["corrected_path"].said) > 0 and nodes[name].on_map.way, "its way")
            mate = made[f"team_mates/{other}/pose"].said[-1]
            self.assertEqual(mate.header.frame_id, f"{name}/map")
            self.assertEqual(nodes[name].link.counts["refused"], 0, nodes[name].link.why)
        for program in [*robots, server]:
            program.send_signal(signal.SIGTERM)
        for program in [*robots, server]:
            self.assertEqual(program.wait(PATIENCE_S), 0)
