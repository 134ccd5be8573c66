#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How long a robot's live feed takes to answer, in real time: a server and a robot as programs, odometry at 200 Hz and all
scans through the feed's socket, updates of the map meanwhile. Without --hku a simulated walk round a hall with 10 scans a
second; with it the first of the HKU recordings, its odometry interpolated, forth and back. What is measured is from before
a sample is written to the socket until all of its correction was read; beside it, as what this machine does to any program,
how long a process that only echoes takes for as many bytes, and how late the client wakes up. Prints JSON for docs/results/robustness.md.

usage: feed_latency.py TUTTI PROTO_PYTHON_DIR [--minutes 5] [--points 20000] [--hku FOLDER_OF_THE_SESSION]
"""
import argparse
import bisect
import json
import math
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time

RATE_HZ = 200
START_NS = 1_700_000_000_000_000_000
RADIUS_M, SPEED_M_PER_S, SCANS_HZ = 6.0, 1.0, 10
WALLS = (-14.0, 11.0, -10.0, 17.0)  # of the hall: x from, to, y from, to
COLUMNS = ((0.0, 0.0, 1.0), (9.0, 8.0, 0.7), (-9.0, 4.0, 0.5))  # x, y, radius


def varint(number):
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


def scan_frame(stamp_ns, xyz_field):
    """Feed(scan=Scan(stamp_ns, xyz)) with its length in front; `xyz_field` is encoded once for all."""
    scan = b"\x08" + varint(stamp_ns) + xyz_field
    payload = b"\x1a" + varint(len(scan)) + scan
    return struct.pack("<I", len(payload)) + payload


class Hall:
    """A circle in a hall with columns; the scans of one lap, sent again in each."""

    def __init__(self, points, encode):
        rng = random.Random(1)
        lap_s = 2 * math.pi * RADIUS_M / SPEED_M_PER_S
        self.clouds = [encode(self.cloud(i / SCANS_HZ, points, rng)) for i in range(round(SCANS_HZ * lap_s))]

    def circle(self, time_s):
        angle = SPEED_M_PER_S / RADIUS_M * time_s
        return RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle), angle + math.pi / 2

    def range_m(self, x, y, angle):
        c, s = math.cos(angle), math.sin(angle)
        out = min(((WALLS[1] if c > 0 else WALLS[0]) - x) / c if c else 1e9,
                  ((WALLS[3] if s > 0 else WALLS[2]) - y) / s if s else 1e9)
        for cx, cy, radius in COLUMNS:
            along, across = (cx - x) * c + (cy - y) * s, (cy - y) * c - (cx - x) * s
            if along > 0 and abs(across) < radius:
                out = min(out, along - math.sqrt(radius * radius - across * across))
        return out

    def cloud(self, time_s, points, rng):
        x, y, yaw = self.circle(time_s)
        xyz, rings = [], 16
        for i in range(points // rings):
            azimuth = 2 * math.pi * i / (points // rings)
            distance = self.range_m(x, y, yaw + azimuth)
            for ring in range(rings):
                r = distance + rng.gauss(0, 0.02)
                xyz += (r * math.cos(azimuth), r * math.sin(azimuth), distance * math.tan(math.radians(2 * ring - 15)))
        return xyz

    def pose(self, i):
        x, y, yaw = self.circle(i / RATE_HZ)
        yaw += 1e-4 * i / RATE_HZ  # drift
        return x, y, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)

    def scans(self, i):
        """(seconds from the start, encoded points) of those due with sample i."""
        every = RATE_HZ // SCANS_HZ
        return [(i / RATE_HZ, self.clouds[(i // every) % len(self.clouds)])] if i % every == 0 else []


class Recorded:
    """A recording, from its first gap of more than a second on, forth and back."""

    def __init__(self, folder, encode):
        times = [float(line) for line in (folder / "times.txt").read_text().split()]
        poses = [[float(word) for word in line.split()] for line in (folder / "odom_poses.txt").read_text().splitlines()]
        first = max((k for k in range(1, len(times)) if times[k] - times[k - 1] > 1.0), default=0)
        self.times = [t - times[first] for t in times[first:]]
        self.poses = [self.quaternion(rows) for rows in poses[first:]]
        for a, b in zip(self.poses, self.poses[1:]):
            if sum(p * q for p, q in zip(a[3:], b[3:])) < 0:
                b[3:] = [-q for q in b[3:]]
        files = sorted((folder / "Scans").iterdir())[first:]
        self.clouds = [encode(self.points(file)) for file in files]
        self.next = (0, 1)  # scan, way

    def quaternion(self, rows):
        r = [rows[0:3], rows[4:7], rows[8:11]]
        w = math.sqrt(max(0.0, 1 + r[0][0] + r[1][1] + r[2][2])) / 2
        if w < 0.1:  # turned by nearly 180 degrees about some axis
            k = max(range(3), key=lambda axis: r[axis][axis])
            a, b = (k + 1) % 3, (k + 2) % 3
            q = [0.0, 0.0, 0.0]
            q[k] = math.sqrt(1 + r[k][k] - r[a][a] - r[b][b]) / 2
            q[a], q[b] = (r[a][k] + r[k][a]) / (4 * q[k]), (r[b][k] + r[k][b]) / (4 * q[k])
            return [rows[3], rows[7], rows[11], *q, (r[b][a] - r[a][b]) / (4 * q[k])]
        return [rows[3], rows[7], rows[11], (r[2][1] - r[1][2]) / (4 * w), (r[0][2] - r[2][0]) / (4 * w),
                (r[1][0] - r[0][1]) / (4 * w), w]

    def points(self, file):
        data = file.read_bytes()
        head, _, body = data.partition(b"DATA binary\n")
        count = int(head.split(b"POINTS ")[1].split()[0])
        values = struct.unpack_from(f"<{4 * count}f", body)
        return [v for k in range(count) for v in values[4 * k:4 * k + 3]]

    def pose(self, i):
        whole = self.times[-1]
        at = i / RATE_HZ % (2 * whole)
        at = min(at, 2 * whole - at)
        k = min(max(1, bisect.bisect_right(self.times, at)), len(self.times) - 1)
        share = (at - self.times[k - 1]) / (self.times[k] - self.times[k - 1])
        mixed = [(1 - share) * a + share * b for a, b in zip(self.poses[k - 1], self.poses[k])]
        norm = math.sqrt(sum(q * q for q in mixed[3:]))
        return (*mixed[:3], *(q / norm for q in mixed[3:]))

    def scans(self, i):
        out = []
        while True:
            scan, way = self.next
            turns, back = way // 2, way % 2 == 0
            at = (2 * turns - (self.times[scan] / self.times[-1]) if back else 2 * turns + self.times[scan] / self.times[-1])
            at *= self.times[-1]
            if at > i / RATE_HZ:
                return out
            out.append((at, self.clouds[scan]))
            scan += -1 if back else 1
            if not 0 < scan < len(self.times) - 1:
                way += 1
                scan = min(max(scan, 0), len(self.times) - 1)
            self.next = (scan, way)


class Echo:
    """A process that answers whatever it is sent."""

    def __init__(self):
        self.end, other = socket.socketpair(socket.AF_UNIX)
        if os.fork() == 0:
            self.end.close()
            while data := other.recv(1 << 16):
                other.sendall(data)
            os._exit(0)
        other.close()

    def ms(self, payload):
        sent = time.perf_counter()
        self.end.sendall(payload)
        left = len(payload)
        while left > 0:
            left -= len(self.end.recv(1 << 16))
        return 1e3 * (time.perf_counter() - sent)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tutti")
    parser.add_argument("proto")
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--points", type=int, default=20_000)
    parser.add_argument("--hku", type=pathlib.Path)
    arguments = parser.parse_args()
    sys.path.append(arguments.proto)
    try:
        from tutti.v1.feed_pb2 import Feed
    except ImportError:
        if sys.executable == "/usr/bin/python3":
            raise
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])

    encode = lambda xyz: Feed.Scan(xyz=xyz).SerializeToString()
    walk = Recorded(arguments.hku, encode) if arguments.hku else Hall(arguments.points, encode)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        server = subprocess.Popen([arguments.tutti, "server", "--state", path / "server"], stdout=subprocess.PIPE, text=True)
        words = server.stdout.readline().split()
        bus = words[words.index("--bus") + 1]
        robot = subprocess.Popen([arguments.tutti, "robot", "--name", "alpha", "--bus", bus, "--state", path / "alpha",
                                  "--feed", path / "feed", "--stay"])
        client = socket.socket(socket.AF_UNIX)
        while client.connect_ex(str(path / "feed")) != 0:
            time.sleep(0.05)
        heard = bytearray()
        counts = {"refused": 0, "jump": 0, "situation": 0, "closed": 0}
        alerts, revisions, first_refusal = {}, set(), None
        correction = b"\x8a\x01"  # of a Feed that is one

        def frame():
            while len(heard) < 4 or len(heard) < 4 + struct.unpack_from("<I", heard)[0]:
                more = client.recv(1 << 16)
                if not more:
                    raise SystemExit(f"the feed has closed: {counts}")
                heard.extend(more)
            size = 4 + struct.unpack_from("<I", heard)[0]
            out = bytes(heard[4:size])
            del heard[:size]
            return out

        def note(payload):
            nonlocal first_refusal
            message = Feed.FromString(payload)
            kind = message.WhichOneof("what")
            if kind in counts:
                counts[kind] += 1
            if kind == "refused":
                first_refusal = first_refusal or message.refused.why
            if kind == "situation":
                alerts.update((alert.text[:20], alert.text) for alert in message.situation.alert)  # the last of a kind
            return kind

        def say(**what):
            payload = Feed(**what).SerializeToString()
            client.sendall(struct.pack("<I", len(payload)) + payload)

        say(hello=Feed.Hello(protocol_version=1, client_name=b"latency"))
        while note(frame()) != "welcome":
            pass
        echo = Echo()
        took_ms, echo_ms, late_ms, scans, begin = [], [], [], 0, time.monotonic()
        last = b""
        for i in range(round(arguments.minutes * 60 * RATE_HZ)):
            x, y, z, qx, qy, qz, qw = walk.pose(i)
            stamp_ns = START_NS + i * 10**9 // RATE_HZ
            sample = Feed.Odometry(stamp_ns=stamp_ns, T_odom_body=Feed.Pose(x=x, y=y, z=z, qx=qx, qy=qy, qz=qz, qw=qw),
                                   increment_covariance=[1e-7] * 3 + [1e-9] * 3)
            payload = Feed(odometry=sample).SerializeToString()
            payload = struct.pack("<I", len(payload)) + payload
            due = begin + i / RATE_HZ
            if time.monotonic() < due:
                time.sleep(max(0.0, due - time.monotonic()))
            late_ms.append(1e3 * (time.monotonic() - due))
            sent = time.perf_counter()
            client.sendall(payload)
            while not (last := frame()).startswith(correction):
                if note(last) == "refused":
                    break
            took_ms.append(1e3 * (time.perf_counter() - sent))
            if i % RATE_HZ == 0 and last.startswith(correction):
                revisions.add(Feed.FromString(last).correction.map_revision)
            echo_ms.append(echo.ms(payload))
            for at_s, cloud in walk.scans(i):
                client.sendall(scan_frame(START_NS + round(at_s * 1e9), cloud))
                scans += 1
        say(end_of_recording=Feed.EndOfRecording())
        sent = time.perf_counter()
        while (kind := note(frame())) not in ("ended", "closed"):
            pass
        ended_s = time.perf_counter() - sent
        status = json.loads((path / "alpha" / "status.json").read_text())

        def shares(values):
            ordered = sorted(values)
            at = lambda share: round(ordered[min(len(ordered) - 1, int(share * len(ordered)))], 3)
            return {"p50": at(0.5), "p99": at(0.99), "p999": at(0.999), "worst": round(ordered[-1], 2)}

        cpu = lambda process: sum(map(int, pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(") ")[2].split()[11:13]))
        print(json.dumps({"minutes": arguments.minutes, "samples": len(took_ms), "scans": scans, "answered after ms": shares(took_ms),
                          "a bare echo after ms": shares(echo_ms), "echo over 20 ms": sum(t > 20 for t in echo_ms),
                          "client itself late by ms": shares(late_ms), "over 2 ms": sum(t > 2 for t in took_ms),
                          "over 20 ms": sum(t > 20 for t in took_ms), **counts, "first refusal": first_refusal,
                          "alerts": sorted(alerts.values()), "map revisions heard": len(revisions), "ended after s": round(ended_s, 2),
                          "robot CPU s": cpu(robot) / os.sysconf("SC_CLK_TCK"), "load average": os.getloadavg(),
                          "status": status.get("line")}, indent=1))
        for program in (robot, server):
            program.terminate()
            program.wait()


if __name__ == "__main__":
    main()
