// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_trajectories.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace {

/// Odometry flies where it states more than kFlight times the usual speed, by the segments' time: keyframes come by
/// distance, so a robot whose odometry diverges has most of all steps, but not of the time. A step of more than
/// kMostFlight times the usual speed is none that passes a robot's OdometryWatch; a map that took it for odometry would
/// be too ill-conditioned for a covariance.
constexpr double kFlight = 3.0, kMostFlight = 1000.0;

/// The steps of one segment that take time.
struct Speeds {
  std::vector<double> mps;
  double total_s = 0.0;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The value, or the least one above 0.
double positive(double value) { return std::max(value, std::numeric_limits<double>::min()); }

/// The median of the segments' medians by the time that they took. `segments` is not empty.
double median_by_time(const std::map<std::size_t, Speeds>& segments) {
  std::vector<std::pair<double, double>> medians;  // m/s, s
  double total_s = 0.0;
  for (const auto& [first, speeds] : segments) {
    medians.emplace_back(median(speeds.mps), speeds.total_s);
    total_s += speeds.total_s;
  }
  std::ranges::sort(medians);
  auto middle = medians.begin();
  for (double slower_s = middle->second; slower_s < 0.5 * total_s;) slower_s += (++middle)->second;
  return middle->first;
}

}  // namespace

OdometryTrajectories::OdometryTrajectories(std::span<const double> seconds, std::span<const PoseGraphEdge> odometry)
    : at_(seconds.size()) {
  const std::size_t nodes = seconds.size();
  std::vector<std::vector<Pose3>> poses(nodes, {Pose3{}});
  std::vector<std::vector<Matrix6d>> steps(nodes, {Matrix6d::Zero()});
  for (std::size_t i = 0; i < nodes; ++i) at_[i] = {.segment = i, .seconds = seconds[i]};
  std::map<std::size_t, Speeds> speeds;  // by the segments' first nodes
  std::vector<const PoseGraphEdge*> step_to(nodes, nullptr);
  for (const PoseGraphEdge& edge : odometry) step_to[edge.to] = &edge;
  for (std::size_t i = 0; i < nodes; ++i) {
    if (step_to[i] == nullptr) continue;
    const PoseGraphEdge& step = *step_to[i];
    const At& before = at_[step.from];
    const Matrix6d covariance = inverse_of(step.information);
    at_[i] = {.segment = before.segment,
              .position = before.position + 1,
              .seconds = seconds[i],
              .turn_variance = before.turn_variance + covariance.bottomRightCorner<3, 3>().trace(),
              .pose = before.pose * step.T_from_to};
    poses[before.segment].push_back(at_[i].pose);
    steps[before.segment].push_back(covariance);
    if (const double duration_s = seconds[i] - seconds[step.from]; duration_s > 0.0) {
      Speeds& own = speeds[before.segment];
      own.mps.push_back(step.T_from_to.translation.norm() / duration_s);
      own.total_s += duration_s;
    }
  }
  std::vector<double> all;
  for (const auto& [first, own] : speeds) all.insert(all.end(), own.mps.begin(), own.mps.end());
  usual_speed_ = positive(all.empty() ? 0.0 : median(std::move(all)));
  const double healthy_speed = speeds.empty() ? usual_speed_ : std::min(usual_speed_, median_by_time(speeds));
  for (std::size_t i = 0; i < nodes; ++i) {
    if (step_to[i] == nullptr) continue;
    const double stated_m = step_to[i]->T_from_to.translation.norm();
    const double took_s = std::max(0.0, seconds[i] - seconds[step_to[i]->from]), usual_m = usual_speed_ * took_s;
    const bool flies = stated_m > kFlight * healthy_speed * took_s && stated_m < kMostFlight * usual_m;
    at_[i].reach_m = at_[step_to[i]->from].reach_m + (flies ? std::max(stated_m, usual_m) : usual_m);
  }
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
