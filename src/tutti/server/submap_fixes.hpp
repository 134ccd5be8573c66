// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "tutti/server/fix_alignment.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The fixes of one submap, placed on the map's nodes.
struct SubmapFixes {
  SubmapId submap;
  std::uint32_t component = 0;  ///< The map's component that the submap is in.
  struct Fix {
    std::size_t node = 0;  ///< Index of the map's node.
    Eigen::Vector3d p_node_antenna;
    Eigen::Vector3d p_enu;
    Eigen::Matrix3d covariance;  ///< In enu, m^2; can be inverted.
  };
  std::vector<Fix> fixes;
  double correlation = 1.0;  ///< Factor on their common variance, because neighbouring submaps share errors.
};

/// Appends the points of one submap for align_fixes() to `out`; `submap` is its position in the caller's list.
void add_points(const SubmapFixes& of, std::size_t submap, std::span<const Pose3> T_world_body,
                std::vector<FixedPoint>& out);

/// The fixes of a map's submaps in one local frame.
struct PlacedFixes {
  Geodetic origin;  ///< Origin of enu.
  std::vector<SubmapFixes> submaps;
};

/// The fixes of all submaps in the map; nothing when there are none. The origin is the first fix that is not far from
/// most others, so that it stays the same while the map grows.
std::optional<PlacedFixes> place_fixes(const MapEstimate& map, const SubmapSet& submaps, double correlation_s);

/// Factor on the variances of positions with these squared misfits (in standard deviations; the call sorts them), 1
/// unless the variances are far too small.
double understated_by(std::vector<double>& misfits);

/// Raises the covariances of receivers whose fixes within a submap differ by far more than stated, until they agree;
/// returns the factors. The absolute errors may be larger still.
std::map<ChainId, double> raise_to_neighbours(const MapEstimate& map, PlacedFixes& placed,
                                              const std::map<std::uint32_t, Pose3>& T_enu_world);

/// The fixes of a submap, combined into one.
struct OneFix {
  std::size_t used = 0;  ///< Number of fixes that agree; 0 when at most half do.
  std::size_t node = 0;  ///< Index of the node nearest to the antenna's mean position.
  Eigen::Vector3d p_node_antenna = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_enu = Eigen::Vector3d::Zero();
  /// That of a single fix, because the fixes share their errors.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Combines the fixes on which most of a submap agrees; `T_enu_world` only rotates them into one frame.
OneFix join(const SubmapFixes& submap, std::span<const Pose3> T_world_body, const Pose3& T_enu_world);

}  // namespace tutti::server
