#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Feeds a TUM trajectory (t x y z qx qy qz qw) to a robot program and prints where the robot is on its map, as TUM.
Needs python3-protobuf. All on one machine, from the folder above this one; BUS is what the server prints:
  tutti server --state /tmp/map &
  tutti robot --name alpha --bus BUS --state /tmp/alpha --feed /tmp/alpha.feed &
  protoc --python_out=/tmp -I proto proto/tutti/v1/feed.proto
  PYTHONPATH=/tmp examples/feed_client.py /tmp/alpha.feed < ODOMETRY.txt > CORRECTED.txt"""
import socket, struct, sys
from decimal import Decimal
if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
    sys.exit(__doc__)
from tutti.v1.feed_pb2 import Feed

robot = socket.socket(socket.AF_UNIX)
robot.connect(sys.argv[1])
stream = robot.makefile("rwb")

def say(**what):
    payload = Feed(**what).SerializeToString()
    stream.write(struct.pack("<I", len(payload)) + payload)
    stream.flush()

def hear(*kinds):  # the next message of these kinds
    while True:
        size, = struct.unpack("<I", stream.read(4))
        message = Feed.FromString(stream.read(size))
        kind = message.WhichOneof("what")
        if kind in ("jump", "refused", "closed") or kind == "situation" and message.situation.alert:
            print(kind, str(getattr(message, kind)).replace("\n", " "), file=sys.stderr)
        if kind in kinds or kind == "closed":
            return message

say(hello=Feed.Hello(protocol_version=1, client_name=b"example"))
known = hear("welcome").welcome  # what the robot has, it does not want again
for t, *pose in (line.split() for line in sys.stdin if not line.startswith("#")):
    ns = int(Decimal(t) * 10**9)
    pose = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), map(float, pose)))
    if not known.has_odometry or ns > known.last_stamp_ns:
        say(odometry=Feed.Odometry(stamp_ns=ns, T_odom_body=Feed.Pose(**pose), increment_covariance=[1e-4] * 3 + [1e-6] * 3))
        answer = hear("correction", "refused").correction
        p = answer.T_map_body
        # Of a receiver: say(fix=Feed.Fix(stamp_ns=ns, latitude_deg=46.5, longitude_deg=7.9, height_m=600, p_body_antenna=[0, 0, 1]))
        print(t, p.x, p.y, p.z, p.qx, p.qy, p.qz, p.qw)
say(end_of_recording=Feed.EndOfRecording())
hear("ended")
