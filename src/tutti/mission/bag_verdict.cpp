// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_verdict.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <utility>

#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/mission/misfit_record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/robot_alone.hpp"
#include "tutti/perception/fit/odometry_fit.hpp"

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
      "{}: odometry alone merges no maps: no scans, and no images ({}); record a topic of "
      "sensor_msgs/PointCloud2, or of images with its CameraInfo and /tf_static",
      bag.file, bag.no_images.empty() ? "none are there" : bag.no_images);
}

/// Which verifier finds closures with what the robots have seen; or why there is none. Empty: of a bag that cannot be
/// read.
Result<std::string> verifier_for(const std::vector<RobotConfig>& robots) {
  bool has_scans = true, has_images = true;
  for (const RobotConfig& robot : robots) {
    const auto read = read_bag({}, robot, true);
    if (!read) return std::string();  // begin() says why, with the robot's name
    if (read->scans.empty() && read->cameras.empty()) return fail(ErrorCode::invalid, "{}", without_sensors(*read));
    has_scans = has_scans && !read->scans.empty();
    has_images = has_images && !read->cameras.empty();
  }
  return has_scans ? "lidar" : has_images ? "visual" : "sensors";
}

MissionConfig mission_of(const std::vector<RobotConfig>& robots, const std::string& verifier) {
  MissionConfig config;
  config.robots = robots;
  config.closures.verifier = verifier;
  return config;
}

/// Says what is known of a robot in which nothing contradicts.
std::string compared(const Recording& recording, std::uint64_t steps) {
  if (!recording.scans && !recording.visual) return "no scans or images to compare its odometry with";
  const std::string seen = recording.scans ? "scans" : "images";
  if (steps >= fit::kFewestSteps) return fmt::format("{} and odometry say the same motion", seen);
  return fmt::format(
      "not known: {} motions could be compared with its odometry, expected {} and more{}", steps, fit::kFewestSteps,
      recording.scans ? "; scans too few or with too few points"
                      : "; that takes two cameras or one with depth, and points nearer than some metres");
}

}  // namespace

BagVerdict judge_bag(const std::filesystem::path& bag, const std::set<std::string>& robots) {
  if (const Status one = check_is_one(bag); !one) return {.text = "not ready: " + one.error().message};
  const std::string plain = MissionConfig{}.closures.verifier;
  std::vector<RobotConfig> configs;
  std::string line = "tutti run";
  for (const std::string& name : robots.empty() ? std::set{robot_of_bag(bag)} : robots) {
    RobotConfig robot;
    robot.name = name;
    robot.bag = bag.string();
    configs.push_back(std::move(robot));
    line += fmt::format(" --bag {}", word(name + "=" + bag.string()));
  }
  line += fmt::format(" --out out/{}", robot_of_bag(bag));
  MissionConfig mission = mission_of(configs, plain);
  auto input = load_input(mission, {}, 1);
  if (!input) {
    const auto verifier = verifier_for(configs);
    if (!verifier) return {.text = "not ready: " + verifier.error().message};
    if (!verifier->empty() && *verifier != plain) {
      mission = mission_of(configs, *verifier);
      input = load_input(mission, {}, 1);
      line += " --set closures.verifier=" + *verifier;
    }
  }
  if (!input) return {.text = "not ready: " + input.error().message};
  BagVerdict out{true, "ready: " + line, {}, std::move(mission), {}};
  for (MissionRecording& robot : input->robots) std::ranges::move(robot.warnings, std::back_inserter(out.warnings));
  out.input = std::move(*input);
  return out;
}

BagCheck check_bag(const BagVerdict& verdict, const std::function<bool(double share)>& stop) {
  BagCheck out;
  const double robots = static_cast<double>(verdict.input.robots.size());
  for (std::size_t k = 0; k < verdict.input.robots.size(); ++k) {
    const MissionRecording& robot = verdict.input.robots[k];
    const std::string& name = robot.recording.name;
    const auto [misfits, steps] = fit_alone(
        robot, verdict.mission, [&](double share) { return stop && stop((static_cast<double>(k) + share) / robots); });
    for (const fit::Misfit& misfit : misfits) out.lines.push_back(warning_of(name, record_of(misfit, robot)));
    if (misfits.empty()) out.lines.push_back(fmt::format("{}: {}", name, compared(robot.recording, steps)));
    out.fits = out.fits && misfits.empty();
  }
  return out;
}

}  // namespace tutti::mission
