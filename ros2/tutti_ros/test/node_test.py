# SPDX-License-Identifier: BSD-3-Clause
"""The node on a stub of rclpy, with programs at the other end: run by tutti_ros_test.py."""
import contextlib
import io
import random
import signal
import time
import unittest

import ros_stub
from made_messages import cloud, fix, livox, odometry, pose_at, transforms
from paths import SOURCE
from programs import HAS_NATS, PATIENCE_S, WithPrograms
from tutti_ros.node import CLOUD, camera_info_topic
from tutti_ros.ros_node import run


class Programs(WithPrograms):
    @staticmethod
    def stamp_ns(message):
        return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec

    def test_what_the_robot_says_of_messages_is_in_diagnostics(self):
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", odom_frame="r1/o", map_frame="world", base_frame="r1/body")
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        for i in range(3):
            node.callbacks["odom"](odometry((1 + i) * 10**8, pose_at(0.1 * i)))
        node.callbacks["points"](cloud([(n, 7, [1.0, 2.0]) for n in "xyz"], stamp_ns=2 * 10**8))
        for i in range(3, 56):  # so long it is waited for
            node.callbacks["odom"](odometry((1 + i) * 10**8, pose_at(0.1 * i)))
        self.wait_for(lambda: "no transform from 'r1/lidar' to 'r1/body'" in self.diagnosis(node)[1], "why no scan is taken")
        self.wait_for(lambda: node.made["/tf"].said, "map -> odom")
        said = node.made["/tf"].said[0].transforms[0]
        self.assertEqual((said.header.frame_id, said.child_frame_id), ("world", "r1/o"))

    def test_parameters_that_cannot_be(self):
        for bad in ({"socket": ""}, {"T_body_lidar": "1 2 3"}, {"antenna_m": "1"}, {"use_scans": 1}, {"path_period_s": "1"},
                    {"transform_tolerance_s": True}, {"images": 3}, {"noise.translation_m_per_sqrt_m": "0.1"}):
            with self.assertRaisesRegex(ValueError, f"parameter '{next(iter(bad))}' is .*expected"):
                self.node("r1", **bad)
        whole = self.node("r2", transform_tolerance_s=1)
        self.assertEqual(whole.transform_tolerance_s, 1.0, "a whole number is a number")
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", images="a/image_raw,b/image_raw,c/image_raw")
        self.wait_for(lambda: node.link.state == "refused", "the robot's refusal")
        self.assertIn("images are of 'a/image_raw,b/image_raw,c/image_raw', expected", node.link.why)

    def test_what_cannot_be_ends_the_program_with_a_sentence(self):
        def make_node():
            raise ValueError("parameter 'socket' is empty, expected the SOCKET of tutti robot --feed SOCKET")
        said = io.StringIO()
        with contextlib.redirect_stderr(said), self.assertRaises(SystemExit) as ended:
            run(make_node)
        self.assertEqual(ended.exception.code, 2)
        self.assertEqual(said.getvalue(), "tutti_ros: parameter 'socket' is empty, expected the SOCKET of tutti robot --feed SOCKET\n")

    def test_a_manager_activates_it_and_deactivates_it(self):
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", autostart=False)
        inactive = [("publisher", "/diagnostics"), ("timer", "publish_diagnostics")]
        self.assertEqual((node.state, node.alive()), ("unconfigured", inactive))
        self.assertEqual((node.trigger("configure"), node.alive()), ("success", inactive))
        for time in 0, 1:
            self.assertEqual((node.trigger("activate"), node.state), ("success", "active"))
            self.wait_for(lambda: node.link.state == "feeding", "the robot")
            node.callbacks["odom"](odometry((1 + 2 * time) * 10**9, pose_at(0.1)))
            self.assertNotIn("inactive", self.diagnosis(node)[1])
            thread = node.connection
            self.assertEqual((node.trigger("deactivate"), node.state), ("success", "inactive"))
            self.assertFalse(thread.is_alive())
            node.callbacks["odom"](odometry((2 + 2 * time) * 10**9, pose_at(0.2)))  # it was on its way
            self.assertEqual(node.alive(), inactive)
            self.assertIn("inactive", self.diagnosis(node)[1])
        self.assertEqual((node.trigger("cleanup"), node.trigger("shutdown")), ("success", "success"))

    def test_what_fails_when_it_is_activated_is_undone(self):
        node = self.node("r1", autostart=False)
        before = node.alive()
        node.trigger("configure")
        node.create_service = None  # which _begin() calls
        self.assertEqual((node.trigger("activate"), node.state, node.alive()), ("error", "unconfigured", before))
        del node.create_service
        self.assertEqual((node.trigger("configure"), node.trigger("activate")), ("success", "success"))

    def test_the_camera_info_is_beside_the_images(self):
        for images, expected in (("image", "camera_info"), ("left/image_raw", "left/camera_info"), ("/l/i", "/l/camera_info"),
                                 ("l/i/compressed", "l/camera_info"), ("l/i/compressedDepth", "l/camera_info")):
            self.assertEqual(camera_info_topic(images), expected)

    def test_start_poses_reach_the_robot_which_says_that_it_has_no_map(self):
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1")
        self.wait_for(lambda: node.link.state == "feeding", "the robot")
        start = ros_stub.TYPES["geometry_msgs/PoseWithCovarianceStamped"]()
        start.header.frame_id = "world"
        start.pose.pose.orientation.w = 1.0
        cdr = ros_stub.encode("geometry_msgs/PoseWithCovarianceStamped", start)
        asked = ros_stub.types.SimpleNamespace(pose=start)
        for ask in (lambda: node.callbacks["initialpose"](cdr), lambda: node.callbacks["set_initial_pose"](asked, None),
                    lambda: node.callbacks["reinitialize_global_localization"](None, None)):
            refused = node.link.counts["refused"]
            ask()
            self.wait_for(lambda: node.link.counts["refused"] > refused, "the robot's answer")
            self.assertIn("this robot does not localise in a map", self.diagnosis(node)[1])

    def test_a_robot_alone_that_is_killed_once(self):
        bus = "nats://127.0.0.1:1"  # nobody is there: a robot needs no link
        node = self.node("r1")
        draw = random.Random(1)
        columns = [(n, 7, [draw.uniform(-10.0, 10.0) for _ in range(2000)]) for n in "xyz"]

        def drive(begin, end):
            for i in range(begin, end):
                node.callbacks["odom"](odometry((1 + i) * 10**8, pose_at(0.05 * i)))
                if i % 5 == 0:
                    node.callbacks["points"](cloud(columns, stamp_ns=(1 + i) * 10**8))
                    node.callbacks["fix"](fix((1 + i) * 10**8))
                time.sleep(0.002)

        drive(0, 50)  # nobody is there yet
        sent = node.made["/tf"].said
        self.assertEqual(sent, [])
        level, said = self.diagnosis(node)
        self.assertEqual(level, b"\2")
        self.assertIn("away", said)
        node.callbacks["points"](b"\0\1\0\0")
        self.assertIn("points: a message of 4 bytes", self.diagnosis(node)[1])
        node.callbacks["/tf_static"](transforms("r1/lidar", "r1/gnss"))
        robot = self.start_robot("r1", bus)
        self.wait_for(lambda: node.link.counts["corrections"] == 50, "the first samples, said again")
        drive(50, 150)
        self.wait_for(lambda: node.link.counts["corrections"] == 150, "an answer for each sample")
        self.wait_for(lambda: len(sent) == 150, "map -> odom at odometry's rate")
        last = sent[-1].transforms[0]
        self.assertEqual((last.header.frame_id, last.child_frame_id), ("r1/map", "r1/odom"))
        self.assertEqual(self.stamp_ns(last), 151 * 10**8)
        self.assertGreater(node.link.counts["scans"], 15)
        self.assertEqual(node.link.counts["fixes"], 30)
        self.wait_for(lambda: self.fed("r1").get("fixes") == 30, "fixes, counted by the robot")
        self.assertEqual(self.fed("r1")["fixes_left_out"], 0)
        self.assertEqual(node.link.counts["refused"], 0, node.link.why)

        robot.kill()
        self.wait_for(lambda: node.link.state == "away", "the end")
        drive(150, 200)
        self.assertEqual(len(sent), 200)  # the last correction goes on
        robot = self.start_robot("r1", bus)
        self.wait_for(lambda: node.link.state == "feeding" and not node.link.waiting, "the robot again")
        self.wait_for(lambda: node.correction.stamp_ns == 200 * 10**8, "all that was said again")
        drive(200, 250)
        poses = node.made["corrected_pose"].said
        self.wait_for(lambda: self.stamp_ns(poses[-1]) == 250 * 10**8, "the last sample")
        stamps = [self.stamp_ns(one.transforms[0]) for one in sent]
        self.assertEqual(stamps, [(2 + i) * 10**8 for i in range(250)])  # none twice: tf2 warns of each
        node.callbacks["ask_for_path"]()
        self.wait_for(lambda: node.made["corrected_path"].said, "the path")
        path = node.made["corrected_path"].said[-1]
        self.assertEqual(path.header.frame_id, "r1/map")
        self.assertGreater(len(path.poses), 50)
        at = poses[-1]
        self.assertAlmostEqual(at.pose.pose.position.x, 0.05 * 249, places=6)
        self.assertGreater(at.pose.covariance[0], 0.0)
        self.assertEqual(self.diagnosis(node)[0], b"\0")
        answer = ros_stub.types.SimpleNamespace()
        node.callbacks["~/end_recording"](None, answer)
        self.assertTrue(answer.success)
        robot.send_signal(signal.SIGTERM)
        self.assertEqual(robot.wait(PATIENCE_S), 0)
        self.assertEqual((node.qos["odom"]["reliability"], node.qos["odom"]["depth"]), ("best effort", 1000))
        self.assertTrue(all(node.raw.values()))
        self.assertEqual(node.qos["/tf_static"]["durability"], "transient local")
        self.assertEqual(node.qos["corrected_path"]["durability"], "transient local")

    def test_scans_of_a_livox(self):
        self.start_robot("r1", "nats://127.0.0.1:1")
        node = self.node("r1", T_body_lidar="0 0 0 0 0 0 1")
        look = lambda: (node.callbacks["look_for_scans"](), node.scans[0])[1]
        self.assertEqual(look(), CLOUD)  # nobody publishes yet
        node.published["points"] = ["livox_ros_driver/msg/CustomMsg"]
        self.assertEqual(look(), CLOUD)  # there is no such package
        self.assertIn("whose package is not sourced here", self.diagnosis(node)[1])
        node.published["points"] = ["livox_ros_driver2/msg/CustomMsg"]
        self.assertEqual(look(), "livox_ros_driver2/msg/CustomMsg")
        self.assertEqual(len(node.destroyed), 1)
        look()
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
        self.assertEqual(look(), CLOUD)

    @unittest.skipUnless(HAS_NATS, "nats-server is not installed")
    def test_two_robots_find_each_other(self):
        small = SOURCE / "tests/system/small_mission.yaml"
        self.run_tutti("run", small, "--out", self.path)
        mission = [self.path / "fed.yaml", "--data", self.path]
        lines = "".join(f"  - {{name: {name}, odometry: {{file: {name}_onboard.tum}}, reference: "
                        f"{{file: {name}_reference.tum}}}}\n" for name in ("alpha", "bravo"))
        mission[0].write_text(f"mission: fed\ninput: simulated\nrobots:\n{lines}closures:\n  verifier: reference\n"
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
            nodes[name].callbacks["ask_for_path"]()
            self.wait_for(lambda: made["corrected_path"].said, "its trajectory")
            mate = made[f"team_mates/{other}/pose"].said[-1]
            self.assertEqual(mate.header.frame_id, f"{name}/map")
            self.assertEqual(nodes[name].link.counts["refused"], 0, nodes[name].link.why)
        for program in [*robots, server]:
            program.send_signal(signal.SIGTERM)
        for program in [*robots, server]:
            self.assertEqual(program.wait(PATIENCE_S), 0)
