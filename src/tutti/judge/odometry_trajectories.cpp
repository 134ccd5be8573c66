// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_trajectories.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tutti::judge {
namespace {

/// The middle one, or the least above 0 that a number can be.
double median(std::vector<double> values) {
  constexpr double kSlowest = std::numeric_limits<double>::min();
  if (values.empty()) return kSlowest;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return std::max(*middle, kSlowest);
}

}  // namespace

OdometryTrajectories::OdometryTrajectories(std::span<const double> seconds, std::span<const PoseGraphEdge> odometry)
    : at_(seconds.size()) {
  const std::size_t nodes = seconds.size();
  std::vector<std::vector<Pose3>> poses(nodes, {Pose3{}});
  std::vector<std::vector<Matrix6d>> steps(nodes, {Matrix6d::Zero()});
  for (std::size_t i = 0; i < nodes; ++i) at_[i] = {.segment = i, .seconds = seconds[i]};
  std::vector<double> speeds;
  std::vector<const PoseGraphEdge*> step_to(nodes, nullptr);
  for (const PoseGraphEdge& edge : odometry) step_to[edge.to] = &edge;
  for (std::size_t i = 0; i < nodes; ++i) {
    if (step_to[i] == nullptr) continue;
    const PoseGraphEdge& step = *step_to[i];
    const At& before = at_[step.from];
    const Matrix6d covariance = step.information.llt().solve(Matrix6d::Identity());
    at_[i] = {before.segment, before.position + 1, seconds[i],
              before.turn_variance + covariance.bottomRightCorner<3, 3>().trace(), before.pose * step.T_from_to};
    poses[before.segment].push_back(at_[i].pose);
    steps[before.segment].push_back(covariance);
    if (const double duration_s = seconds[i] - seconds[step.from]; duration_s > 0.0)
      speeds.push_back(step.T_from_to.translation.norm() / duration_s);
  }
  usual_speed_ = median(std::move(speeds));
  for (std::size_t i = 0; i < nodes; ++i)
    covariance_.push_back(at_[i].segment == i ? SegmentCovariance(poses[i], steps[i]) : SegmentCovariance());
}

RelativePose OdometryTrajectories::between(std::size_t a, std::size_t b) const {
  const auto [first, last] = std::minmax(at_[a].position, at_[b].position);
  const RelativePose forth{first == at_[a].position ? T(a, b) : T(b, a), covariance_[at_[a].segment](first, last)};
  return first == at_[a].position ? forth : inverse(forth);
}

double OdometryTrajectories::turn_variance(std::size_t a, std::size_t b) const {
  return std::abs(at_[a].turn_variance - at_[b].turn_variance);
}

}  // namespace tutti::judge
