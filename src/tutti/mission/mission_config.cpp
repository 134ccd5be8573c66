// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/mission_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "tutti/base/plain_name.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace {

constexpr double kShortestUpdate_s = 0.001;
constexpr std::size_t kLongestName = 64;
constexpr double kRounding = 1e-3;  // of a quaternion's norm

using Problem = std::function<void(std::string)>;

void check_outages(const bus::LinkConfig& link, const std::string& path, const Problem& problem) {
  for (std::size_t i = 0; i < link.outages.size(); ++i)
    if (const auto& [from_s, until_s] = link.outages[i]; until_s < from_s)
      problem(fmt::format("{}.outages.{}.until_s: is {}, expected at least from_s = {}", path, i, until_s, from_s));
}

void check_links(const MissionConfig& config, const Problem& problem) {
  check_outages(config.link, "link", problem);
  for (std::size_t i = 0; i < config.robot_links.size(); ++i)
    check_outages(config.robot_links[i].link, fmt::format("robot_links.{}.link", i), problem);
}

void check_images(const RobotConfig& robot, const std::string& path, const Problem& problem) {
  const ImagesConfig& images = robot.images;
  const bool from_maplab = !images.maplab_submaps.empty();
  if (robot.odometry.file.empty() && robot.bag.empty() && robot.graph.file.empty() && !from_maplab)
    problem(path + ".odometry.file: missing");
  if (!robot.bag.empty() && (!robot.odometry.file.empty() || !robot.scans.empty() || from_maplab))
    problem(path + ".bag: given, and odometry or scans of files too, expected one of them");
  const BagTopicsConfig& topics = robot.topics;
  if (robot.bag.empty() && !(topics.odometry + topics.scans + topics.images + topics.depth + topics.imu).empty())
    problem(path + ".topics: given, but there is no bag");
  if (!robot.odometry.file.empty() && from_maplab)
    problem(path + ".odometry.file: given, but images.maplab_submaps have the odometry");
  if ((images.euroc_folder.empty() ? 0 : 1) + (images.list.empty() ? 0 : 1) + (from_maplab ? 1 : 0) > 1)
    problem(path + ".images: several of euroc_folder, list and maplab_submaps are given, expected one");
  if (images.list.empty() != images.cameras.empty())
    problem(fmt::format("{}.images.{}: missing, but images.{} is given", path, images.list.empty() ? "list" : "cameras",
                        images.list.empty() ? "cameras" : "list"));
  if (images.time_offset_s != 0.0 && !images.has_files() && robot.bag.empty())
    problem(path + ".images.time_offset_s: given, but there is no images.euroc_folder, images.list or bag");
  if (!images.depth.list.empty() && images.list.empty())
    problem(path + ".images.depth.list: given, but there is no images.list");
  if (!images.imu.empty() && !images.euroc_folder.empty())
    problem(path + ".images.imu: given, but images.euroc_folder has its own in imu0");
}

void check_graphs(const MissionConfig& config, const Problem& problem) {
  if (!has_graphs(config)) return;
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const RobotConfig& robot = config.robots[i];
    if (robot.graph.file.empty())
      problem(fmt::format("robots.{}.graph.file: missing, but other robots are from a graph", i));
    else if (!robot.odometry.file.empty() || !robot.bag.empty() || !robot.scans.empty() || robot.images.is_given())
      problem(fmt::format("robots.{}.graph: given, and odometry, a bag, scans or images too, expected one of them", i));
  }
  if (config.odometry_hz > 0.0) problem("odometry_hz: given, but the poses of a graph are its keyframes");
}

void check_imu(const MissionConfig& config, const Problem& problem) {
  if (config.refinement.merge.use_imu && !config.agent.submap.visual.send_imu)
    problem(
        "refinement.merge.use_imu: true, but robots send nothing of their IMU: agent.submap.visual.send_imu is false");
}

void check_robots(const MissionConfig& config, const Problem& problem) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const RobotConfig& robot = config.robots[i];
    const std::string path = fmt::format("robots.{}", i);
    if (robot.name.empty()) problem(path + ".name: missing");
    if (const std::string why = problem_of_name(robot.name); !why.empty()) problem(path + ".name: " + why);
    if (!names.insert(robot.name).second) problem(fmt::format("{}.name: '{}' is there twice", path, robot.name));
    check_images(robot, path, problem);
    if (!robot.reference_offset_m.empty() && robot.reference_offset_m.size() != 3)
      problem(fmt::format("{}.reference_offset_m: {} numbers, expected 3", path, robot.reference_offset_m.size()));
    if (!robot.antenna_m.empty() && robot.antenna_m.size() != 3)
      problem(fmt::format("{}.antenna_m: {} numbers, expected 3", path, robot.antenna_m.size()));
    if (const auto T_body_lidar = to_pose(robot.T_body_lidar); !T_body_lidar)
      problem(fmt::format("{}.T_body_lidar.{}", path, T_body_lidar.error().message));
    if (robot.from_share >= robot.to_share)
      problem(fmt::format("{}: from_share {} is not below to_share {}", path, robot.from_share, robot.to_share));
  }
}

/// As many finite numbers as wanted, or none.
Status check_numbers(const std::vector<double>& numbers, std::size_t count, const char* name) {
  if (!numbers.empty() && numbers.size() != count)
    return fail(ErrorCode::configuration, "{}: {} numbers, expected {}", name, numbers.size(), count);
  for (const double number : numbers)
    if (!(std::abs(number) <= kMaxCoordinate_m))
      return fail(ErrorCode::configuration, "{}: holds {}, expected at most {:g} either way", name, number,
                  kMaxCoordinate_m);
  return {};
}

}  // namespace

bool has_graphs(const MissionConfig& config) {
  return std::ranges::any_of(config.robots, [](const RobotConfig& robot) { return !robot.graph.file.empty(); });
}

std::string problem_of_name(const std::string& name) {
  if (name.empty() || is_plain_name(name, kLongestName)) return {};
  return fmt::format("is '{:.80}', expected at most {} letters, digits, '_' and '-'", name, kLongestName);
}

std::vector<std::string> problems_of(const MissionConfig& config) {
  std::vector<std::string> problems;
  const auto problem = [&](std::string text) { problems.push_back(std::move(text)); };
  check_robots(config, problem);
  check_graphs(config, problem);
  check_imu(config, problem);
  check_links(config, problem);
  if (config.server.update_least_s < kShortestUpdate_s)  // every one is a step of the mission
    problem(fmt::format("server.update_least_s: is {}, expected at least {}", config.server.update_least_s,
                        kShortestUpdate_s));
  return problems;
}

std::vector<std::string> problems_of_verifier(const MissionConfig& config) {
  std::vector<std::string> problems;
  const verifiers::VerifierKind& kind = config.closures.kind();
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const RobotConfig& robot = config.robots[i];
    const auto note = [&](const char* what) {
      problems.push_back(fmt::format("robots.{}.{}: missing, but closures.verifier is '{}'", i, what, kind.name));
    };
    if (!robot.bag.empty()) continue;
    if (!kind.uses_images && robot.scans.empty()) note("scans");
    if (!kind.uses_scans && !robot.images.is_given()) note("images");
  }
  return problems;
}

Result<Pose3> to_pose(const LidarPoseConfig& config) {
  const auto& [translation_m, xyzw, rpy_deg] = config;
  if (auto ok = check_numbers(translation_m, 3, "translation_m"); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_numbers(xyzw, 4, "quaternion_xyzw"); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_numbers(rpy_deg, 3, "rpy_deg"); !ok) return tl::unexpected(ok.error());
  if (!xyzw.empty() && !rpy_deg.empty())
    return fail(ErrorCode::configuration, "rpy_deg: given, and quaternion_xyzw too, expected one of them");
  Pose3 pose;
  if (!translation_m.empty()) pose.translation = Eigen::Vector3d(translation_m.data());
  if (!xyzw.empty()) {
    const Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
    if (!(std::abs(q.norm() - 1.0) <= kRounding))
      return fail(ErrorCode::configuration, "quaternion_xyzw: norm is {:.6g}, expected 1 within {}", q.norm(),
                  kRounding);
    pose.rotation = q.normalized();
  }
  if (!rpy_deg.empty())
    pose.rotation = so3_exp(rpy_deg[2] * kRadPerDeg * Eigen::Vector3d::UnitZ()) *
                    so3_exp(rpy_deg[1] * kRadPerDeg * Eigen::Vector3d::UnitY()) *
                    so3_exp(rpy_deg[0] * kRadPerDeg * Eigen::Vector3d::UnitX());
  return pose;
}

Eigen::Vector3d to_rpy_deg(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  return Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))) / kRadPerDeg;
}

}  // namespace tutti::mission
