// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/held_poses.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/refinements.hpp"

namespace tutti::server {

/// All that a map is made of, as the server had it when the map was begun. A job shares nothing that changes with its
/// server, so make_map() may run on another thread while the server takes what comes.
struct MapJob {
  SubmapSet submaps;
  std::map<SubmapId, PayloadSize> payload_sizes;  ///< For a server that has its map refined.
  VerdictSet verdicts;
  DecisionSet decisions;
  Refinements refinements;
  MapConfig map;
  consistency::ProxyGraphConfig proxy_graph;
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  /// The map of the pose graph alone, when nothing has come that changes it; else null.
  std::shared_ptr<const MapEstimate> estimate;
  bool keeps_estimate = false;                 ///< It is asked for again, to refine the map.
  std::shared_ptr<const HeldPoses> held = {};  ///< The poses of a map that does not move; null: every pose may.
  std::set<SubmapId> retired = {};             ///< Submaps that show known ground (known_ground.hpp).
  std::vector<ChainId> owners = {};            ///< The sessions that own robots' numbers: these hear of the map.
};

/// The map of the pose graph alone, then refined, moved by ranges, laid on the earth, and with the poses that are held,
/// if there are any.
MapEstimate finished_map(const MapEstimate& estimate, const SubmapSet& submaps, const Refinements& refinements,
                         const HeldPoses& held, const MapConfig& config);

/// The map of a job.
struct MadeMap {
  MapJob job;
  std::shared_ptr<const MapEstimate> estimate;  ///< The pose graph alone; null if it is not kept.
  MapEstimate map;                              ///< With refinements and fixes.
  ProxyGraphMessage message;                    ///< Its whole proxy graph.
  judge::SearchWork search;
  MonitorWork monitor;
};

/// Makes the map: a pure function of the job.
MadeMap make_map(MapJob job);

}  // namespace tutti::server
