# SPDX-License-Identifier: BSD-3-Clause
"""What both nodes have: how they run, quality of service, diagnostics."""
import rclpy
import rclpy.executors
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def best_effort(depth):
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


def diagnostics(node, of_what, level, text, values):
    """A DiagnosticArray of one status; `values`: {key: value}, texts."""
    status = DiagnosticStatus()
    status.level, status.message = bytes([level]), text
    status.name, status.hardware_id = f"{node.get_fully_qualified_name()}: {of_what}", values.get("robot", "")
    for key, value in values.items():
        pair = KeyValue()
        pair.key, pair.value = key, value
        status.values.append(pair)
    out = DiagnosticArray()
    out.header.stamp = node.get_clock().now().to_msg()
    out.status.append(status)
    return out


def run(make_node):
    """Until it is interrupted."""
    rclpy.init()
    node = make_node()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
