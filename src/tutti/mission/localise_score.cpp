// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/localise_score.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {

const MapReference::Error& MapReference::nearest(const Eigen::Vector3d& p_world) const {
  const auto away = [&](const Error& error) { return (error.p_world - p_world).squaredNorm(); };
  return *std::ranges::min_element(errors, {}, away);
}

std::optional<MapReference> lay_on_map(const std::vector<evaluation::PosePair>& pairs) {
  if (pairs.size() < 3) return std::nullopt;
  std::vector<Eigen::Vector3d> in_world, in_reference;
  for (const evaluation::PosePair& pair : pairs) {
    in_world.push_back(pair.estimate.translation);
    in_reference.push_back(pair.reference.translation);
  }
  MapReference out{.T_world_reference = align_points(in_world, in_reference), .errors = {}};
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Eigen::Vector3d p_world = out.T_world_reference * in_reference[k];
    out.errors.push_back({p_world, in_world[k] - p_world});
  }
  return out;
}

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
    const Pose3 truth = map.T_world_reference * pair.reference;
    const Vector6d error = local(pair.estimate, truth);
    const Eigen::Vector3d& map_error = map.nearest(truth.translation).by_m;
    const Eigen::Vector3d in_map = error.head<3>() + pair.estimate.rotation.conjugate() * map_error;
    const double metres = error.head<3>().norm(), angle_deg = error.tail<3>().norm() / kRadPerDeg;
    ++out.scored;
    if (metres > LocaliseScore::kWrong_m || angle_deg > LocaliseScore::kWrong_deg)
      ++out.wrong;
    else
      out.right_last = pair.stamp;
    squares += metres * metres;
    map_squares += map_error.squaredNorm();
    in_map_squares += in_map.squaredNorm();
    out.max_m = std::max(out.max_m, metres);
    degrees.push_back(angle_deg);
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 3; ++k)
        if (std::abs(in_map[axis]) <= (k + 1) * std::sqrt(covariance(axis, axis))) out.within[k] += 1.0 / 3.0;
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
