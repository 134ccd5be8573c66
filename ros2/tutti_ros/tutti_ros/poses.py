# SPDX-License-Identifier: BSD-3-Clause
"""Rigid motions as (x, y, z, qx, qy, qz, qw), metres and unit quaternions, as the feed and ROS have them."""
import numpy as np

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def rotation(pose):
    """R_a_b (3x3) of T_a_b."""
    x, y, z, w = pose[3:]
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def times(a, b):
    """T_a_c = T_a_b * T_b_c."""
    t = rotation(a) @ b[:3] + a[:3]
    ax, ay, az, aw = a[3:]
    bx, by, bz, bw = b[3:]
    q = np.array([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                  aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz])
    return (*map(float, t), *map(float, q / np.linalg.norm(q)))


def angle(a, b):
    """Of the rotation between two poses, in rad."""
    return 2.0 * float(np.arccos(min(1.0, abs(np.dot(a[3:], b[3:])))))


def body_covariance_in_map(T_map_odom_covariance, T_odom_body, T_map_body):
    """Covariance of T_map_body as ROS states it (6x6; position and rotation about the axes of the map), of that of
    T_map_odom (right tangent, [translation; rotation]): docs/protocol.md, "The covariance"."""
    R, (x, y, z) = rotation(T_odom_body), T_odom_body[:3]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    inverse_adjoint = np.zeros((6, 6))  # Ad(T_odom_body)^-1
    inverse_adjoint[:3, :3] = inverse_adjoint[3:, 3:] = R.T
    inverse_adjoint[:3, 3:] = -R.T @ cross
    turn = np.kron(np.eye(2), rotation(T_map_body))
    J = turn @ inverse_adjoint
    return J @ np.reshape(T_map_odom_covariance, (6, 6)) @ J.T
