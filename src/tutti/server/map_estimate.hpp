// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/estimation/gnc.hpp"
#include "tutti/judge/closure_honesty.hpp"
#include "tutti/judge/explain_closures.hpp"
#include "tutti/judge/judge_closures.hpp"
#include "tutti/judge/odometry_loops.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/server/fixes.hpp"
#include "tutti/server/ranges.hpp"

namespace tutti::server {

/// The submaps that a map is made from; sorted by id, so that the map is a function of the set. Never null.
using SubmapSet = std::map<SubmapId, std::shared_ptr<const Submap>>;

/// The pair of two submaps, the smaller first.
inline SubmapPair ordered(SubmapId a, SubmapId b) { return a < b ? SubmapPair{a, b} : SubmapPair{b, a}; }

/// True if the set has both submaps of the pair.
inline bool has_both(const SubmapSet& submaps, const SubmapPair& pair) {
  return submaps.contains(pair.first) && submaps.contains(pair.second);
}
using VerdictSet = std::map<SubmapPair, ClosureVerdict>;

/// A closure with the verdict on it.
struct JudgedClosure {
  LoopClosure closure;
  bool accepted = false;
  bool by_operator = false;                             ///< An operator's decision decided, whatever the map says.
  judge::Objection objection = judge::Objection::none;  ///< Why it is not accepted.
  judge::Price price;
};

/// Odometry that failed, as closures show: between these two keyframes of one chain it is not used.
struct FailedOdometry {
  ChainId chain;
  std::uint32_t from = 0;  ///< KeyframeId::index
  std::uint32_t to = 0;
  double jump_m = 0.0;  ///< Difference between the map's and the odometry's relative pose over the segment.
  double jump_rad = 0.0;
  friend bool operator==(const FailedOdometry&, const FailedOdometry&) = default;
};

/// The joint map of all robots.
struct MapEstimate {
  std::vector<MapNode> nodes;      ///< Sorted by id.
  PoseGraph graph;                 ///< Nodes in the order of `nodes`; edges: odometry, the accepted closures, ranges.
  std::size_t odometry_edges = 0;  ///< graph.edges[0 .. odometry_edges) are odometry.
  std::vector<JudgedClosure> closures;          ///< Sorted by (from, to).
  std::vector<FailedOdometry> failed_odometry;  ///< Sorted by (chain, from).
  /// Factor on the variances of the closures between two chains, where these err by more than they say
  /// (closure_honesty.hpp). It is applied in `graph` but not in `closures`.
  std::map<std::pair<ChainId, ChainId>, judge::ClosureHonesty> closure_factors;
  /// Factor on the variances of rotation of each chain's odometry (odometry_honesty.hpp) with which what is wrong was
  /// looked for; applied in `graph` where odometry says far too much of its errors (0.15 and below).
  std::map<ChainId, double> rotation_factors;
  /// Factor on all variances of a chain's odometry, where that is far worse than it says; applied in `graph`.
  std::map<ChainId, double> understated;
  /// Factor by which the variances of each chain's odometry in `graph` are still too large, as the map shows; in (0,
  /// 1].
  std::map<ChainId, double> overstated;
  /// The covariance of the odometry, by edge, where a refined step replaces an odometry edge (map_refiner.hpp).
  std::map<std::size_t, Matrix6d> odometry_of_steps;
  std::uint32_t components = 0;  ///< Connected components that contain a node.
  /// Submaps that contradict earlier ones of their chain: they have keyframes that exist already, at other moments or
  /// out of order. Also all submaps of a chain with which the map cannot be solved, and without which it can.
  std::vector<SubmapId> left_out;
  /// Number of pairs of submaps whose closures were not judged (MapConfig::most_closed_pairs).
  std::size_t spare_pairs = 0;
  Fixes fixes;             ///< How position fixes were judged, and where on the earth the map lies.
  Ranges ranges;           ///< How ranges between robots were judged.
  judge::SearchWork work;  ///< The cost of judging the closures.
  /// The sum of r^T Omega r over all edges of the graph as it was solved, and by how many degrees of freedom: about as
  /// many where everything errs by what it states.
  double cost = 0.0;
  std::size_t degrees_of_freedom = 0;
  bool from_measurements = false;  ///< judge::Optimum::from_measurements
  bool converged = false;          ///< False: no closure is accepted, and every robot's odometry stands alone.
};

/// When submaps are retired (known_ground.hpp).
struct KnownGroundConfig {
  int visits = 0;
  double reach_m = 2.0;
  template <class V>
  void describe(V& v) {
    v.field(
        "visits", visits, at_least(0),
        "A place that this many submaps of the map have shown needs no more: a later submap that shows nothing else "
        "is retired. Its robot is localised by it, and its cloud and images are dropped. 0: nothing is retired.");
    v.field("reach_m", reach_m, greater_than(0.0),
            "How near a submap's keyframes are to those of others that show the same place.");
  }
};

/// How the joint map is made.
struct MapConfig {
  judge::OutlierRejectionConfig outlier_rejection;
  estimation::GncConfig gnc;
  /// Factors for closures that err by more than they say (closure_honesty.hpp); off: they count as they say.
  bool judge_closures = true;
  bool judge_odometry = true;
  int most_closed_pairs = 40;
  int most_pairs_in_all = 12000;
  GeoreferenceConfig georeference;
  KnownGroundConfig known_ground;
  bool use_ranges = true;
  template <class V>
  void describe(V& v) {
    v.field("outlier_rejection", outlier_rejection, formerly("who_is_wrong"));
    v.field("judge_odometry", judge_odometry, any(),
            "Odometry that turns better than it says, or is far worse, counts as the closures show (off: as it says).");
    v.field("most_closed_pairs", most_closed_pairs, at_least(1),
            "A submap that closures tie to more submaps of one robot than this does not have all judged "
            "(spare_pairs.hpp).");
    v.field(
        "most_pairs_in_all", most_pairs_in_all, at_least(1),
        "A map with more closed pairs than this does not have all judged: of each submap fewer the more there are, at "
        "least five, robots taking turns.");
    v.field("georeference", georeference);
    v.field("known_ground", known_ground);
    v.field("use_ranges", use_ranges, any(), "The map follows the ranges between robots (UWB) that agree with it.");
  }
};

/// The raw odometry of nodes that are sorted by id, cut where a submap is missing. `step_to` has, per node, the
/// covariance of the step that ends there, and nothing where odometry begins.
std::vector<judge::OdometrySegment> odometry_segments(const std::vector<MapNode>& nodes,
                                                      const std::vector<std::optional<Matrix6d>>& step_to);

/// The node with this id, null when the map does not have it; logarithmic.
const MapNode* find_node(const MapEstimate& map, const KeyframeId& id);

/// The map of a set of submaps, verdicts and operators' decisions: attaches submaps by their shared keyframes, judges
/// closures and odometry, and optimises. A pure function, so the order in which the inputs arrived does not matter.
/// `refuted` are pairs whose closures fixes have shown to be wrong (refuted_closures.hpp).
MapEstimate estimate_map(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config,
                         const DecisionSet& decisions = {}, const std::set<SubmapPair>& refuted = {});

}  // namespace tutti::server
