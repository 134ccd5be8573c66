// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/estimation/gnc.hpp"
#include "tutti/judge/closure_honesty.hpp"
#include "tutti/judge/explain_closures.hpp"
#include "tutti/judge/judge_closures.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/model/closure_word.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::server {

/// Everything the map is made from; kept sorted by id, so the map is a function of the set.
using SubmapSet = std::map<SubmapId, std::shared_ptr<const Submap>>;

inline bool has_both(const SubmapSet& submaps, const SubmapPair& pair) {
  return submaps.contains(pair.first) && submaps.contains(pair.second);
}
using VerdictSet = std::map<SubmapPair, ClosureVerdict>;

struct JudgedClosure {
  LoopClosure closure;
  bool accepted = false;
  bool by_operator = false;  ///< By an operator's word, whatever the map says.
  judge::Objection objection = judge::Objection::none;
};

/// Odometry that the closures show to have failed: between these two keyframes of one chain it is not believed.
struct FailedOdometry {
  ChainId chain;
  std::uint32_t from = 0;  ///< KeyframeId::index
  std::uint32_t to = 0;
  double jump_m = 0.0;  ///< By how much the map differs from the odometry between the two.
  double jump_rad = 0.0;
  friend bool operator==(const FailedOdometry&, const FailedOdometry&) = default;
};

/// One joint map.
struct MapEstimate {
  std::vector<MapNode> nodes;                   ///< Sorted by id.
  PoseGraph graph;                              ///< Same order as nodes: odometry, then the accepted closures.
  std::size_t odometry_edges = 0;               ///< graph.edges[0 .. odometry_edges) are odometry.
  std::vector<JudgedClosure> closures;          ///< Sorted by (from, to).
  std::vector<FailedOdometry> failed_odometry;  ///< Sorted by (chain, from).
  /// By which the variances of closures between two chains count, where they err by more than they say
  /// (closure_honesty.hpp); `graph` has them so, `closures` as stated.
  std::map<std::pair<ChainId, ChainId>, judge::ClosureHonesty> closure_factors;
  /// By which the variances of each chain's odometry count, in rotation (odometry_honesty.hpp); `graph` has them so.
  std::map<ChainId, double> rotation_factors;
  /// Of chains whose odometry is far worse than it says: by which all its variances count; `graph` has them so.
  std::map<ChainId, double> understated;
  /// By which the map shows the variances of each chain's odometry, as in `graph`, to be overstated still, in (0, 1].
  std::map<ChainId, double> overstated;
  /// Of odometry edges whose place a refined step has taken (map_refiner.hpp), by edge: the covariance of the odometry.
  std::map<std::size_t, Matrix6d> odometry_of_steps;
  std::uint32_t components = 0;  ///< Connected components that contain a node.
  /// Submaps that contradict earlier ones of their chain: keyframes that are there already, at other moments or out of
  /// order. And all of a chain without which the map can be solved, and with which it cannot.
  std::vector<SubmapId> left_out;
  std::size_t spare_pairs = 0;  ///< Of submaps whose closures were not judged (MapConfig::most_closed_pairs).
  judge::SearchWork work;       ///< What judging the closures took.
  bool converged = false;       ///< Otherwise no closure is accepted, and every robot's odometry stands alone.
};

struct MapConfig {
  judge::WhoIsWrongConfig who_is_wrong;
  estimation::GncConfig gnc;
  /// Closures that err by more than they say count as their neighbours show (off: as they say).
  bool judge_closures = true;
  bool judge_odometry = true;
  int most_closed_pairs = 40;
  template <class V>
  void describe(V& v) {
    v.field("who_is_wrong", who_is_wrong);
    v.field("gnc", gnc);
    v.field("judge_odometry", judge_odometry, any(),
            "Odometry that turns better than it says, or is far worse, counts as the closures show (off: as it says).");
    v.field("most_closed_pairs", most_closed_pairs, at_least(1),
            "A submap that closures tie to more submaps of one robot than this does not have all judged "
            "(spare_pairs.hpp).");
  }
};

/// Raw odometry of nodes sorted by id, one chain per piece without a gap. `step_to`: per node the covariance of the
/// step that ends there, nothing where odometry begins.
std::vector<judge::OdometryChain> odometry_chains(const std::vector<MapNode>& nodes,
                                                  const std::vector<std::optional<Matrix6d>>& step_to);

/// Null when the map does not have it.
const MapNode* find_node(const MapEstimate& map, const KeyframeId& id);

/// The map of a set of submaps, verdicts and words: attaches submaps by their shared keyframes, judges closures and
/// odometry, optimises. Pure: the same sets give the same map, whatever the order they came in.
MapEstimate estimate_map(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config,
                         const WordSet& words = {});

}  // namespace tutti::server
