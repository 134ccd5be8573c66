// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/localise_score.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {

using evaluation::PosePair;

std::vector<const PosePair*> MapReference::nearest(const Eigen::Vector3d& p_reference) const {
  const auto away_m = [&](const PosePair& pair) { return (pair.reference.translation - p_reference).norm(); };
  std::vector<const PosePair*> out;
  for (const std::vector<PosePair>& drive : drives) out.push_back(&*std::ranges::min_element(drive, {}, away_m));
  std::ranges::sort(out, {}, [&](const PosePair* pair) { return away_m(*pair); });
  const auto out_of_sight =
      std::find_if(out.begin() + 1, out.end(), [&](const PosePair* pair) { return away_m(*pair) > kInSight_m; });
  out.erase(out_of_sight, out.end());
  return out;
}

std::optional<MapReference> lay_on_map(std::vector<std::vector<PosePair>> drives) {
  std::erase_if(drives, [](const auto& drive) { return drive.empty(); });
  std::vector<Eigen::Vector3d> in_world, in_reference;
  for (const std::vector<PosePair>& drive : drives)
    for (const PosePair& pair : drive) {
      in_world.push_back(pair.estimate.translation);
      in_reference.push_back(pair.reference.translation);
    }
  if (in_world.size() < 3) return std::nullopt;
  return MapReference{.T_world_reference = align_points(in_world, in_reference), .drives = std::move(drives)};
}

Pose3 in_map(const PosePair& of_map, const Pose3& T_reference_body) {
  return of_map.estimate * of_map.reference.inverse() * T_reference_body;
}

namespace {

bool is_wrong(const Vector6d& error) {
  return error.head<3>().norm() > LocaliseScore::kWrong_m ||
         error.tail<3>().norm() > LocaliseScore::kWrong_deg * kRadPerDeg;
}

/// Where the map has the robot that is said to be at `estimate`.
Pose3 place_in(const MapReference& map, const Pose3& estimate, const Pose3& T_reference_body) {
  const auto by = map.nearest(T_reference_body.translation);
  const auto right = std::ranges::find_if(
      by, [&](const PosePair* pair) { return !is_wrong(local(estimate, in_map(*pair, T_reference_body))); });
  return in_map(right == by.end() ? *by.front() : **right, T_reference_body);
}

}  // namespace

LocaliseScore score_of(const std::vector<localise::Located>& course, const Trajectory& reference,
                       const std::vector<std::optional<MapReference>>& floors,
                       const evaluation::AssociationConfig& association) {
  Trajectory published;
  std::vector<const localise::Located*> of;
  for (const auto& located : course)
    if (located.state == localise::State::localised && located.T_world_body && floors.at(located.floor - 1)) {
      published.push_back({located.stamp, located.T_world_body->T_a_b});
      of.push_back(&located);
    }
  LocaliseScore out;
  double squares = 0.0, map_squares = 0.0, in_map_squares = 0.0;
  std::vector<double> degrees;
  for (const auto& pair : evaluation::associate(published, reference, association)) {
    const auto at = std::ranges::lower_bound(published, pair.stamp, {}, &StampedPose::stamp) - published.begin();
    const localise::Located& located = *of[static_cast<std::size_t>(at)];
    const Matrix6d& covariance = located.T_world_body->covariance;
    const MapReference& map = *floors[located.floor - 1];
    const Pose3 truth = map.T_world_reference * pair.reference, place = place_in(map, pair.estimate, pair.reference);
    const Vector6d error = local(pair.estimate, place);
    const double metres = error.head<3>().norm();
    ++out.scored;
    if (is_wrong(error))
      ++out.wrong;
    else
      out.right_last = pair.stamp;
    squares += (pair.estimate.translation - truth.translation).squaredNorm();
    map_squares += (place.translation - truth.translation).squaredNorm();
    in_map_squares += metres * metres;
    out.max_m = std::max(out.max_m, metres);
    degrees.push_back(error.tail<3>().norm() / kRadPerDeg);
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 3; ++k)
        if (std::abs(error[axis]) <= (k + 1) * std::sqrt(covariance(axis, axis))) out.within[k] += 1.0 / 3.0;
  }
  if (out.scored == 0) return out;
  const auto count = static_cast<double>(out.scored);
  out.rmse_m = std::sqrt(squares / count);
  out.map_rmse_m = std::sqrt(map_squares / count);
  out.in_map_rmse_m = std::sqrt(in_map_squares / count);
  std::ranges::nth_element(degrees, degrees.begin() + static_cast<std::ptrdiff_t>(degrees.size() / 2));
  out.median_deg = degrees[degrees.size() / 2];
  for (double& share : out.within) share /= count;
  return out;
}

}  // namespace tutti::mission
