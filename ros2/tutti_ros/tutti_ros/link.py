# SPDX-License-Identifier: BSD-3-Clause
"""The client's side of the live feed without a socket or a clock: what to say next, what was heard, what to say again
after a connection was lost. docs/protocol.md says why."""
import collections
import dataclasses
import struct

import numpy as np

from tutti_ros.feed_messages import Feed

PROTOCOL_VERSION = 1
LONGEST_FRAME = 16 * 1024 * 1024
FIRST_WAIT_S, LONGEST_WAIT_S = 0.25, 5.0
FAR_NS = 60 * 10**9  # a step of odometry's stamps that a second one has to confirm
ANEW_NS, LEAST_ANEW = 2 * 10**9, 3  # so long, and so many, stamps before the newest are of a clock that began anew
LATEST_NS = 500_000_000  # behind odometry, for what was not said before a connection was lost
UNSEEN_M2, UNSEEN_RAD2 = 1.0, 0.03  # of a stretch of odometry that this program did not see
NAMES = {"fixes": "fix", "images": "images", "imu": "imu"}  # of kinds that older robots do not take (Welcome.takes)


def frame(**what):
    return framed(Feed(**what).SerializeToString())


def framed(payload):
    if len(payload) > LONGEST_FRAME:
        raise ValueError(f"a message of {len(payload)} bytes, expected at most {LONGEST_FRAME}")
    return struct.pack("<I", len(payload)) + payload


def varint(number):
    out = b""
    while number > 127:
        out, number = out + bytes([number & 127 | 128]), number >> 7
    return out + bytes([number])


def scan_frame(stamp_ns, points, ages):
    """Like frame(scan=...), but numpy's floats are the packed field as they are: protobuf's Python takes 10 ms and more for
    60,000 points, which is 10 % of a core, and nobody is answered meanwhile."""
    def packed(number, floats):
        data = np.ascontiguousarray(floats, "<f4").tobytes()
        return varint(number << 3 | 2) + varint(len(data)) + data

    scan = Feed.Scan(stamp_ns=stamp_ns).SerializeToString() + packed(Feed.Scan.XYZ_FIELD_NUMBER, points)
    if ages is not None:
        scan += packed(Feed.Scan.AGE_S_FIELD_NUMBER, ages)
    return framed(varint(Feed.SCAN_FIELD_NUMBER << 3 | 2) + varint(len(scan)) + scan)


def feed_pose(pose):
    return Feed.Pose(**dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), pose)))


def pose_from(said):
    return said.x, said.y, said.z, said.qx, said.qy, said.qz, said.qw


@dataclasses.dataclass
class Sample:
    stamp_ns: int
    pose: tuple = ()        # T_odom_body; of all else empty
    spent: tuple = (0, 0)   # variances (m^2, rad^2) of the way so far: differences are those of increments
    frame: bytes = b""      # of all but odometry; empty: forgotten
    kind: str = "odometry"  # as it is counted
    count: int = 1
    was_said: bool = False

    def is_forgotten(self):
        return not self.frame and not self.pose


class StampWatch:
    """Which stamps of odometry to believe, by the rules of the robot (src/tutti/robot/stamp_watch.hpp), so that one wrong stamp
    does not shut out here what it would take."""

    def __init__(self):
        self.newest_ns = None
        self.row = None  # (is it ahead, first, last, count) of stamps in a row that did not follow the newest

    def take(self, stamp_ns):
        """"follows", "waits", "confirms" the one that waits, "is_before", or "begins_anew"."""
        is_ahead = self.newest_ns is not None and stamp_ns > self.newest_ns
        if self.newest_ns is None or (is_ahead and stamp_ns - self.newest_ns <= FAR_NS):
            self.row, self.newest_ns = None, stamp_ns
            return "follows"
        goes_on = self.row and self.row[0] == is_ahead and 0 < stamp_ns - self.row[2] <= FAR_NS
        first_ns, count = (self.row[1], self.row[3] + 1) if goes_on else (stamp_ns, 1)
        self.row = (is_ahead, first_ns, stamp_ns, count)
        if not (count > 1 if is_ahead else count >= LEAST_ANEW and stamp_ns - first_ns > ANEW_NS):
            return "waits" if is_ahead else "is_before"
        self.row, self.newest_ns = None, stamp_ns
        return "confirms" if is_ahead else "begins_anew"


class Link:
    """Samples are kept until the robot has them on its disk, so that one that was killed is told again what it lost. From
    `most_samples` on the oldest go; from `most_bytes` on the oldest scans, images and what else is no odometry. States: away,
    greeting, feeding, refused (the robot closed the connection, and said why; tried again like any other)."""

    def __init__(self, noise, client_name="tutti_ros", has_scans=True, most_samples=20_000, most_bytes=64 * 1024 * 1024):
        self.noise, self.client_name = noise, client_name
        self.sensors = Feed.Sensors(scans=has_scans)  # that the robot is told of when it is greeted
        self.most_samples, self.most_bytes = most_samples, most_bytes
        self.state, self.why, self.wait_s = "away", "not connected yet", FIRST_WAIT_S
        self.counts = collections.Counter()
        self.kept = collections.deque()
        self.framed, self.framed_bytes = collections.deque(), 0  # those of `kept` that are no odometry
        self.waiting = collections.deque()  # those of `kept` that are to be said on this connection
        self.last = None           # the newest odometry sample
        self.stamps, self.unsure = StampWatch(), None  # a stamp and pose far ahead, until the next one confirms it
        self.last_fix_ns = None
        self.health = None         # the newest, until it was said
        self.known_spent = None    # of the newest that the robot has; None: one that this program did not see
        self.welcome, self.goodbye, self.received = None, False, b""

    def add_odometry(self, stamp_ns, pose):
        newest_ns, verdict = self.stamps.newest_ns, self.stamps.take(stamp_ns)
        unsure, self.unsure = self.unsure, None
        if verdict == "is_before":
            self.counts["odometry_left_out"] += 1
            raise ValueError(f"odometry of {stamp_ns} ns after {newest_ns} ns, expected stamps to increase")
        if verdict == "waits":
            self.unsure = (stamp_ns, pose)
            raise ValueError(f"odometry of {stamp_ns} ns is {(stamp_ns - newest_ns) * 1e-9:.0f} s ahead of {newest_ns} ns: more "
                             f"than {FAR_NS // 10**9} s, so it counts only if the next one confirms it")
        if verdict == "begins_anew":
            self._begin_anew()
        elif verdict == "confirms":
            self._add_odometry(*unsure)
        self._add_odometry(stamp_ns, pose)

    def _begin_anew(self):
        """The robot begins a session, and has no use for what is of the clock before; what was not said yet still is."""
        self.kept.clear()
        self.framed.clear()
        self.framed_bytes = 0
        self.last, self.last_fix_ns, self.known_spent = None, None, None

    def _add_odometry(self, stamp_ns, pose):
        spent = (0.0, 0.0)
        if self.last:
            seconds = (stamp_ns - self.last.stamp_ns) * 1e-9
            more = self.noise.variances(self.last.pose, pose, seconds)
            spent = tuple(a + b for a, b in zip(self.last.spent, more))
        self.last = Sample(stamp_ns, pose, spent)
        self._add(self.last)

    def add_scan(self, stamp_ns, points, ages):
        self._add(Sample(stamp_ns, frame=scan_frame(stamp_ns, points, ages), kind="scans"))

    def add_fix(self, stamp_ns, place, covariance, p_body_antenna):
        if self.last and stamp_ns - self.last.stamp_ns > FAR_NS:
            raise ValueError(f"a fix of {stamp_ns} ns, {(stamp_ns - self.last.stamp_ns) * 1e-9:.0f} s ahead of odometry's newest, "
                             f"expected at most {FAR_NS // 10**9} s")
        if self.last_fix_ns is not None and stamp_ns <= self.last_fix_ns:
            raise ValueError(f"a fix of {stamp_ns} ns after {self.last_fix_ns} ns, expected stamps to increase")
        self._check_taken("fixes")
        self.last_fix_ns = stamp_ns
        self._add(Sample(stamp_ns, kind="fixes", frame=frame(fix=Feed.Fix(
            stamp_ns=stamp_ns, latitude_deg=place[0], longitude_deg=place[1], height_m=place[2],
            covariance_m2=covariance, p_body_antenna=p_body_antenna))))

    def set_health(self, voltage_v, share):
        """What is no number, or no share of 1, the robot's driver does not know."""
        self.health = Feed.Health()
        if voltage_v >= 0.0:
            self.health.battery_v = voltage_v
        if 0.0 <= share <= 1.0:
            self.health.battery_percent = 100.0 * share

    def set_sensors(self, sensors):
        """What is said of cameras, depth and IMU the next time that the robot is greeted."""
        sensors.scans = self.sensors.scans
        self.sensors = sensors

    def add_images(self, stamp_ns, images, depth):
        """`images`: [(number of the camera, is it pixels and no file, bytes)]; `depth`: pixels, or None."""
        self._check_taken("images")
        said = Feed.Images(stamp_ns=stamp_ns)
        for camera, is_raw, data in images:
            said.image.add(camera=camera, encoding=Feed.Image.RAW if is_raw else Feed.Image.FILE, data=data)
        if depth is not None:
            said.depth.encoding, said.depth.data = Feed.Image.RAW, depth
        self._add(Sample(stamp_ns, kind="images", frame=frame(images=said)))

    def add_imu(self, stamps_ns, gyro, accelerometer):
        """Samples, increasing; of each three numbers in the body frame."""
        self._check_taken("imu")
        said = Feed.Imu(stamp_ns=stamps_ns, gyro=gyro, accelerometer=accelerometer)
        self._add(Sample(stamps_ns[-1], kind="imu", frame=frame(imu=said), count=len(stamps_ns)))

    def _check_taken(self, kind):
        """Of what a robot does not know of, nothing is kept."""
        if self.welcome and NAMES[kind] not in self.welcome.takes:
            raise ValueError(f"this robot's program is older than {kind}: it takes none")

    def end_recording(self):
        self.goodbye = True

    def _add(self, sample):
        self.kept.append(sample)
        if sample.frame:
            self.framed.append(sample)
            self.framed_bytes += len(sample.frame)
        if self.state == "feeding":
            self.waiting.append(sample)
        while len(self.kept) > self.most_samples:
            oldest = self._take_oldest()
            if self.waiting and self.waiting[0] is oldest:
                self.waiting.popleft()
            self._count_forgotten()
        while self.framed_bytes > self.most_bytes:
            oldest = self.framed.popleft()
            self.framed_bytes -= len(oldest.frame)
            oldest.frame = b""
            self._count_forgotten()

    def _count_forgotten(self):
        if self.state != "feeding":
            self.counts["forgotten_while_away"] += 1

    def _take_oldest(self):
        oldest = self.kept.popleft()
        if oldest.frame:
            self.framed_bytes -= len(self.framed.popleft().frame)
        return oldest

    def connected(self):
        """What to say first."""
        self.state, self.received, self.welcome = "greeting", b"", None
        self.waiting.clear()
        hello = Feed.Hello(protocol_version=PROTOCOL_VERSION, client_name=self.client_name.encode(), wants_way=True,
                           sensors=self.sensors)
        return frame(hello=hello)

    def lost(self, why):
        """How many seconds to wait before another try."""
        if self.state != "refused":
            self.why = why
        self.state = "refused" if self.state == "refused" else "away"
        self.waiting.clear()
        wait_s, self.wait_s = self.wait_s, min(2.0 * self.wait_s, LONGEST_WAIT_S)
        return wait_s

    def next_frame(self):
        """What to say now; empty: nothing."""
        if self.state != "feeding":
            return b""
        health, self.health = self.health, None
        if health is not None and "health" in self.welcome.takes:
            return frame(health=health)
        while self.waiting:
            sample = self.waiting.popleft()
            if not sample.is_forgotten():
                self.counts[sample.kind] += sample.count
                sample.was_said = True
                return sample.frame or self._odometry(sample)
        if not self.goodbye:
            return b""
        self.goodbye = False
        return frame(end_of_recording=Feed.EndOfRecording())

    def _odometry(self, sample):
        if self.known_spent is None:
            variances = (UNSEEN_M2, UNSEEN_RAD2)
        else:
            variances = (max(a - b, 1e-12) for a, b in zip(sample.spent, self.known_spent))
        self.known_spent = sample.spent
        m2, rad2 = variances
        return frame(odometry=Feed.Odometry(stamp_ns=sample.stamp_ns, T_odom_body=feed_pose(sample.pose),
                                            increment_covariance=[m2] * 3 + [rad2] * 3))

    def hear(self, data):
        """Messages that are complete with these bytes, as (kind, message)."""
        self.received += data
        said = []
        while len(self.received) >= 4:
            size, = struct.unpack_from("<I", self.received)
            if not 1 <= size <= LONGEST_FRAME:
                raise ValueError(f"a frame of {size} bytes, expected 1 to {LONGEST_FRAME}: no Tutti robot?")
            if len(self.received) < 4 + size:
                break
            message = Feed.FromString(self.received[4:4 + size])
            self.received = self.received[4 + size:]
            kind = message.WhichOneof("what")
            if kind:  # else of a newer robot
                said.append((kind, getattr(message, kind)))
                self._take(*said[-1])
        return said

    def _take(self, kind, message):
        if kind == "welcome":
            self._begin(message)
        elif kind == "correction":
            self.counts["corrections"] += 1
            if message.has_stored:
                self._forget_before(message.stored_stamp_ns)
        elif kind == "refused":
            self.counts["refused"] += 1
            self.why = message.why
        elif kind == "jump":
            self.counts["jumps"] += 1
        elif kind == "closed":
            self.state, self.why = "refused", message.why

    def _begin(self, welcome):
        """Goes on behind what the robot has."""
        self.state, self.why, self.wait_s, self.welcome = "feeding", "", FIRST_WAIT_S, welcome
        self.known_spent = None if welcome.has_odometry else (0.0, 0.0)
        for sample in self.kept:
            if sample.is_forgotten() or NAMES.get(sample.kind, "odometry") not in (*welcome.takes, "odometry"):
                continue
            if not welcome.has_odometry or self._is_wanted(sample, welcome.last_stamp_ns):
                self.waiting.append(sample)
            elif sample.pose and sample.stamp_ns == welcome.last_stamp_ns:
                self.known_spent = sample.spent

    @staticmethod
    def _is_wanted(sample, last_ns):
        """By a robot whose newest odometry is of `last_ns`."""
        if sample.stamp_ns > last_ns or sample.pose:
            return sample.stamp_ns > last_ns
        may_be_lost = sample.stamp_ns == last_ns and sample.kind in ("scans", "fixes")  # with a robot that was killed
        return may_be_lost or (not sample.was_said and last_ns - sample.stamp_ns <= LATEST_NS)

    def _forget_before(self, stamp_ns):
        while self.kept and self.kept[0].stamp_ns < stamp_ns:
            if self.waiting and self.waiting[0] is self.kept[0]:
                return
            self._take_oldest()
