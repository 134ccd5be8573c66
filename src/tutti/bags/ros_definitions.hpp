// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// What ROS 2's own definitions say of the types that Tutti writes; fields alone, without constants and comments.
namespace tutti::bags {

/// A type's fields and those of all that it is made of, as MCAP files carry them (schema encoding "ros2msg").
/// `type`: "nav_msgs/msg/Odometry", one of those that ros_encode.hpp writes.
std::string ros_definition(const std::string& type);

/// "RIHS01_" and 64 hexadecimal digits: what ROS 2 knows the definition of a type by (REP 2016).
std::string ros_type_hash(const std::string& type);

}  // namespace tutti::bags
