// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// The definitions of the ROS 2 types that Tutti writes or subscribes: fields alone, without constants and comments.
namespace tutti::bags {

/// The fields of a type and of all types that it contains, as MCAP files carry them (schema encoding "ros2msg").
/// `type`: "nav_msgs/msg/Odometry", one that has_ros_definition() knows.
std::string ros_definition(const std::string& type);

/// True for the types that ros_definition() knows.
[[nodiscard]] bool has_ros_definition(const std::string& type);

/// ROS 2's hash of a type's definition (REP 2016): "RIHS01_" and 64 hexadecimal digits.
std::string ros_type_hash(const std::string& type);

}  // namespace tutti::bags
