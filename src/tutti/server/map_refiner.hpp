// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

/// What takes the place of one step of odometry: from a keyframe to the next one of its chain.
struct RefinedStep {
  KeyframeId from;
  RelativePose measurement;  ///< T_from_next, with the covariance of whoever refined it.
};

struct Refinement {
  std::vector<RefinedStep> steps;            ///< Sorted by `from`.
  std::map<KeyframeId, Pose3> T_world_body;  ///< Of the keyframes refined, in the world of the map that was given.
};

/// A map with all that it was made from.
struct MapToRefine {
  const MapEstimate& estimate;
  const SubmapSet& submaps;
  const std::map<SubmapId, PayloadSize>& payload_sizes;
  const VerdictSet& verdicts;
  const PayloadStore& payloads;
};

/// What knows more of the map than its pose graph does: bundle adjustment of what cameras saw. Injected, so the server
/// never knows the sensor. A pure function; may be called from any thread.
class MapRefiner {
 public:
  virtual ~MapRefiner() = default;
  /// Nothing in it where nothing is known beside the pose graph.
  [[nodiscard]] virtual Result<Refinement> refine(const MapToRefine& map) const = 0;
};

/// The map with the refined steps in the place of its odometry's, solved again from where it stands. Its closures stay
/// as sure as they were, but say what the refined keyframes say where both their ends are among them: a chain of steps
/// is looser than all of the refinement, and would be drawn back to where the closures had it before. Odometry that
/// failed is no step's place. The map as it was when that cannot be solved.
MapEstimate refined(const MapEstimate& map, const Refinement& refinement);

}  // namespace tutti::server
