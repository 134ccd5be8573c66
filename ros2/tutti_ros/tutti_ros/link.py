# SPDX-License-Identifier: BSD-3-Clause
"""The client's side of the live feed without a socket or a clock: which messages of ROS to send next, what was heard, what to
send again after a connection was lost. docs/protocol.md has the reasons."""
import collections
import dataclasses
import struct

from tutti_ros.feed_messages import Feed
from tutti_ros.missed import MissedCount

PROTOCOL_VERSION = 1
LONGEST_FRAME = 16 * 1024 * 1024
FIRST_WAIT_S, LONGEST_WAIT_S = 0.25, 5.0
HISTORY_NS = 2 * 10**9   # of odometry that the robot has: how the body moved before what is sent next
LATEST_NS = 500_000_000  # behind odometry, for what was not sent before a connection was lost
MOST_LASTING, MOST_MOVING = 1000, 100  # messages that every connection begins with


def frame(**what):
    payload = Feed(**what).SerializeToString()
    if len(payload) > LONGEST_FRAME:
        raise ValueError(f"a message of {len(payload)} bytes, expected at most {LONGEST_FRAME}")
    return struct.pack("<I", len(payload)) + payload


def raw_frame(topic, kind, cdr):
    return frame(raw=Feed.Raw(topic=topic.encode(), type=kind.encode(), encoding=b"cdr", data=cdr))


def stamp_ns(cdr, at=4):
    """The stamp of the header with which a message begins."""
    try:
        seconds, nanoseconds = struct.unpack_from("<iI" if cdr[1] & 1 else ">iI", cdr, at)
    except (IndexError, struct.error) as error:
        raise ValueError(f"a message of {len(cdr)} bytes: {error}") from error
    return seconds * 10**9 + nanoseconds


def stamps_of_transforms(cdr):
    """Where in a TFMessage of the robot's (little endian) the stamps are."""
    count, = struct.unpack_from("<I", cdr, 4)
    out, at = [], 8
    for _ in range(count):
        at = 4 + -(-(at - 4) // 4) * 4
        out.append(at)
        at += 8
        for _ in range(2):  # frame and child
            at = 4 + -(-(at - 4) // 4) * 4
            at += 4 + struct.unpack_from("<I", cdr, at)[0]
        at = 4 + -(-(at - 4) // 8) * 8 + 7 * 8
    return out


@dataclasses.dataclass
class Sample:
    stamp_ns: int
    frame: bytes            # empty: forgotten
    counted: str            # as what it is counted
    was_said: bool = False


class Link:
    """Messages are kept until the robot has them on its disk, so that one that was killed is sent again what it lost. From
    `most_samples` on the oldest go; from `most_bytes` on the oldest scans, images and what else is no odometry. `hello`: fields of
    Feed.Hello. States: away, greeting, feeding, refused (the robot closed the connection, and said why; tried again like any
    other)."""

    def __init__(self, most_samples=20_000, most_bytes=64 * 1024 * 1024, **hello):
        self.hello, self.most_samples, self.most_bytes = hello, most_samples, most_bytes
        self.state, self.why, self.wait_s = "away", "not connected yet", FIRST_WAIT_S
        self.counts = collections.Counter()
        self.missed = {kind: MissedCount() for kind in ("odometry", "scans")}
        self.kept = collections.deque()
        self.heavy, self.heavy_bytes = collections.deque(), 0  # those of `kept` that are no odometry
        self.waiting = collections.deque()  # those of `kept` that are to be sent on this connection
        self.once = collections.deque()     # frames that are sent before these, and never again
        self.lasting, self.moving = {}, collections.deque(maxlen=MOST_MOVING)  # frames that every connection begins with
        self.newest_ns = None               # of odometry that was answered
        self.welcome, self.goodbye, self.received = None, False, b""

    # What is to be sent: add_*(topic, kind, cdr, ...), a message as it came.
    def add(self, topic, kind, cdr, counted):
        """A message that begins with a header, and is counted as `counted`."""
        sample = Sample(stamp_ns(cdr), raw_frame(topic, kind, cdr), counted)
        self.kept.append(sample)
        if counted in self.missed:
            self.missed[counted].note(sample.stamp_ns)
            self.counts[f"{counted}_missed"] = self.missed[counted].count
        if counted != "odometry":
            self.heavy.append(sample)
            self.heavy_bytes += len(sample.frame)
        if self.state == "feeding":
            self.waiting.append(sample)
        while len(self.kept) > self.most_samples:
            if self.waiting and self.waiting[0] is self.kept[0]:
                self.waiting.popleft()
            self._take_oldest()
            self._count_forgotten()
        while self.heavy_bytes > self.most_bytes:
            oldest = self.heavy.popleft()
            self.heavy_bytes -= len(oldest.frame)
            oldest.frame = b""
            self._count_forgotten()

    def add_lasting(self, topic, kind, cdr, key=b""):
        """One that is valid until another of this topic and key comes."""
        said = raw_frame(topic, kind, cdr)
        self.lasting.pop((topic, key), None)
        self.lasting[topic, key] = said
        if len(self.lasting) > MOST_LASTING:
            del self.lasting[next(iter(self.lasting))]
        self._say_once(said)

    def add_moving(self, topic, kind, cdr):
        """One that is repeated for as long as it is valid."""
        self.moving.append(raw_frame(topic, kind, cdr))
        self._say_once(self.moving[-1])

    def add_once(self, topic, kind, cdr=b""):
        """One that nobody misses."""
        self._say_once(raw_frame(topic, kind, cdr))

    def add_search(self):
        """The robot is to search the whole map in which it localises."""
        self._say_once(frame(start_pose=Feed.StartPose()))

    def _say_once(self, said):
        if self.state == "feeding":
            self.once.append(said)

    def end_recording(self):
        self.goodbye = True

    def _count_forgotten(self):
        if self.state != "feeding":
            self.counts["forgotten_while_away"] += 1

    def _take_oldest(self):
        oldest = self.kept.popleft()
        if oldest.frame and oldest.counted != "odometry":
            self.heavy_bytes -= len(self.heavy.popleft().frame)

    # The connection.
    def connected(self):
        """Begins with a connection; returns the frame to send first."""
        self.state, self.received, self.welcome = "greeting", b"", None
        self.waiting.clear()
        self.once.clear()
        return frame(hello=Feed.Hello(protocol_version=PROTOCOL_VERSION, **self.hello))

    def lost(self, why):
        """How many seconds to wait before another try."""
        if self.state != "refused":
            self.why = why
        self.state = "refused" if self.state == "refused" else "away"
        self.waiting.clear()
        wait_s, self.wait_s = self.wait_s, min(2.0 * self.wait_s, LONGEST_WAIT_S)
        return wait_s

    def next_frame(self):
        """The frame to send now; empty: none."""
        if self.state != "feeding":
            return b""
        if self.once:
            return self.once.popleft()
        while self.waiting:
            sample = self.waiting.popleft()
            if sample.frame:
                self.counts[sample.counted] += 1
                sample.was_said = True
                return sample.frame
        if not self.goodbye:
            return b""
        self.goodbye = False
        return frame(end_of_recording=Feed.EndOfRecording())

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
            if self.newest_ns is not None and message.stamp_ns < self.newest_ns:  # its clock began anew
                self._forget_until(lambda sample: sample.stamp_ns == message.stamp_ns)
            self.newest_ns = message.stamp_ns
            if message.has_stored:
                self._forget_until(lambda sample: sample.stamp_ns >= message.stored_stamp_ns - HISTORY_NS)
        elif kind == "refused":
            self.counts["refused"] += 1
            self.why = message.why
        elif kind == "jump":
            self.counts["jumps"] += 1
        elif kind == "closed":
            self.state, self.why = "refused", message.why

    def _begin(self, welcome):
        """Goes on behind what the robot has."""
        if "raw" not in welcome.takes:
            raise ValueError("the robot's program is older than this node, and takes no raw messages of ROS: update it")
        self.state, self.why, self.wait_s, self.welcome = "feeding", "", FIRST_WAIT_S, welcome
        self.once.extend((*self.lasting.values(), *self.moving))
        self.waiting.extend(sample for sample in self.kept
                            if not welcome.has_odometry or self._is_wanted(sample, welcome.last_stamp_ns))

    @staticmethod
    def _is_wanted(sample, last_ns):
        """By a robot whose newest odometry is of `last_ns`."""
        if sample.counted == "odometry":
            return sample.stamp_ns >= last_ns - HISTORY_NS
        return sample.stamp_ns > last_ns or (not sample.was_said and last_ns - sample.stamp_ns <= LATEST_NS)

    def _forget_until(self, is_kept):
        while self.kept and not is_kept(self.kept[0]):
            if self.waiting and self.waiting[0] is self.kept[0]:
                return
            self._take_oldest()
