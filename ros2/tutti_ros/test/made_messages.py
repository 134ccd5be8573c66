# SPDX-License-Identifier: BSD-3-Clause
"""Messages of our own making, through CDR bytes and back."""
import struct

import ros_stub
from tutti_ros import from_ros


def odometry(stamp_ns, pose, frames=("r1/odom", "r1/base_link")):
    out = ros_stub.TYPES["nav_msgs/Odometry"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id, out.child_frame_id = frames
    p, q = out.pose.pose.position, out.pose.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pose
    return ros_stub.decode("nav_msgs/Odometry", ros_stub.encode("nav_msgs/Odometry", out))


def cloud(columns, rows=1, order="<", padding=0, stamp_ns=10**9, frame_id="r1/lidar"):
    """`columns`: [(name, datatype, numbers)], points row by row."""
    out = ros_stub.TYPES["sensor_msgs/PointCloud2"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id, out.is_bigendian = frame_id, order == ">"
    offset = 4  # something in front
    for name, datatype, _ in columns:
        field = ros_stub.TYPES["sensor_msgs/PointField"]()
        field.name, field.offset, field.datatype, field.count = name, offset, datatype, 1
        out.fields.append(field)
        offset += int(from_ros.TYPES[datatype][1])
    codes = {5: "i", 6: "I", 7: "f", 8: "d"}
    points = [b"\xff" * 4 + b"".join(struct.pack(order + codes[datatype], numbers[i]) for _, datatype, numbers in columns)
              for i in range(len(columns[0][2]))]
    width = len(points) // rows
    out.height, out.width, out.point_step, out.row_step = rows, width, offset, width * offset + padding
    out.data = b"".join(b"".join(points[r * width:(r + 1) * width]) + b"\xee" * padding for r in range(rows))
    return ros_stub.decode("sensor_msgs/PointCloud2", ros_stub.encode("sensor_msgs/PointCloud2", out))


def livox(points, times_ns, stamp_ns=10**9, frame_id="r1/lidar", order="<"):
    """CDR of a Livox's CustomMsg."""
    name = frame_id.encode() + b"\0"
    out = struct.pack(order + "iII", *divmod(stamp_ns, 10**9), len(name)) + name
    out += bytes(-len(out) % 8) + struct.pack(order + "QIB3xI", stamp_ns, len(points), 192, len(points))
    each = [struct.pack(order + "IfffBBB", t, *xyz, 100, 0, 3) for t, xyz in zip(times_ns, points)]
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + out + b"\0".join(each)


def fix(stamp_ns, latitude=46.5, variances=(1.0, 1.0, 4.0), frame_id="r1/gnss", status=0):
    out = ros_stub.TYPES["sensor_msgs/NavSatFix"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id, out.status.status = frame_id, status
    out.latitude, out.longitude, out.altitude = latitude, 7.9, 600.0
    east, north, up = variances
    out.position_covariance = [east, 0.0, 0.0, 0.0, north, 0.0, 0.0, 0.0, up]
    out.position_covariance_type = 2
    return ros_stub.decode("sensor_msgs/NavSatFix", ros_stub.encode("sensor_msgs/NavSatFix", out))


def pose_at(x):
    return (float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def camera_info(model="plumb_bob", d=(-0.3, 0.1, 0.0, 0.0, 0.0), width=4, height=3):
    out = ros_stub.TYPES["sensor_msgs/CameraInfo"]()
    out.width, out.height, out.distortion_model, out.d = width, height, model, list(d)
    out.k = [460.0, 0.0, 370.0, 0.0, 458.0, 250.0, 0.0, 0.0, 1.0]
    return ros_stub.decode("sensor_msgs/CameraInfo", ros_stub.encode("sensor_msgs/CameraInfo", out))


def image(encoding, width, height, step, data, stamp_ns=10**9, frame_id="r1/camera", big=0):
    out = ros_stub.TYPES["sensor_msgs/Image"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id, out.encoding, out.is_bigendian = frame_id, encoding, big
    out.width, out.height, out.step, out.data = width, height, step, bytes(data)
    return ros_stub.decode("sensor_msgs/Image", ros_stub.encode("sensor_msgs/Image", out))


def file_image(data, stamp_ns=10**9, frame_id="r1/camera"):
    out = ros_stub.TYPES["sensor_msgs/CompressedImage"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id, out.format, out.data = frame_id, "jpeg", data
    return ros_stub.decode("sensor_msgs/CompressedImage", ros_stub.encode("sensor_msgs/CompressedImage", out))


def imu(stamp_ns, gyro=(1.0, 2.0, 3.0), accelerometer=(4.0, 5.0, 6.0), frame_id="r1/imu"):
    out = ros_stub.TYPES["sensor_msgs/Imu"]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id = frame_id
    w, a = out.angular_velocity, out.linear_acceleration
    (w.x, w.y, w.z), (a.x, a.y, a.z) = gyro, accelerometer
    return ros_stub.decode("sensor_msgs/Imu", ros_stub.encode("sensor_msgs/Imu", out))
