// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "arrays.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/ros_messages.hpp"

/// Converts ROS's messages to Python's values.
namespace tutti::python {

/// A message as a dict (Message.decode() in Python).
py::dict decode(const bags::BagChannel& channel, std::string_view data);
/// The pose of an Odometry or PoseStamped message; throws WrongInput for other types.
StampedPose stamped_pose(const bags::BagChannel& channel, std::string_view data);

}  // namespace tutti::python
