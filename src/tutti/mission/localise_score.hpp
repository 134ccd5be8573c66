// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/localise/state.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::mission {

/// The reference of a map that does not move, by the robots that made it.
struct MapReference {
  Pose3 T_world_reference;  ///< Lays the reference on the map as a whole.
  /// The map's poses and the reference's of the same moments, by the robot that made them; none is empty.
  std::vector<std::vector<evaluation::PosePair>> drives;
  static constexpr double kInSight_m = 25.0;  ///< Walls that a robot has seen can be seen from so far away.
  /// The nearest one, and those nearest of other drives within kInSight_m, the nearer first.
  [[nodiscard]] std::vector<const evaluation::PosePair*> nearest(const Eigen::Vector3d& p_reference) const;
};
/// From poses of the map and the reference's of the same moments; nothing from fewer than three.
std::optional<MapReference> lay_on_map(std::vector<std::vector<evaluation::PosePair>> drives);
/// T_world_body of a robot that stands to a pose of the map as the reference says: where a map that is bent has it,
/// which is all that can be known in that map.
Pose3 in_map(const evaluation::PosePair& of_map, const Pose3& T_reference_body);

/// How far published poses are from where the robot was: in the map, and by the reference, of which nothing of the
/// robot that is scored ties it to the map.
struct LocaliseScore {
  std::size_t scored = 0;  ///< Poses of state localised with a reference.
  /// In the map by more than kWrong_m or kWrong_deg; some of those. Where a map is torn between two of the robots that
  /// made it, a pose that is right by either of them, in sight, is right.
  std::size_t wrong = 0;
  static constexpr double kWrong_m = 1.0, kWrong_deg = 5.0;
  std::optional<Timestamp> right_last;  ///< The last that is not wrong.
  double rmse_m = 0.0;                  ///< By the reference, the map's own errors in it.
  double map_rmse_m = 0.0;              ///< The map's own errors at these places.
  double in_map_rmse_m = 0.0;           ///< From in_map(), as all that follows.
  double max_m = 0.0, median_deg = 0.0;
  double within[3] = {};  ///< Share of the errors along x, y and z within 1, 2 and 3 standard deviations.
};
/// `floors` has the reference of each floor of the map; poses on one that has none are not scored.
LocaliseScore score_of(const std::vector<localise::Located>& course, const Trajectory& reference,
                       const std::vector<std::optional<MapReference>>& floors,
                       const evaluation::AssociationConfig& association);

}  // namespace tutti::mission
