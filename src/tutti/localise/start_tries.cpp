// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/start_tries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::localise {
namespace {

// Registration finds the pose from within half of these.
constexpr double kTryStep_m = 1.5, kTryStep_rad = 15.0 * kRadPerDeg;
constexpr double kReach_sigma = 2.0;
constexpr double kLevel_m = 1.5;  // levels are this much above each other
// A start pose is not surer than this, whatever it states.
constexpr double kLeastStart_m = 0.3, kLeastStart_rad = 5.0 * kRadPerDeg;

double heading(const Eigen::Quaterniond& R) {
  const Eigen::Vector3d forward = R * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

/// Steps to either side, so that the ones between reach `sigma` kReach_sigma times.
int steps_to(double sigma, double step) {
  return std::max(0, static_cast<int>(std::ceil((kReach_sigma * sigma - step / 2.0) / step)));
}

/// A level of a floor, and the pose of the nearest keyframe there, in the plane.
struct Level {
  std::uint32_t floor = 1;
  Pose3 T_world_body;
  double away_m = 0.0;
};

/// The nearest first, of one floor or all; where the start pose has a height, that floor's nearest alone.
std::vector<Level> nearest_on_levels(const KnownMap& map, const StartPose& start) {
  const Eigen::Vector2d at = start.T_world_body->T_a_b.translation.head<2>();
  std::vector<Level> near;
  for (const auto& [id, entry] : map.submaps) {
    if (start.floor && entry.floor != *start.floor) continue;
    const Pose3 T_world_odom = entry.T_world_odom();
    for (const Keyframe& keyframe : entry.submap->keyframes) {
      const Pose3 pose = T_world_odom * keyframe.T_odom_body;
      const double away_m = (pose.translation.head<2>() - at).norm();
      if (away_m < kNearStart_m) near.push_back({entry.floor, pose, away_m});
    }
  }
  std::ranges::stable_sort(near, {}, &Level::away_m);
  std::vector<Level> out;
  for (const Level& one : near) {
    const auto is_same = [&](const Level& other) {
      const double height_m = other.T_world_body.translation.z() - one.T_world_body.translation.z();
      return other.floor == one.floor && (!start.is_planar || std::abs(height_m) < kLevel_m);
    };
    if (std::ranges::none_of(out, is_same)) out.push_back(one);
  }
  return out;
}

/// The start pose at the height, and as level, as a robot stood there.
RelativePose on_level(const RelativePose& start, const Pose3& level) {
  RelativePose out = start;
  out.T_a_b.translation.z() = level.translation.z();
  const Eigen::Vector3d up = level.rotation * Eigen::Vector3d::UnitZ();
  out.T_a_b.rotation = rotation_between(Eigen::Vector3d::UnitZ(), up) *
                       Eigen::AngleAxisd(heading(start.T_a_b.rotation), Eigen::Vector3d::UnitZ());
  for (const int row : {2, 3, 4}) {
    out.covariance.row(row).setZero();
    out.covariance.col(row).setZero();
  }
  return out;
}

std::vector<Pose3> around(const RelativePose& start) {
  const Matrix6d& covariance = start.covariance;
  const double sigma_m = std::sqrt(std::max(covariance(0, 0), covariance(1, 1)));
  const int n = steps_to(sigma_m, kTryStep_m);
  const int turns = std::min(steps_to(std::sqrt(covariance(5, 5)), kTryStep_rad), 12);
  std::vector<std::pair<double, Pose3>> out;
  for (int x = -n; x <= n; ++x)
    for (int y = -n; y <= n; ++y)
      for (int turn = -turns; turn <= (turns == 12 ? 11 : turns); ++turn) {
        const Eigen::Vector3d shift(kTryStep_m * x, kTryStep_m * y, 0.0);
        const double radians = kTryStep_rad * turn;
        out.emplace_back(
            shift.squaredNorm() / std::max(covariance(0, 0), covariance(1, 1)) + radians * radians / covariance(5, 5),
            start.T_a_b * Pose3{so3_exp({0.0, 0.0, radians}), shift});
      }
  std::ranges::stable_sort(out, [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Pose3> poses;
  for (auto& [distance, pose] : out)
    if (poses.size() < kMostTries) poses.push_back(pose);
  return poses;
}

}  // namespace

Result<std::vector<StartTries>> tries_of(const KnownMap& map, const StartPose& start) {
  RelativePose given = start.T_world_body.value();
  const Eigen::Vector3d at = given.T_a_b.translation;
  const double sigma_m = std::sqrt(std::max(given.covariance(0, 0), given.covariance(1, 1)));
  if (sigma_m > kMostStartSigma_m)
    return fail(ErrorCode::invalid,
                "a start pose with a standard deviation of {:.1f} m, expected {} m at most: without one the whole map "
                "is searched",
                sigma_m, kMostStartSigma_m);
  if (start.floor && (*start.floor < 1 || *start.floor > map.floors))
    return fail(ErrorCode::invalid, "a start pose on floor {}, expected 1 to {}", *start.floor, map.floors);
  const std::vector<Level> levels = nearest_on_levels(map, start);
  if (levels.empty())
    return fail(ErrorCode::invalid,
                "a start pose at {:.1f}, {:.1f} m, expected one within {} m of where the map's "
                "robots were",
                at.x(), at.y(), kNearStart_m);
  const Matrix6d least = diagonal_covariance(kLeastStart_m, kLeastStart_rad);
  std::vector<StartTries> out;
  for (const Level& level : levels) {
    StartTries tries{.floor = level.floor,
                     .T_world_body = start.is_planar ? on_level(given, level.T_world_body) : given,
                     .from = {}};
    tries.T_world_body.covariance += least;
    tries.from = around(tries.T_world_body);
    out.push_back(std::move(tries));
  }
  return out;
}

}  // namespace tutti::localise
