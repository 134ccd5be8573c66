// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/localise/state.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::mission {

/// The reference of a map that does not move, laid on it by the robots that made it.
struct MapReference {
  Pose3 T_world_reference;
  struct Error {
    Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< A pose of the map by the reference, m.
    Eigen::Vector3d by_m = Eigen::Vector3d::Zero();     ///< What the map has it off by, in its frame.
  };
  std::vector<Error> errors;  ///< Not empty.
  /// The nearest pose, with the map's own error there, which nobody who is localised in the map can know.
  [[nodiscard]] const Error& nearest(const Eigen::Vector3d& p_world) const;
};
/// From poses of the map and the reference's of the same moments; nothing from fewer than three.
std::optional<MapReference> lay_on_map(const std::vector<evaluation::PosePair>& pairs);

/// How far published poses are from where the robot was, in the map's frame: by the map's reference, and by nothing of
/// the robot that is scored.
struct LocaliseScore {
  std::size_t scored = 0;  ///< Poses of state localised with a reference.
  std::size_t wrong = 0;   ///< By more than kWrong_m or kWrong_deg; some of those.
  static constexpr double kWrong_m = 1.0, kWrong_deg = 5.0;
  std::optional<Timestamp> right_last;  ///< The last that is not wrong.
  double rmse_m = 0.0, max_m = 0.0, median_deg = 0.0;
  double map_rmse_m = 0.0;     ///< The map's own errors at these places.
  double in_map_rmse_m = 0.0;  ///< Without these: how far off the robot is from what the map shows about it.
  double within[3] = {};       ///< Share of the latter along x, y and z within 1, 2 and 3 standard deviations.
};
/// `floors` has the reference of each floor of the map; poses on one that has none are not scored.
LocaliseScore score_of(const std::vector<localise::Located>& course, const Trajectory& reference,
                       const std::vector<std::optional<MapReference>>& floors,
                       const evaluation::AssociationConfig& association);

}  // namespace tutti::mission
