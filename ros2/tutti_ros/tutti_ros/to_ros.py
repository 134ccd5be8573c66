# SPDX-License-Identifier: BSD-3-Clause
"""Values into the fields of ROS messages, which are given: nothing here imports ROS."""
import re


def set_header(header, stamp_ns, frame_id):
    header.stamp.sec, header.stamp.nanosec = divmod(int(stamp_ns), 10**9)
    header.frame_id = frame_id


def set_pose(out, pose):
    """Of a geometry_msgs/Pose."""
    out.position.x, out.position.y, out.position.z = map(float, pose[:3])
    q = out.orientation
    q.x, q.y, q.z, q.w = map(float, pose[3:])


def set_transform(out, stamp_ns, parent, child, pose):
    """Of a geometry_msgs/TransformStamped: T_parent_child."""
    set_header(out.header, stamp_ns, parent)
    out.child_frame_id = child
    t, q = out.transform.translation, out.transform.rotation
    t.x, t.y, t.z = map(float, pose[:3])
    q.x, q.y, q.z, q.w = map(float, pose[3:])


def topic_part(name):
    """A robot's name as a part of a topic's."""
    word = re.sub(r"[^A-Za-z0-9_]+", "_", name)
    return word if word[:1].isalpha() else "robot_" + word
