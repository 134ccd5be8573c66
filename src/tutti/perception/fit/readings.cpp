// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/internal/readings.hpp"

#include <array>
#include <cmath>

#include "tutti/perception/fit/odometry_fit.hpp"

namespace tutti::fit {
namespace {

constexpr double kOffsetStep_s = 0.25;
constexpr double kSameScale = 0.3;  // of the logarithm: nearer ones are left to the solution

constexpr std::array<Reading, 7> kReadings{{
    {std::nullopt, [](const Pose3& T) { return T; }},
    {MisfitKind::positions_ned,
     [](const Pose3& T) {
       return Pose3{T.rotation, {T.translation.y(), T.translation.x(), -T.translation.z()}};
     }},
    {MisfitKind::upside_down,  // its y mirrored, as a cloud is whose y has the wrong sign
     [](const Pose3& T) {
       const Eigen::Quaterniond& q = T.rotation;
       return Pose3{Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z()),
                    {T.translation.x(), -T.translation.y(), T.translation.z()}};
     }},
    {MisfitKind::inverse_poses, [](const Pose3& T) { return T.inverse(); }},
    {MisfitKind::inverse_attitudes,
     [](const Pose3& T) {
       return Pose3{T.rotation.conjugate(), T.translation};
     }},
    {MisfitKind::w_first,
     [](const Pose3& T) {
       const Eigen::Quaterniond& q = T.rotation;  // its x is w, its y is x, ..
       return Pose3{Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), T.translation};
     }},
    {MisfitKind::w_last,
     [](const Pose3& T) {
       const Eigen::Quaterniond& q = T.rotation;  // its w is x, its x is y, ..
       return Pose3{Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.translation};
     }},
}};

/// The scans' distance over odometry's.
double distance_ratio(const WeighedSteps& weighed, const Motions& motions) {
  double scans = 1e-9, odometry = 1e-9;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (!motions[k]) continue;
    scans += weighed.steps[k].T_from_to.translation.norm();
    odometry += motions[k]->translation.norm();
  }
  return scans / odometry;
}

}  // namespace

std::span<const Reading> readings() { return kReadings; }

Trajectory read_as(const Reading& reading, const Trajectory& odometry) {
  Trajectory out = odometry;
  for (StampedPose& pose : out) pose.pose = reading.read(pose.pose);
  return out;
}

Beginning best_beginning(const WeighedSteps& weighed, const Trajectory& odometry) {
  std::optional<Beginning> best;
  const int most = static_cast<int>(kMostOffset_s / kOffsetStep_s);
  for (int k = -most; k <= most; ++k) {
    MotionModel model{.offset_s = k * kOffsetStep_s};
    const Motions at = motions(weighed, odometry, model.offset_s);
    const double log_scale = std::log(distance_ratio(weighed, at));
    if (std::abs(log_scale) > kSameScale) model.log_scale = log_scale;
    model.E.rotation = best_rotation(weighed, at);
    const Cost cost = cost_of(weighed, at, model);
    if (cost.known < kFewestSteps) continue;
    if (!best || cost.mean < best->cost.mean) best = Beginning{model, cost};
  }
  return best.value_or(Beginning{});
}

}  // namespace tutti::fit
