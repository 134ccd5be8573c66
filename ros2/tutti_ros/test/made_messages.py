# SPDX-License-Identifier: BSD-3-Clause
"""CDR bytes of messages of our own making."""
import struct

import ros_stub


def made(kind, stamp_ns, frame_id, **fields):
    out = ros_stub.TYPES[kind]()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    out.header.frame_id = frame_id
    for name, value in fields.items():
        setattr(out, name, value)
    return out


def encoded(kind, *what, **fields):
    return ros_stub.encode(kind, made(kind, *what, **fields))


def set_pose(position, orientation, pose):
    position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w = pose


def pose_at(x):
    return (float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def odometry(stamp_ns, pose, frames=("r1/odom", "r1/base_link")):
    out = made("nav_msgs/Odometry", stamp_ns, frames[0], child_frame_id=frames[1])
    set_pose(out.pose.pose.position, out.pose.pose.orientation, pose)
    return ros_stub.encode("nav_msgs/Odometry", out)


def transforms(*frames, z=0.5, parent="r1/base_link"):
    out = ros_stub.TYPES["tf2_msgs/TFMessage"]()
    for frame in frames:
        one = made("geometry_msgs/TransformStamped", 0, parent, child_frame_id=frame)
        set_pose(one.transform.translation, one.transform.rotation, (0.0, 0.0, z, 0.0, 0.0, 0.0, 1.0))
        out.transforms.append(one)
    return ros_stub.encode("tf2_msgs/TFMessage", out)


def cloud(columns, stamp_ns=10**9, frame_id="r1/lidar"):
    """`columns`: [(name, datatype, numbers)] of four bytes each."""
    codes, fields = {6: "I", 7: "f"}, []
    for i, (name, datatype, _) in enumerate(columns):
        fields.append(ros_stub.TYPES["sensor_msgs/PointField"]())
        fields[-1].name, fields[-1].offset, fields[-1].datatype, fields[-1].count = name, 4 * i, datatype, 1
    count, step = len(columns[0][2]), 4 * len(columns)
    layout = struct.Struct("<" + "".join(codes[datatype] for _, datatype, _ in columns))
    data = b"".join(layout.pack(*point) for point in zip(*(numbers for _, _, numbers in columns)))
    return encoded("sensor_msgs/PointCloud2", stamp_ns, frame_id, fields=fields, height=1, width=count, point_step=step,
                   row_step=count * step, data=data)


def livox(points, times_ns, stamp_ns=10**9, frame_id="r1/lidar"):
    """A Livox's CustomMsg."""
    name = frame_id.encode() + b"\0"
    out = struct.pack("<iII", *divmod(stamp_ns, 10**9), len(name)) + name
    out += bytes(-len(out) % 8) + struct.pack("<QIB3xI", stamp_ns, len(points), 192, len(points))
    each = [struct.pack("<IfffBBB", t, *xyz, 100, 0, 3) for t, xyz in zip(times_ns, points)]
    return b"\0\1\0\0" + out + b"\0".join(each)


def fix(stamp_ns, latitude=46.5, frame_id="r1/gnss"):
    return encoded("sensor_msgs/NavSatFix", stamp_ns, frame_id, latitude=latitude, longitude=7.9, altitude=600.0,
                   position_covariance=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 4.0], position_covariance_type=2)


def camera_info(model="plumb_bob", d=(-0.3, 0.1, 0.0, 0.0, 0.0), width=4, height=3):
    return encoded("sensor_msgs/CameraInfo", 0, "r1/camera", width=width, height=height, distortion_model=model, d=list(d),
                   k=[460.0, 0.0, 370.0, 0.0, 458.0, 250.0, 0.0, 0.0, 1.0])


def image(encoding, width, height, step, data, stamp_ns=10**9, frame_id="r1/camera"):
    return encoded("sensor_msgs/Image", stamp_ns, frame_id, encoding=encoding, width=width, height=height, step=step,
                   data=bytes(data))


def imu(stamp_ns, gyro=(1.0, 2.0, 3.0), accelerometer=(4.0, 5.0, 6.0), frame_id="r1/imu"):
    out = made("sensor_msgs/Imu", stamp_ns, frame_id)
    w, a = out.angular_velocity, out.linear_acceleration
    (w.x, w.y, w.z), (a.x, a.y, a.z) = gyro, accelerometer
    return ros_stub.encode("sensor_msgs/Imu", out)
