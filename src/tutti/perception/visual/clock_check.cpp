// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/clock_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::visual {
namespace {

constexpr std::size_t kFew = 10;  // pairs, from which nothing is concluded

}  // namespace

double epipolar_error_rad(const Pose3& T_first_second, const Eigen::Vector3d& ray_first,
                          const Eigen::Vector3d& ray_second) {
  const Eigen::Vector3d turned = T_first_second.rotation * ray_second;  // in the first camera
  const Eigen::Vector3d volume = T_first_second.translation.cross(turned);
  const Eigen::Vector3d normal_first = T_first_second.translation.cross(ray_first);
  const double area = std::max(volume.norm(), normal_first.norm());
  return area > 0.0 ? std::abs(ray_first.dot(volume)) / area : 0.0;
}

void ClockCheck::add(Timestamp stamp, const TrackedImage& image) {
  if (pairs_.size() >= kPairs || (!seen_.empty() && stamp - last_ < kPair_s)) return;
  Pair pair{last_, stamp, {}};
  std::map<std::uint64_t, Eigen::Vector3d> now;
  for (const TrackedKeypoint& it : image.keypoints) {
    const auto ray = it.track != 0 ? unproject(camera_.model, it.pixel.cast<double>()) : std::nullopt;
    if (!ray) continue;
    if (const auto before = seen_.find(it.track); before != seen_.end()) pair.rays.emplace_back(before->second, *ray);
    now.emplace(it.track, *ray);
  }
  if (!pair.rays.empty()) pairs_.push_back(std::move(pair));
  last_ = stamp;
  seen_ = std::move(now);
}

std::optional<double> ClockCheck::error_rad(const Trajectory& odometry, double offset_s, double roll_rad) const {
  constexpr double kWrongTrack_rad = 0.05;
  double sum = 0.0;
  std::size_t rays = 0, pairs = 0;
  Pose3 T_body_camera = camera_.T_body_camera;
  T_body_camera.rotation = T_body_camera.rotation * so3_exp(roll_rad * Eigen::Vector3d::UnitZ());
  for (const Pair& pair : pairs_) {
    const auto first = pose_at(odometry, pair.first + offset_s), second = pose_at(odometry, pair.second + offset_s);
    if (!first || !second) continue;
    ++pairs;
    const Pose3 T = (*first * T_body_camera).inverse() * *second * T_body_camera;
    for (const auto& [a, b] : pair.rays) sum += std::min(epipolar_error_rad(T, a, b), kWrongTrack_rad);
    rays += pair.rays.size();
  }
  if (2 * pairs < pairs_.size() || rays == 0) return std::nullopt;
  return sum / static_cast<double>(rays);
}

std::optional<int> ClockCheck::roll_deg(const Trajectory& odometry) const {
  const auto as_stated = error_rad(odometry, 0.0, 0.0);
  if (!as_stated || pairs_.size() < kFew) return std::nullopt;
  std::optional<int> best;
  double least = kConvincing * *as_stated;
  for (const int degrees : {90, 180, 270})
    if (const auto error = error_rad(odometry, 0.0, degrees * kRadPerDeg); error && *error < least) {
      least = *error;
      best = degrees;
    }
  return best;
}

std::optional<double> ClockCheck::offset_s(const Trajectory& odometry) const {
  const auto as_stamped = error_rad(odometry, 0.0, 0.0);
  if (!as_stamped || pairs_.size() < kFew) return std::nullopt;
  double best_s = 0.0, least = kConvincing * *as_stamped;
  const int steps = static_cast<int>(std::lround(kLargest_s / kStep_s));
  for (int i = -steps; i <= steps; ++i) {
    const auto error = error_rad(odometry, i * kStep_s, 0.0);
    if (!error || *error >= least) continue;
    least = *error;
    best_s = i * kStep_s;
  }
  return best_s != 0.0 ? std::optional(best_s) : std::nullopt;
}

}  // namespace tutti::visual
