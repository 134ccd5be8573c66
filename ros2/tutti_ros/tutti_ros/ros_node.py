# SPDX-License-Identifier: BSD-3-Clause
"""Shared by both nodes: how they run, quality of service, diagnostics."""
import sys

import rclpy
import rclpy.executors
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def best_effort(depth):
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


def parameter(node, name, default):
    """A parameter's value. A whole number is taken where the default is a float, which rclpy itself refuses; ValueError, with a
    sentence, for what is of no such type."""
    value = node.declare_parameter(name, default, ParameterDescriptor(dynamic_typing=True)).value
    if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not type(default):
        expected = {float: "a number", bool: "true or false", str: "a text"}[type(default)]
        raise ValueError(f"parameter '{name}' is {value!r}, expected {expected} such as {default!r}")
    return value


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
    """Until it is interrupted. A node that cannot be made, because its parameters are wrong, ends the program with 2 and a sentence,
    after which launch/robot.launch.py does not start it again."""
    rclpy.init()
    try:
        node = make_node()
    except ValueError as error:
        rclpy.try_shutdown()
        print(f"tutti_ros: {error}", file=sys.stderr)
        sys.exit(2)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
