# SPDX-License-Identifier: BSD-3-Clause
"""What ROS messages say, as the live feed wants it. Messages are anything with the fields of nav_msgs/Odometry and of
sensor_msgs' PointCloud2, NavSatFix, CameraInfo, Image and Imu; what is no sample is a ValueError that says why. Cameras,
images and IMU samples are taken as by src/tutti/bags/camera.cpp."""
import dataclasses
import math
import struct
import types

import numpy as np

from tutti_ros.poses import angle, rotation

TIME_FIELDS = ("t", "time", "timestamp", "offset_time")
UNITS_S = (1.0, 1e-3, 1e-6, 1e-9)
SHORTEST_SWEEP_S, LONGEST_SWEEP_S = 0.001, 0.5
LONGEST_AGE_S = 1.0
LARGEST_IMAGE_PX = 16 * 1024 * 1024  # of one frame of the feed
DEPTH_UNIT_M, MOST_DEPTH_M = 0.001, 65.5
CAMERA_KINDS = ("PINHOLE", "EQUIDISTANT", "DOUBLE_SPHERE", "RATIONAL")  # by their numbers in the feed
GREYS, BAYERS = ("mono8", "8UC1"), ("bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8")
COLOURS = {"rgb8": (3, 0), "bgr8": (3, 2), "8UC3": (3, 2), "rgba8": (4, 0), "bgra8": (4, 2)}  # bytes, and which is red
SAME_PLACE_M = 1e-3
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}  # sensor_msgs/PointField


def nanoseconds(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def pose_of(position, orientation):
    pose = (position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w)
    norm = math.sqrt(sum(q * q for q in pose[3:]))
    if not all(map(math.isfinite, pose)) or abs(norm - 1.0) > 0.01:
        raise ValueError(f"a pose {pose} that is none, expected finite numbers and a unit quaternion")
    return (*pose[:3], *(q / norm for q in pose[3:]))


def odometry_of(message):
    """(stamp_ns, T_odom_body)"""
    return nanoseconds(message.header.stamp), pose_of(message.pose.pose.position, message.pose.pose.orientation)


@dataclasses.dataclass
class OdometryNoise:
    """How much odometry is to be trusted; the same model and defaults as robots[].covariance of a mission file. Variances
    add up along the way. The covariance in Odometry messages is not read: it is that of the pose, not of an increment,
    and all zero, -1 or 1e6 with many drivers."""
    translation_m_per_sqrt_m: float = 0.02
    translation_m_per_sqrt_deg: float = 0.001
    translation_m_per_sqrt_s: float = 0.003
    rotation_deg_per_sqrt_m: float = 0.1
    rotation_deg_per_sqrt_deg: float = 0.02
    rotation_deg_per_sqrt_s: float = 0.02

    def variances(self, before, after, seconds):
        """(m^2, rad^2) of the increment between two poses."""
        metres, degrees = math.dist(before[:3], after[:3]), math.degrees(angle(before, after))
        add = lambda m, deg, s: m * m * metres + deg * deg * degrees + s * s * seconds
        return (add(self.translation_m_per_sqrt_m, self.translation_m_per_sqrt_deg, self.translation_m_per_sqrt_s),
                add(self.rotation_deg_per_sqrt_m, self.rotation_deg_per_sqrt_deg, self.rotation_deg_per_sqrt_s)
                * math.radians(1.0)**2)


def fix_of(message):
    """(stamp_ns, (latitude_deg, longitude_deg, height_m), covariance), or None: the receiver has no fix. The covariance is
    9 numbers in m^2, east, north, up, row by row; none where it is not stated: of type 0, or 0 or -1 as with many drivers."""
    if message.status.status < 0:
        return None
    place = (message.latitude, message.longitude, message.altitude)
    if not all(map(math.isfinite, place)):
        raise ValueError(f"a place {place} that is none, expected finite numbers")
    covariance = [float(x) for x in message.position_covariance]
    is_stated = message.position_covariance_type != 0 and all(x > 0.0 for x in covariance[::4])
    return nanoseconds(message.header.stamp), place, covariance if is_stated else []


def points_of(message):
    """(points Nx3 float32 in the sensor's frame, their times as they stand there, or None); without points that are not
    finite, or at 0, 0, 0: beams without an echo. Reads rows with padding and both byte orders."""
    fields = {field.name: field for field in message.fields}
    order = ">" if message.is_bigendian else "<"
    time = next((name for name in TIME_FIELDS if name in fields and fields[name].count <= 1), None)
    names = ["x", "y", "z"] + ([time] if time else [])
    formats, offsets = [], []
    for name in names:
        field = fields.get(name)
        if field is None or field.datatype not in ((5, 6, 7, 8) if name == time else (7, 8)):
            raise ValueError(f"no field '{name}' of floats among {sorted(fields)}" if name != time else
                             f"field '{name}' has datatype {field.datatype}, expected 5 to 8")
        formats.append(order + TYPES[field.datatype])
        offsets.append(field.offset)
        if field.offset + np.dtype(formats[-1]).itemsize > message.point_step:
            raise ValueError(f"field '{name}' at byte {field.offset} of points of {message.point_step} bytes")
    rows, columns, step = message.height, message.width, message.point_step
    row_step = message.row_step if rows > 1 else columns * step  # of one row many drivers do not care what they say
    needed = (rows - 1) * row_step + columns * step if rows else 0
    data = np.frombuffer(message.data, np.uint8)
    if row_step < columns * step or len(data) < needed:
        raise ValueError(f"{len(data)} bytes of points in rows of {row_step}, expected {rows} rows of {columns} points "
                         f"of {step} bytes")
    if rows * columns == 0:
        return np.empty((0, 3), np.float32), None
    layout = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})
    cloud = np.ndarray((rows, columns), layout, data, strides=(row_step, step)).reshape(-1)
    points = np.stack([cloud[name].astype(np.float32) for name in "xyz"], axis=1)
    finite = np.isfinite(points).all(axis=1) & points.any(axis=1)
    return points[finite], cloud[time].astype(np.float64)[finite] if time else None


def cloud_of_livox(cdr):
    """The CDR bytes of a Livox's CustomMsg as the PointCloud2 that they are: a row for each point (20 bytes, the last 19)."""
    cloud = types.SimpleNamespace(header=types.SimpleNamespace(stamp=types.SimpleNamespace()))
    cloud.is_bigendian = len(cdr) > 1 and cdr[1] & 1 == 0
    order = ">" if cloud.is_bigendian else "<"
    try:
        stamp = cloud.header.stamp
        stamp.sec, stamp.nanosec, length = struct.unpack_from(order + "iII", cdr, 4)
        cloud.header.frame_id = bytes(cdr[16:16 + length]).rstrip(b"\0").decode()
        at = 16 + length + -(12 + length) % 8  # of timebase
        stated, cloud.height = struct.unpack_from(order + "I4xI", cdr, at + 8)
    except struct.error as error:
        raise ValueError(f"a CustomMsg of {len(cdr)} bytes: {error}") from error
    if stated != cloud.height:
        raise ValueError(f"{cloud.height} points, expected {stated} as point_num says")
    cloud.width, cloud.point_step, cloud.row_step = 1, 19, 20
    cloud.fields = [types.SimpleNamespace(name=name, offset=offset, datatype=datatype, count=1)
                    for name, offset, datatype in (("offset_time", 0, 6), ("x", 4, 7), ("y", 8, 7), ("z", 12, 7))]
    cloud.data = memoryview(cdr)[at + 20:]
    return cloud


def seconds_after_stamp(times, stamp_ns):
    """When points were measured, in s after the message's stamp, of numbers in a unit and since a moment that drivers do not
    agree about: the unit that makes a sweep of them, since the stamp or by the stamp's clock. None: all at the stamp."""
    if times is None or len(times) == 0:
        return None
    if not np.isfinite(times).all():
        raise ValueError("the time of a point is no number")
    first, last = float(times.min()), float(times.max())
    if first == last:
        return None
    unit_s = next((u for u in UNITS_S if SHORTEST_SWEEP_S <= u * (last - first) <= LONGEST_SWEEP_S), None)
    if unit_s is None:
        raise ValueError(f"points' times go from {first} to {last}, expected a sweep of {SHORTEST_SWEEP_S} to "
                         f"{LONGEST_SWEEP_S} s")
    if unit_s * max(abs(first), abs(last)) <= LONGEST_AGE_S:
        return unit_s * times
    after = unit_s * (times - stamp_ns * 1e-9 / unit_s)
    if max(abs(after.min()), abs(after.max())) > LONGEST_AGE_S:
        raise ValueError(f"points' times go from {first} to {last}, expected within {LONGEST_AGE_S} s of 0 or of the "
                         f"stamp {stamp_ns} ns: a clock of its own?")
    return after


def moved(T_body_sensor, points):
    """Without a product of matrices: for one of this size OpenBLAS wakes threads that then spin, 70 % of a core at 10 Hz."""
    R, t = rotation(T_body_sensor).astype(np.float32), np.array(T_body_sensor[:3], np.float32)
    return points[:, :1] * R[:, 0] + points[:, 1:2] * R[:, 1] + points[:, 2:] * R[:, 2] + t


def scan_of(message, T_body_sensor, deskewed=False):
    """(stamp_ns, points Nx3 float32 in the body frame, ages in s or None): the stamp is that of the newest point, so that
    ages are positive and the robot waits until odometry is there."""
    stamp_ns = nanoseconds(message.header.stamp)
    points, times = points_of(message)
    points = moved(T_body_sensor, points)
    after = None if deskewed else seconds_after_stamp(times, stamp_ns)
    if after is None:
        return stamp_ns, points, None
    newest_s = float(after.max())
    return stamp_ns + round(newest_s * 1e9), points, (newest_s - after).astype(np.float32)


@dataclasses.dataclass(frozen=True)
class Camera:
    """Intrinsics, of the images as they come: K and D of a CameraInfo. `distortion` is in the order of its kind."""
    kind: str
    width_px: int
    height_px: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple


def camera_kind(model, numbers):
    count = len(numbers)
    if count == 0 or (model == "plumb_bob" and (count == 4 or (count == 5 and numbers[4] == 0.0))):
        return "PINHOLE"
    kind = {("plumb_bob", 5): "RATIONAL", ("rational_polynomial", 8): "RATIONAL", ("equidistant", 4): "EQUIDISTANT",
            ("fisheye", 4): "EQUIDISTANT", ("double_sphere", 2): "DOUBLE_SPHERE"}.get((model, count))
    if kind is None:
        raise ValueError(f"distortion_model '{model[:40]}' with {count} numbers, expected plumb_bob (4 or 5), "
                         "rational_polynomial (8), equidistant (4) or double_sphere (2)")
    return kind


def camera_of(message):
    """The calibration in a CameraInfo: only one that the robot takes, as it ends the connection at any other."""
    numbers = tuple(float(x) for x in message.d)
    kind = camera_kind(message.distortion_model, numbers)
    width, height = message.width, message.height
    if not 0 < width * height <= LARGEST_IMAGE_PX:
        raise ValueError(f"an image of {width} x {height} pixels, expected 1 to {LARGEST_IMAGE_PX} of them")
    if message.binning_x > 1 or message.binning_y > 1:
        raise ValueError(f"binning {message.binning_x} x {message.binning_y}, expected none")
    fx, fy, cx, cy = (float(message.k[i]) for i in (0, 4, 2, 5))
    if not (fx > 0.0 and fy > 0.0 and all(map(math.isfinite, (fx, fy, cx, cy, *numbers)))):
        raise ValueError(f"focal lengths {fx} and {fy} px, centre {cx}, {cy}, distortion {numbers}: expected finite numbers "
                         "and positive lengths; is the camera calibrated?")
    if kind == "DOUBLE_SPHERE" and not (abs(numbers[0]) < 1.0 and 0.0 <= numbers[1] <= 1.0):
        raise ValueError(f"double sphere with xi {numbers[0]} and alpha {numbers[1]}, expected -1 < xi < 1 and 0 <= alpha <= 1")
    return Camera(kind, width, height, fx, fy, cx, cy, numbers[:4] if kind == "PINHOLE" else numbers)


def rows_of(message, pixel_bytes):
    """The pixels of an Image as an array of bytes: height x width x pixel_bytes, a view of the message's data. Rows may be
    padded."""
    rows, columns, step = message.height, message.width, message.step
    data = np.frombuffer(message.data, np.uint8)
    row = columns * pixel_bytes
    if rows == 0 or columns == 0 or step < row or len(data) < (rows - 1) * step + row:
        raise ValueError(f"{columns} x {rows} pixels of {pixel_bytes} bytes, rows of {step} bytes, {len(data)} bytes in all")
    return np.ndarray((rows, columns, pixel_bytes), np.uint8, data, strides=(step, pixel_bytes, 1))


def grey_of(message):
    """The Image as grey values, height x width of uint8: colours by their luminance (ITU-R BT.709, as PNG files are read),
    in a Bayer pattern each pixel the mean of a square of two by two."""
    encoding = message.encoding
    if encoding in GREYS:
        return rows_of(message, 1)[:, :, 0]
    if encoding in BAYERS:
        square = np.pad(rows_of(message, 1)[:, :, 0], ((0, 1), (0, 1)), "edge").astype(np.uint16)
        return ((square[:-1, :-1] + square[:-1, 1:] + square[1:, :-1] + square[1:, 1:] + 2) // 4).astype(np.uint8)
    if encoding not in COLOURS:
        raise ValueError(f"encoding '{encoding[:40]}', expected mono8, rgb8, bgr8, rgba8, bgra8 or bayer_..8")
    size, red = COLOURS[encoding]
    pixels = rows_of(message, size)
    out = pixels[:, :, red].astype(np.uint32) * 13933  # of 65536
    out += pixels[:, :, 1].astype(np.uint32) * 46871
    out += pixels[:, :, 2 - red].astype(np.uint32) * 4732
    return ((out + 32768) // 65536).astype(np.uint8)


def depth_of(message):
    """The depth image as numbers of DEPTH_UNIT_M, height x width of uint16, little endian; 0: unknown. Of 16UC1 (or mono16),
    millimetres, and of 32FC1, metres."""
    encoding, order = message.encoding, ">" if message.is_bigendian else "<"
    if encoding in ("16UC1", "mono16"):
        return np.ascontiguousarray(rows_of(message, 2)).view(order + "u2")[:, :, 0].astype("<u2")
    if encoding != "32FC1":
        raise ValueError(f"encoding '{encoding[:40]}', expected 16UC1 (mm) or 32FC1 (m)")
    metres = np.ascontiguousarray(rows_of(message, 4)).view(order + "f4")[:, :, 0].astype(np.float64)
    is_known = (metres > 0.0) & (metres <= MOST_DEPTH_M)  # of what is not a number, neither is true
    return np.floor(np.where(is_known, metres, 0.0) / DEPTH_UNIT_M + 0.5).astype("<u2")


def imu_of(message):
    """(stamp_ns, gyro, accelerometer): rad/s and m/s^2 in the IMU's own axes."""
    vectors = [(v.x, v.y, v.z) for v in (message.angular_velocity, message.linear_acceleration)]
    if not all(map(math.isfinite, vectors[0] + vectors[1])):
        raise ValueError(f"an IMU sample {vectors} that is none, expected finite numbers")
    return nanoseconds(message.header.stamp), *vectors


def check_imu_place(T_body_imu):
    """Elsewhere than in the body's origin it measures other accelerations."""
    away_m = math.hypot(*T_body_imu[:3])
    if away_m > SAME_PLACE_M:
        raise ValueError(f"is {away_m:.3f} m from the body's origin, expected 0")


def camera_info_topic(images):
    """Where the CameraInfo of a topic of images is: beside it."""
    steps = 2 if is_compressed(images) else 1
    folder = images.rsplit("/", steps)[0] if images.count("/") >= steps else ""
    return f"{folder}/camera_info" if folder or images.startswith("/") else "camera_info"


def is_compressed(images):
    """As image_transport names topics of CompressedImage."""
    return images.endswith("/compressed")
