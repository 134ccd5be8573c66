// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/geometry/geodesy.hpp"
#include "tutti/model/pose_graph.hpp"

/// Where on the earth a map lies, as derived from the fixes of its submaps.
namespace tutti::server {

/// How a map uses position fixes.
struct GeoreferenceConfig {
  std::string mode = "factors";
  double correlation_s = 60.0;
  template <class V>
  void describe(V& v) {
    v.field("mode", mode, one_of({"off", "only", "factors"}),
            "What fixes (NavSatFix) do: 'factors' = the map follows them, each by its covariance; 'only' = the map is "
            "laid on them as it is; 'off' = nothing.");
    v.field("correlation_s", correlation_s, at_least(0.0),
            "Errors of a receiver last about so long: fixes nearer to each other than this count as fewer.");
  }
};

/// Why the fixes of a submap are not used.
enum class FixObjection {
  none,
  contradictory,  ///< They contradict each other.
  misfit,         ///< They do not fit the map that the other fixes make.
  unaligned       ///< Nothing determines how their part of the map lies on the earth.
};
const char* to_string(FixObjection objection);  ///< For people; empty for none.

/// How the fixes of one submap, which count as one, were judged.
struct JudgedFixes {
  SubmapId submap;
  std::size_t fixes = 0;  ///< How many there are.
  std::size_t used = 0;   ///< How many of them are used; 0 where there is an objection.
  FixObjection objection = FixObjection::none;
  double misses_m = 0.0;  ///< Distance between the map and the fixes' common position.
};

/// A part of the map with fixes that do not determine its place on the earth.
struct Unaligned {
  ChainId chain;  ///< The first chain of the part.
  std::string why;
};

/// How the parts of a map that fixes tie to the earth, and thereby join into one, lie on it.
struct Georeference {
  Geodetic origin;    ///< Origin of the frame enu.
  Pose3 T_enu_world;  ///< World of `component`.
  std::uint32_t component = 0;
  bool is_levelled = false;    ///< Fixes do not determine the tilt, so the odometry's z axis was taken as up.
  double sigma_m = 0.0;        ///< Standard deviation of the position of the map's middle,
  double sigma_yaw_rad = 0.0;  ///< and of the rotation about the vertical.
};

/// All that fixes determine of a map.
struct Fixes {
  std::optional<Georeference> georeference;
  std::vector<JudgedFixes> judged;  ///< One for every submap with fixes; sorted by submap.
  std::vector<Unaligned> unaligned;
  std::map<ChainId, double> understated;  ///< Factor on the variances of a receiver's fixes, where above 1.
  /// Edges that tie the map to the earth: from the frame enu, a node after all nodes of the map, to the map's nodes. A
  /// position is an edge without information about rotation.
  std::vector<PoseGraphEdge> edges;
};

}  // namespace tutti::server
