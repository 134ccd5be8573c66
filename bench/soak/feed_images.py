#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a robot's live feed costs: how soon odometry at 200 Hz is answered, alone and beside stereo images at 20 Hz.
Needs nats-server and python3-protobuf; PROTO_PYTHON_DIR as for tests/system/robot_feed_test.py.

usage: feed_images.py TUTTI_PROGRAM PROTO_PYTHON_DIR [--stereo] [--seconds 30]
"""
import argparse
import math
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("program")
parser.add_argument("proto")
parser.add_argument("--stereo", action="store_true", help="752 x 480 pixels, raw, twice at 20 Hz, and an IMU at 200 Hz")
parser.add_argument("--seconds", type=float, default=30.0)
arguments = parser.parse_args()
sys.path.append(arguments.proto)
from tutti.v1.feed_pb2 import Feed

WIDTH, HEIGHT, RATE = 752, 480, 200


def start(*words):
    return subprocess.Popen([arguments.program, *map(str, words)], stdout=subprocess.PIPE, text=True)


def cpu_s(process):
    words = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def scene():
    """A textured wall, wider than the image: it moves by some pixels from image to image."""
    draw = random.Random(1)
    rows = []
    for y in range(0, HEIGHT, 12):
        row = b"".join(bytes([draw.randrange(256)]) * 12 for _ in range(2 * WIDTH // 12 + 1))
        rows += [row] * 12
    return rows


def image(rows, shift):
    return b"".join(row[shift:shift + WIDTH] for row in rows[:HEIGHT])


def sensors():
    out = Feed.Sensors(imu=Feed.ImuNoise())
    for x in (0.0, -0.11):
        pose = Feed.Pose(y=x, qx=-0.5, qy=0.5, qz=-0.5, qw=0.5)
        out.camera.add(width_px=WIDTH, height_px=HEIGHT, fx=458, fy=457, cx=367, cy=248, T_body_camera=pose)
    return out


def main():
    with tempfile.TemporaryDirectory() as folder:
        server = start("server", "--state", folder + "/server")
        words = server.stdout.readline().split()
        robot = start("robot", "--name", "alpha", "--bus", words[words.index("--bus") + 1], "--state", folder + "/alpha",
                      "--feed", folder + "/feed")
        feed = socket.socket(socket.AF_UNIX)
        while feed.connect_ex(folder + "/feed") != 0:
            time.sleep(0.05)
        stream, said, answered, refused, sent = feed.makefile("rb"), {}, [], [], [0]

        def say(**what):
            payload = Feed(**what).SerializeToString()
            feed.sendall(struct.pack("<I", len(payload)) + payload)
            sent[0] += len(payload) + 4

        def hear():
            while len(answered) + len(refused) < arguments.seconds * RATE:
                size, = struct.unpack("<I", stream.read(4))
                message = Feed.FromString(stream.read(size))
                now = time.perf_counter()
                if message.WhichOneof("what") == "correction":
                    answered.append(now - said[message.correction.stamp_ns])
                elif message.WhichOneof("what") in ("refused", "closed"):
                    refused.append(message)

        hello = Feed.Hello(protocol_version=1, client_name=b"load")
        if arguments.stereo:
            hello.sensors.CopyFrom(sensors())
        say(hello=hello)
        listener = threading.Thread(target=hear, daemon=True)
        listener.start()
        rows = scene()
        pairs = [(image(rows, 2 * i), image(rows, 2 * i + 20)) for i in range(60)]
        begin, cpu = time.perf_counter(), cpu_s(robot)
        for i in range(int(arguments.seconds * RATE)):
            time.sleep(max(0.0, begin + i / RATE - time.perf_counter()))
            ns = 10**18 + i * 10**9 // RATE
            pose = Feed.Pose(x=0.005 * i, y=math.sin(0.001 * i), qw=1.0)
            said[ns] = time.perf_counter()
            say(odometry=Feed.Odometry(stamp_ns=ns, T_odom_body=pose, increment_covariance=[1e-6] * 6))
            if not arguments.stereo:
                continue
            say(imu=Feed.Imu(stamp_ns=[ns], gyro=[0, 0, 0], accelerometer=[0, 0, 9.81]))
            if i % (RATE // 20) == 0:
                pair = pairs[(i * 20 // RATE) % len(pairs)]
                say(images=Feed.Images(stamp_ns=ns, image=[Feed.Image(camera=k, encoding=1, data=pair[k]) for k in (0, 1)]))
        listener.join(10)
        wall = time.perf_counter() - begin
        answered.sort()
        print(f"{len(answered)} answers, {len(refused)} refused; {sent[0] / wall / 1e6:.3f} MB/s; robot "
              f"{100 * (cpu_s(robot) - cpu) / wall:.1f} % of a core; answered within "
              f"{1e3 * answered[len(answered) // 2]:.2f} ms (median), {1e3 * answered[len(answered) * 99 // 100]:.2f} ms (99 %), "
              f"{1e3 * answered[-1]:.2f} ms (all)")
        for message in refused[:1]:
            print(message)
        for process in (robot, server):
            process.terminate()
            process.wait()


main()
