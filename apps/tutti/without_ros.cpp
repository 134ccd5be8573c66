// SPDX-License-Identifier: BSD-3-Clause
// In place of ros_commands.cpp where TUTTI_BUILD_ROS is off.
#include <CLI/CLI.hpp>

#include "options.hpp"
#include "ros_commands.hpp"

namespace tutti::app {

struct RosArguments {
  bool wanted = false;
};

namespace {

constexpr const char* kWithout = "this program was built without CycloneDDS (TUTTI_BUILD_ROS)";

std::shared_ptr<RosArguments> add_ros(CLI::App& command) {
  auto out = std::make_shared<RosArguments>();
  command.add_flag("--ros", out->wanted, "Speak ROS 2's topics. Not in this build");
  return out;
}

}  // namespace

void add_bag_play(CLI::App& bag, int& exit_code) {
  auto* command = bag.add_subcommand("play", "Publish what bags hold as ROS 2's topics. Not in this build.");
  command->allow_extras();
  command->callback([&exit_code] { exit_code = complain("bag play", kWithout); });
}

std::shared_ptr<RosArguments> add_ros_robot_options(CLI::App& robot) { return add_ros(robot); }
std::shared_ptr<RosArguments> add_ros_server_options(CLI::App& server) { return add_ros(server); }
bool wants_ros(const RosArguments& arguments) { return arguments.wanted; }

Status feed_from_ros(const RosArguments&, program::RobotOptions&) {
  return fail(ErrorCode::configuration, "--ros: {}", kWithout);
}
Status show_on_ros(const RosArguments&, program::ServerOptions&) {
  return fail(ErrorCode::configuration, "--ros: {}", kWithout);
}

}  // namespace tutti::app
