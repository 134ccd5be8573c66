// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/base/result.hpp"

namespace CLI {
class App;
}
namespace tutti::program {
struct RobotOptions;
struct ServerOptions;
}  // namespace tutti::program

/// The parts of the command line that need TUTTI_BUILD_ROS; without it each of them reports that and fails.
namespace tutti::app {

/// Adds `tutti bag play`.
void add_bag_play(CLI::App& bag, int& exit_code);

/// Options --ros of `tutti robot` and `tutti server`, and those that belong to them.
struct RosArguments;
std::shared_ptr<RosArguments> add_ros_robot_options(CLI::App& robot);
std::shared_ptr<RosArguments> add_ros_server_options(CLI::App& server);
bool wants_ros(const RosArguments& arguments);

/// Sets RobotOptions::beside_feed, so that the robot is fed with messages from ROS's topics. Fails when the topics
/// cannot be opened.
Status feed_from_ros(const RosArguments& arguments, program::RobotOptions& options);
/// Sets ServerOptions::view, so that the server's map is published on ROS's topics.
Status show_on_ros(const RosArguments& arguments, program::ServerOptions& options);

}  // namespace tutti::app
