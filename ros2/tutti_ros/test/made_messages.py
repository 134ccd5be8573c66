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
