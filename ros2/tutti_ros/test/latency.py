#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""From an odometry message to `map -> odom`, at 200 Hz beside scans of 60,000 points at 10 Hz, or beside images of 640 x 480
(bgr8) at 30 Hz and an IMU at 200 Hz, for 20 s, on the stub of rclpy: ROS itself is not in it. Prints milliseconds and the
node's share of a core.

usage: latency.py TUTTI_PROGRAM SOURCE_DIR PROTO_PYTHON_DIR SHARED_DIR [--images]
"""
import pathlib
import random
import subprocess
import sys
import tempfile
import time

sys.path += [sys.argv[3], str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
import ros_stub

ros_stub.install()
from made_messages import camera_info, cloud, image, imu, odometry, pose_at
from tutti_ros.link import stamp_ns
from tutti_ros.node import TuttiNode

POINTS, SAMPLES, WITH_IMAGES = 60_000, 4000, "--images" in sys.argv
with tempfile.TemporaryDirectory() as folder:
    robot = subprocess.Popen([sys.argv[1], "robot", "--name", "r1", "--bus", "nats://127.0.0.1:1", "--state",
                              f"{folder}/r1", "--feed", f"{folder}/feed", "--stay"])
    ros_stub.Node.given = {"socket": f"{folder}/feed", "T_body_lidar": "0 0 0.5 0 0 0 1", "transform_tolerance_s": 0.0,
                           "images": "image" if WITH_IMAGES else "", "imu": "imu" if WITH_IMAGES else ""}
    node, answered = TuttiNode(), {}
    node.outputs["corrected_pose"].publish = lambda cdr: None  # the stub's would decode it
    node.outputs["/tf"].publish = lambda cdr: answered.setdefault(stamp_ns(cdr, 8), time.perf_counter())
    scan = cloud([(n, 7, [random.uniform(-20.0, 20.0) for _ in range(POINTS)]) for n in "xyz"]
                 + [("t", 6, [i * 1000 for i in range(POINTS)])])
    messages = [odometry(10**9 + i * 5 * 10**6, pose_at(0.005 * i)) for i in range(SAMPLES)]
    seen = image("bgr8", 640, 480, 1920, random.randbytes(1920 * 480), frame_id="r1/base_link")
    felt = imu(10**9, frame_id="r1/base_link")
    while node.link.state != "feeding":
        time.sleep(0.01)
    if WITH_IMAGES:
        node.callbacks["camera_info"](camera_info(width=640, height=480))
    said, begin, spent = {}, time.perf_counter(), time.process_time()
    for i, message in enumerate(messages):
        time.sleep(max(0.0, begin + 0.005 * i - time.perf_counter()))
        said[10**9 + i * 5 * 10**6] = time.perf_counter()
        node.callbacks["odom"](message)
        scan, seen, felt = (one[:4] + message[4:12] + one[12:] for one in (scan, seen, felt))
        if WITH_IMAGES:
            node.callbacks["imu"](felt)
        if WITH_IMAGES and i % 7 == 0:
            node.callbacks["image"](seen)
        elif not WITH_IMAGES and i % 20 == 0:
            node.callbacks["points"](scan)
    time.sleep(1.0)
    cores = (time.process_time() - spent) / (time.perf_counter() - begin)
    late = sorted(1e3 * (answered[stamp] - said[stamp]) for stamp in said if stamp in answered)
    print(f"{len(late)} of {SAMPLES} answered: median {late[len(late) // 2]:.2f} ms, 99 % {late[len(late) * 99 // 100]:.2f} "
          f"ms, most {late[-1]:.2f} ms; {100 * cores:.0f} % of a core; {dict(node.link.counts)} {node.link.why}")
    node.destroy_node()
    robot.kill()
    robot.wait()
