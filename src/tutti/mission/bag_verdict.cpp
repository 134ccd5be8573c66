// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_verdict.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>

#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/bag_recording.hpp"

namespace tutti::mission {
namespace {

/// As a shell takes it for one word.
std::string word(const std::string& path) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("_-./+:@%=,").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!path.empty() && std::ranges::all_of(path, is_plain)) return path;
  std::string out = "'";
  for (const char c : path) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// Why no closure can be found with what the robot has seen.
std::string without_sensors(const BagRecording& bag) {
  return fmt::format(
      "{}: odometry alone joins no maps: no scans, and no images ({}); record a topic of "
      "sensor_msgs/PointCloud2, or of images with its CameraInfo and /tf_static",
      bag.file, bag.no_images.empty() ? "none are there" : bag.no_images);
}

}  // namespace

BagVerdict judge_bag(const std::filesystem::path& bag, const std::set<std::string>& robots) {
  const std::set<std::string> names = robots.empty() ? std::set{robot_of_bag(bag)} : robots;
  std::string line = "tutti run";
  bool has_scans = true;
  for (const std::string& name : names) {
    RobotConfig robot;
    robot.name = name;
    robot.bag = bag.string();
    const auto read = read_bag({}, robot, true);
    if (!read) return {false, "not ready: " + read.error().message};
    if (read->scans.empty() && read->cameras.empty()) return {false, "not ready: " + without_sensors(*read)};
    has_scans = has_scans && !read->scans.empty();
    line += fmt::format(" --bag {}", word(name + "=" + bag.string()));
  }
  line += fmt::format(" --out out/{}", robot_of_bag(bag));
  if (!has_scans) line += " --set closures.verifier=visual";
  return {true, "ready: " + line};
}

}  // namespace tutti::mission
