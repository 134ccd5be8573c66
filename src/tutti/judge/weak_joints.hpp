// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// Two sides of a map that no closure of the map joins, though closures that were refused would.
struct WeakJoint {
  /// The nodes at the ends of the one segment of odometry that joins the sides; no refused closure across ends between
  /// them. Nothing: the sides are two parts of the map.
  std::optional<std::pair<std::size_t, std::size_t>> odometry;
  struct Across {
    std::size_t closure = 0;       ///< A refused one, as position among `closures`.
    bool leads_to_second = false;  ///< From the first side to the second, which is the one with odometry->second.
    bool operator==(const Across&) const = default;
  };
  std::vector<Across> across;
};

/// All weak joints that at least `least` refused closures lead across. `map`: its first `odometry_edges` edges are
/// odometry, all others closures of the map. `refused`: positions among `closures`. Takes time linear in the map, and
/// in the closures across for every edge of odometry that alone joins its sides.
std::vector<WeakJoint> weak_joints(const PoseGraph& map, std::size_t odometry_edges,
                                   std::span<const PoseGraphEdge> closures, std::span<const std::size_t> refused,
                                   std::size_t least);

/// How most places have a joint.
struct JointAgreement {
  std::size_t closure = 0;  ///< The closure whose joint it is, as position among `closures`.
  Pose3 T_first_second;     ///< Moves the second side there, in the frame that `poses` give both.
  /// With the sides laid so, a quarter of the places, and at least `least_places`, err by no more: the median of a
  /// place's closures, squared, by their own covariances.
  double error = 0.0;
};

/// `places`: the closures across (as positions among `closures`) by pair of places. Those of one pair count as one
/// witness, since two places that look alike make all of them wrong. At least `least_places` of them, and none empty.
/// Takes the square of the number of closures.
JointAgreement most_agreed(std::span<const Pose3> poses, std::span<const PoseGraphEdge> closures,
                           const WeakJoint& joint, std::span<const std::vector<std::size_t>> places,
                           std::size_t least_places);

}  // namespace tutti::judge
