# SPDX-License-Identifier: BSD-3-Clause
"""Images, depth and IMU samples that wait for odometry, and what is known of the sensors that they are of: without ROS, a
socket or a clock. The same rules as of `tutti robot --ros` (src/tutti/program/ros/images_intake.hpp)."""
import collections
import dataclasses
import math

from tutti_ros import from_ros
from tutti_ros.feed_messages import Feed
from tutti_ros.link import feed_pose
from tutti_ros.poses import angle, rotation

MS = 10**6  # ns
LATEST_NS = 500 * MS           # behind odometry; the robot takes none later
PATIENCE_NS = 300 * MS         # by odometry, for what belongs to the first camera's image
MOST_DIFFERENCE_NS = 5 * MS    # of the stamps of two cameras' images of one moment
MOST_OF_DEPTH_NS = 20 * MS     # of depth's and the camera's, as DepthConfig::max_difference_s
ANOTHER_CLOCK_NS = 10_000 * MS
BATCH_NS = 50 * MS             # of IMU samples in one message, unless images want them sooner
MOST_IN_BATCH = 10_000
MOST_BYTES = 48 * 1024 * 1024  # of images that wait, before the oldest go
MOST_IMU = 20_000
SAME_PLACE_M, SAME_TURN_RAD, SAME_MATRIX_PX = 1e-3, 1e-3, 1.0  # of depth and the camera it is registered to
DEPTH = Feed.Depth(unit_m=from_ros.DEPTH_UNIT_M, sigma_per_m2=0.0014, least_m=0.3, most_m=8.0)  # DepthSensor


@dataclasses.dataclass
class Image:
    stamp_ns: int
    data: bytes
    size: tuple = ()  # width, height; none of a file: the robot looks


class Stream:
    """One topic of images. `camera`: its calibration, once it is known."""

    def __init__(self, topic, most_bytes, most_difference_ns=MOST_DIFFERENCE_NS):
        self.topic, self.info = topic, from_ros.camera_info_topic(topic)
        self.most_difference_ns = most_difference_ns  # of its stamps and the first camera's at one moment
        self.is_compressed, self.most_bytes = from_ros.is_compressed(topic), most_bytes
        self.camera, self.frame_id, self.newest_ns = None, None, None
        self.waiting, self.bytes, self.size = collections.deque(), 0, ()

    def add(self, image, frame_id):
        self.newest_ns = image.stamp_ns
        self.waiting.append(image)
        self.bytes += len(image.data)
        while self.bytes > self.most_bytes:
            self.pop()
        is_first = self.frame_id is None
        self.frame_id, self.size = (frame_id, image.size) if is_first else (self.frame_id, self.size)
        return is_first

    def pop(self):
        self.bytes -= len(self.waiting[0].data)
        return self.waiting.popleft()

    def drop_before(self, stamp_ns):
        while self.waiting and self.waiting[0].stamp_ns < stamp_ns:
            self.pop()

    def drop_before_nearest(self, moment_ns):
        self.drop_before(moment_ns - self.most_difference_ns)
        away_ns = lambda i: abs(self.waiting[i].stamp_ns - moment_ns)
        while len(self.waiting) > 1 and away_ns(1) <= away_ns(0):
            self.pop()

    def take(self, moment_ns, size):
        """Its next image, if that is of this moment and of this size: (image or None, why it is none)."""
        if not self.waiting or self.waiting[0].stamp_ns > moment_ns + self.most_difference_ns:
            return None, ""
        image = self.pop()
        if image.size and image.size != size:
            return None, f"{self.topic}: an image of {'{} x {}'.format(*image.size)} pixels, expected {'{} x {}'.format(*size)}"
        return image, ""


class Cameras:
    """One camera, perhaps with depth that is registered to it, or two, and perhaps an IMU. `images`: topics. `place`: of a
    frame's name makes T_body_frame, or a ValueError. Functions that add return True where more may be known now: look()."""

    def __init__(self, images=(), depth="", imu="", offset_s=0.0, place=None):
        if len(images) > 2 or len({from_ros.camera_info_topic(topic) for topic in images}) < len(images):
            raise ValueError(f"parameter 'images' is '{','.join(images)}', expected the topics of one or two cameras, each "
                             "with a camera_info of its own beside it")
        if depth and (len(images) != 1 or depth.endswith(("/compressed", "/compressedDepth"))):
            raise ValueError(f"parameter 'depth' is '{depth}' with {len(images)} topics of images, expected a topic of "
                             "sensor_msgs/Image beside those of one camera")
        if imu and not images:
            raise ValueError(f"parameter 'imu' is '{imu}' without 'images', with which it would go")
        share = MOST_BYTES // max(1, len(images) + bool(depth))
        self.streams = [Stream(topic, share) for topic in images]
        self.depth = Stream(depth, share, MOST_OF_DEPTH_NS) if depth else None
        self.imu, self.imu_frame_id, self.newest_imu_ns = imu, None, None
        self.samples = collections.deque()  # (stamp_ns, gyro, accelerometer) in the IMU's axes
        self.offset_ns, self.place = round(offset_s * 1e9), place
        self.first_ns, self.now_ns = None, None  # odometry's first and newest stamps
        self.placed, self.has_depth, self.R_body_imu = [], False, None  # T_body_camera of all cameras
        self.missing = []  # what look() has not found, in words

    # What comes.
    def add_odometry(self, stamp_ns):
        self.first_ns, self.now_ns = self.first_ns or stamp_ns, stamp_ns

    def add_info(self, stream, message):
        """The first valid calibration counts."""
        if stream.camera:
            return False
        stream.camera = from_ros.camera_of(message)
        return True

    def add_image(self, stream, message):
        if stream is self.depth:
            pixels = from_ros.depth_of(message)
        elif stream.is_compressed:
            if not len(message.data):
                raise ValueError("an image of no bytes, expected a PNG or JPEG file")
            return self._add(stream, message, bytes(message.data), ())
        else:
            pixels = from_ros.grey_of(message)
        return self._add(stream, message, pixels.tobytes(), (message.width, message.height))

    def _add(self, stream, message, data, size):
        stamp_ns = from_ros.nanoseconds(message.header.stamp) + self.offset_ns
        self._check(stamp_ns, stream.newest_ns)
        return stream.add(Image(stamp_ns, data, size), message.header.frame_id)

    def add_imu(self, message):
        sample = from_ros.imu_of(message)
        self._check(sample[0], self.newest_imu_ns)
        self.newest_imu_ns = sample[0]
        self.samples.append(sample)
        if len(self.samples) > MOST_IMU:
            self.samples.popleft()
        is_first, self.imu_frame_id = self.imu_frame_id is None, self.imu_frame_id or message.header.frame_id
        return is_first

    def _check(self, stamp_ns, before_ns):
        if before_ns is not None and stamp_ns <= before_ns:
            raise ValueError(f"stamp {stamp_ns} ns, expected after {before_ns} ns: two publishers, or a clock that began anew?")
        if self.now_ns is not None and abs(stamp_ns - self.now_ns) > ANOTHER_CLOCK_NS:
            raise ValueError(f"stamp {stamp_ns} ns is {(stamp_ns - self.now_ns) * 1e-9:.1f} s from odometry's newest, "
                             f"{self.now_ns} ns: are they by another clock?")

    # What is known.
    def look(self):
        """Looks for what is not known yet; True where something was found of which the robot is to be told."""
        was = bool(self.placed), self.has_depth, self.R_body_imu is not None
        self.missing = []
        if self.streams and not self.placed:
            placed = [self._found("no images are used", self._place_of, stream) for stream in self.streams]
            self.placed = placed if all(placed) else []
        if self.depth and self.placed:  # always, as its CameraInfo may come last
            self.has_depth = bool(self._found("no depth is used", self._check_registered))
        if self.imu and self.R_body_imu is None:
            self.R_body_imu = self._found("no IMU is used", self._turn_of_imu)
        return was != (bool(self.placed), self.has_depth, self.R_body_imu is not None)

    def _found(self, without, find, *what):
        try:
            return find(*what)
        except ValueError as error:
            self.missing.append(f"{without}: {error}")
            return None

    def _place_of(self, stream):
        if not stream.camera:
            raise ValueError(f"{stream.info}: no sensor_msgs/CameraInfo that can be taken")
        if stream.frame_id is None:
            raise ValueError(f"{stream.topic}: no image")
        return self.place(stream.frame_id)

    def _check_registered(self):
        """Its pixels are the camera's, if they are as many, its frame is at the same place, and its CameraInfo, where there is
        one, has the same matrix."""
        depth, stream = self.depth, self.streams[0]
        if depth.frame_id is None:
            raise ValueError(f"{depth.topic}: no image")
        size = stream.camera.width_px, stream.camera.height_px
        if depth.size != size:
            raise ValueError(f"{depth.topic}: {depth.size} pixels, expected {size} as of {stream.topic}")
        matrix = lambda camera: (camera.fx, camera.fy, camera.cx, camera.cy)
        if depth.camera and max(abs(a - b) for a, b in zip(matrix(depth.camera), matrix(stream.camera))) > SAME_MATRIX_PX:
            raise ValueError(f"{depth.topic}: fx, fy, cx, cy {matrix(depth.camera)} px in its CameraInfo, expected "
                             f"{matrix(stream.camera)} as of {stream.topic}: is it registered to it?")
        if depth.frame_id != stream.frame_id:
            T_body_depth, T_body_camera = self.place(depth.frame_id), self.placed[0]
            away_m, turn_rad = math.dist(T_body_depth[:3], T_body_camera[:3]), angle(T_body_depth, T_body_camera)
            if away_m > SAME_PLACE_M or turn_rad > SAME_TURN_RAD:
                raise ValueError(f"{depth.topic}: frame '{depth.frame_id}', {away_m:.3f} m and {turn_rad:.4f} rad from "
                                 f"'{stream.frame_id}' of {stream.topic}, expected the same place: is it registered to it?")
        return True

    def _turn_of_imu(self):
        if self.imu_frame_id is None:
            raise ValueError(f"{self.imu}: no sample")
        T_body_imu = self.place(self.imu_frame_id)
        from_ros.check_imu_place(T_body_imu)
        return rotation(T_body_imu)

    def sensors(self):
        """What the robot is to be told of them, as far as they are known. An IMU without a camera is of no use to it."""
        out = Feed.Sensors()
        for stream, T_body_camera in zip(self.streams, self.placed):
            told = dataclasses.asdict(stream.camera)
            kind = Feed.Camera.Kind.Value(told.pop("kind"))
            out.camera.add(kind=kind, T_body_camera=feed_pose(T_body_camera), **told)
        if self.has_depth:
            out.depth.CopyFrom(DEPTH)
        if self.placed and self.R_body_imu is not None:
            out.imu.SetInParent()  # with the usual noise
        return out

    # What is due.
    def due(self, is_last=False):
        """What odometry has reached, in the order to be said: [("add_images" or "add_imu" of a Link, arguments)]; and what
        is left out, in words. `is_last`: nothing more comes that would be worth waiting for."""
        if self.now_ns is None or not self.placed:
            for stream in self.streams:
                stream.drop_before((self.now_ns or 0) - LATEST_NS)
            return [], []
        left_out, images = [], []
        while self._is_due(left_out, is_last):
            images += self._moment(left_out)
        return self._imu_batches(at_once=is_last or bool(images)) + images, left_out

    def _beside(self):
        return self.streams[1:] + ([self.depth] if self.has_depth else [])

    def _is_due(self, left_out, is_last):
        first = self.streams[0]
        first.drop_before(self.first_ns)
        while first.waiting and self.now_ns - first.waiting[0].stamp_ns > LATEST_NS:
            stamp_ns = first.pop().stamp_ns
            left_out.append(f"{first.topic}: an image comes {(self.now_ns - stamp_ns) * 1e-9:.1f} s after odometry of its "
                            f"time, expected at most {LATEST_NS * 1e-9} s")
        if not first.waiting or first.waiting[0].stamp_ns > self.now_ns:
            return False
        moment_ns = first.waiting[0].stamp_ns
        for stream in self._beside():
            stream.drop_before_nearest(moment_ns)
        is_whole = all((stream.newest_ns or 0) >= moment_ns for stream in self._beside())
        return is_last or is_whole or self.now_ns - moment_ns >= PATIENCE_NS

    def _moment(self, left_out):
        """Of all cameras at one moment; none without the first camera's."""
        moment_ns = self.streams[0].waiting[0].stamp_ns
        size = lambda stream: (stream.camera.width_px, stream.camera.height_px)
        taken = [stream.take(moment_ns, size(stream)) for stream in self.streams]
        depth, why_no_depth = None, ""
        if self.has_depth:
            depth, why_no_depth = self.depth.take(moment_ns, size(self.streams[0]))
        left_out += [why for _, why in (*taken, (None, why_no_depth)) if why]
        if taken[0][0] is None:
            return []
        images = [(i, not self.streams[i].is_compressed, image.data) for i, (image, _) in enumerate(taken) if image]
        return [("add_images", (moment_ns, images, depth.data if depth else None))]

    def _imu_batches(self, at_once):
        out, R = [], self.R_body_imu
        while R is not None and self.samples and self.samples[0][0] <= self.now_ns:
            if not at_once and min(self.now_ns, self.newest_imu_ns) - self.samples[0][0] < BATCH_NS:
                break
            batch = []
            while self.samples and self.samples[0][0] <= self.now_ns and len(batch) < MOST_IN_BATCH:
                batch.append(self.samples.popleft())
            turned = [[tuple(R @ vector) for vector in sample[1:]] for sample in batch]
            out.append(("add_imu", ([sample[0] for sample in batch], [x for gyro, _ in turned for x in gyro],
                                    [x for _, accelerometer in turned for x in accelerometer])))
        return out
