// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_estimate.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <unordered_map>

#include "tutti/base/chi_square.hpp"
#include "tutti/base/disjoint_sets.hpp"
#include "tutti/estimation/influence.hpp"
#include "tutti/estimation/who_is_wrong/who_is_wrong.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/closure_groups.hpp"
#include "tutti/server/odometry_honesty.hpp"
#include "tutti/server/spare_pairs.hpp"

namespace tutti::server {
namespace {

using NodeIndex = std::unordered_map<KeyframeId, std::size_t>;

/// Stiffer normal equations tell nothing.
Matrix6d information_of(const Matrix6d& covariance) {
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kLeastTranslation_m * kLeastTranslation_m;
  floored.diagonal().tail<3>().array() += kLeastRotation_rad * kLeastRotation_rad;
  const Matrix6d inverse = floored.llt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

/// The submap begins at its chain's last keyframe so far, or after it.
bool continues(const Keyframe& last, const Keyframe& first) {
  return first.index == last.index ? first.stamp == last.stamp : first.index > last.index && first.stamp > last.stamp;
}

/// The submaps without those that contradict earlier ones of their chain. A function of the set: the smallest index is
/// believed first, in whatever order they came.
SubmapSet without_contradictions(const SubmapSet& submaps, std::vector<SubmapId>& left_out) {
  SubmapSet out;
  for (const auto& [id, submap] : submaps) {
    const bool is_first = out.empty() || out.rbegin()->first.chain != id.chain;
    if (is_first || continues(out.rbegin()->second->keyframes.back(), submap->keyframes.front()))
      out.emplace_hint(out.end(), id, submap);
    else
      left_out.push_back(id);
  }
  return out;
}

/// Nodes and odometry edges of all submaps. Neighbouring submaps share a keyframe, so they attach by its id; a missing
/// submap leaves a gap, and what follows it hangs on by closures alone until the submap comes.
NodeIndex attach_submaps(const SubmapSet& submaps, MapEstimate& map) {
  for (const auto& [id, submap] : submaps)
    for (const Keyframe& k : submap->keyframes) {
      const KeyframeId node{id.chain, k.index};
      if (map.nodes.empty() || map.nodes.back().id < node)
        map.nodes.push_back({node, k.stamp, k.representative, k.T_odom_body, k.T_odom_body, 0});
    }
  NodeIndex index;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) index.emplace(map.nodes[i].id, i);
  for (const MapNode& node : map.nodes) map.graph.poses.push_back(node.T_odom_body);
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      map.graph.edges.push_back({.from = index.at({id.chain, submap->keyframes[k].index}),
                                 .to = index.at({id.chain, submap->keyframes[k + 1].index}),
                                 .T_from_to = submap->odometry[k].T_a_b,
                                 .information = information_of(bounded_covariance(submap->odometry[k].covariance))});
  map.odometry_edges = map.graph.edges.size();
  return index;
}

/// Per node the covariance, as stated but for its bounds, of the step that ends there.
std::vector<std::optional<Matrix6d>> stated_steps(const SubmapSet& submaps, const NodeIndex& index) {
  std::vector<std::optional<Matrix6d>> out(index.size());
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      out[index.at({id.chain, submap->keyframes[k + 1].index})] = bounded_covariance(submap->odometry[k].covariance);
  return out;
}

/// All closures of all verdicts on submaps in the map, in a fixed order.
std::vector<LoopClosure> collect_closures(const VerdictSet& verdicts, const SubmapSet& submaps, const NodeIndex& index,
                                          const std::set<SubmapPair>& spare) {
  std::vector<LoopClosure> closures;
  for (const auto& [pair, verdict] : verdicts) {
    if (!submaps.contains(pair.first) || !submaps.contains(pair.second) || spare.contains(pair)) continue;
    for (const LoopClosure& closure : verdict.closures)
      if (index.contains(closure.from) && index.contains(closure.to)) {
        closures.push_back(closure);
        closures.back().measurement.covariance = bounded_covariance(closure.measurement.covariance);
      }
  }
  std::stable_sort(closures.begin(), closures.end(), [](const LoopClosure& a, const LoopClosure& b) {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  });
  return closures;
}

/// Odometry's rotations count as much as the closures show that they are worth.
void see_through(MapEstimate& map) {
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = map.graph.edges[e];
    edge.information = scale_rotation(edge.information, 1.0 / map.rotation_factors.at(map.nodes[edge.from].id.chain));
  }
}

/// Odometry whose loops are so many times their stated variance, at least, says much too little of its errors.
constexpr double kUnderstated = 4.0;

/// What failed odometry missed is measured; that it was this much more is as likely as not.
constexpr double kDoubt = 2.0;

/// Closures of neighbouring submaps may be wrong all together.
constexpr double kNeighbours_s = 15.0;

/// How many groups of closures can be refused as lone witnesses against all the rest.
constexpr int kRefusals = 5;

/// Probability with which the odometry of a stretch agrees with the map after all.
constexpr double kRightAfterAll = 0.999;

/// Adds a variance (m, rad) to failed odometry, in equal shares to the steps of the stretch.
void weaken(PoseGraph& graph, const MapEstimate& map, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad) {
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = graph.edges[e];
    if (edge.from < from || edge.to > to) continue;
    Matrix6d covariance = edge.information.inverse();
    const double steps = static_cast<double>(to - from);
    covariance.diagonal().head<3>().array() += sigma_m * sigma_m / steps;
    covariance.diagonal().tail<3>().array() += sigma_rad * sigma_rad / steps;
    edge.information = information_of(covariance);
  }
}

/// Says by how much failed odometry missed, and leaves the graph as sure of it as it then deserves. A stretch that
/// turns out to have been right, nearly or within its own doubt, is no failure.
void record_failure(const estimation::FailedStretch& failed, double min_jump_m, MapEstimate& map) {
  const MapNode &a = map.nodes[failed.from], &b = map.nodes[failed.to];
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (edge.from < failed.from || edge.to > failed.to) continue;
    const Matrix6d to_end = adjoint(b.T_odom_body.inverse() * map.nodes[edge.to].T_odom_body);
    covariance += to_end * edge.information.inverse() * to_end.transpose();
  }
  const Vector6d jump = local(a.T_odom_body.inverse() * b.T_odom_body, a.T_world_body.inverse() * b.T_world_body);
  const double jump_m = jump.head<3>().norm(), jump_rad = jump.tail<3>().norm();
  if (estimation::failure_size(jump_m, jump_rad) < 0.5 * min_jump_m) return;
  if (jump.dot(covariance.llt().solve(jump)) < chi_square_quantile(kRightAfterAll, 6)) return;
  map.failed_odometry.push_back({a.id.chain, a.id.index, b.id.index, jump_m, jump_rad});
  weaken(map.graph, map, failed.from, failed.to, jump_m, jump_rad);
}

void label_components(MapEstimate& map) {
  DisjointSets sets(map.nodes.size());
  for (const PoseGraphEdge& edge : map.graph.edges) sets.join(edge.from, edge.to);
  const auto [label, count] = sets.labels();
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].component = static_cast<std::uint32_t>(label[i]);
  map.components = static_cast<std::uint32_t>(count);
}

/// What an explanation of the closures makes of the map.
struct Optimum {
  std::vector<estimation::FailedStretch> failed;
  PoseGraph graph;                           ///< Odometry, let go where it failed, and the closures not rejected.
  std::vector<std::size_t> closure_of_edge;  ///< Of the edges beyond odometry.
  estimation::GncResult robust;
  std::vector<std::size_t> fitting;  ///< Edges of closures that fit the map.
};

class Optimiser {
 public:
  /// All must outlive this.
  Optimiser(const MapEstimate& map, const NodeIndex& index, const std::vector<LoopClosure>& closures,
            const MapConfig& config)
      : map_(map), closures_(closures), config_(config) {
    for (const LoopClosure& closure : closures)
      closure_edges_.push_back({.from = index.at(closure.from),
                                .to = index.at(closure.to),
                                .T_from_to = closure.measurement.T_a_b,
                                .information = information_of(closure.measurement.covariance)});
  }

  [[nodiscard]] Optimum decide() const {
    PoseGraph graph = map_.graph;
    graph.edges.insert(graph.edges.end(), closure_edges_.begin(), closure_edges_.end());
    const estimation::OdometryWays odometry(graph.poses.size(), map_.graph.edges);
    std::vector<std::size_t> all(closures_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const auto groups = closure_groups(map_.nodes, closure_edges_, all,
                                       {kNeighbours_s, std::numeric_limits<double>::infinity(), closures_.size()});
    auto found =
        estimation::explain_closures(graph, odometry, map_.odometry_edges, groups, config_.who_is_wrong, config_.gnc);
    leave_unjoined(odometry, found.accepted);
    Optimum best = optimise(found.accepted, std::move(found.failed));
    for (int round = 0; round < kRefusals && refuse_lone_witness(best);) ++round;
    return best;
  }

 private:
  /// Too few closures do not join two pieces of odometry.
  void leave_unjoined(const estimation::OdometryWays& odometry, std::vector<bool>& accepted) const {
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> between;
    for (std::size_t c = 0; c < closures_.size(); ++c)
      if (accepted[c])
        between[std::minmax({odometry.piece(closure_edges_[c].from), odometry.piece(closure_edges_[c].to)})].push_back(
            c);
    for (const auto& [pieces, joining] : between)
      if (pieces.first != pieces.second &&
          joining.size() < static_cast<std::size_t>(config_.who_is_wrong.min_joining_closures))
        for (const std::size_t c : joining) accepted[c] = false;
  }

  [[nodiscard]] Optimum optimise(const std::vector<bool>& accepted,
                                 std::vector<estimation::FailedStretch> failed) const {
    Optimum out{.failed = std::move(failed), .graph = map_.graph, .closure_of_edge = {}, .robust = {}, .fitting = {}};
    for (const estimation::FailedStretch& stretch : out.failed)
      weaken(out.graph, map_, stretch.from, stretch.to, kDoubt * stretch.missed.head<3>().norm(),
             kDoubt * stretch.missed.tail<3>().norm());
    for (std::size_t c = 0; c < closures_.size(); ++c) {
      if (!accepted[c]) continue;
      out.graph.edges.push_back(closure_edges_[c]);
      out.closure_of_edge.push_back(c);
    }
    std::vector<estimation::EdgeRole> roles(out.graph.edges.size(), estimation::EdgeRole::robust);
    std::fill_n(roles.begin(), map_.odometry_edges, estimation::EdgeRole::trusted);
    out.robust = estimation::solve_pose_graph_gnc(out.graph, config_.gnc, roles);
    for (std::size_t e = map_.odometry_edges; e < out.graph.edges.size(); ++e)
      if (out.robust.inlier_weight[e] >= 0.5) out.fitting.push_back(e);
    return out;
  }

  /// Takes back the group of closures at one pair of places that contradicts all the rest of the map most, if it does
  /// beyond chance: as a lone closure against odometry, a lone group is wrong itself. False if there is none.
  [[nodiscard]] bool refuse_lone_witness(Optimum& best) const {
    if (!estimation::is_usable(best.robust.solution.summary.termination)) return false;
    PoseGraph fitted{.poses = {},
                     .edges = {best.graph.edges.begin(),
                               best.graph.edges.begin() + static_cast<std::ptrdiff_t>(map_.odometry_edges)}};
    fitted.poses = best.graph.poses;
    for (const std::size_t e : best.fitting) fitted.edges.push_back(best.graph.edges[e]);
    std::vector<std::size_t> closures(best.fitting.size());
    std::iota(closures.begin(), closures.end(), map_.odometry_edges);
    std::vector<estimation::EdgeRole> roles(fitted.edges.size(), estimation::EdgeRole::robust);
    std::fill_n(roles.begin(), map_.odometry_edges, estimation::EdgeRole::trusted);
    const auto groups = closure_groups(map_.nodes, fitted.edges, closures);
    const auto misfits = estimation::group_misfits(fitted, best.robust.solution.poses, roles, groups);
    const auto worst = std::ranges::max_element(misfits);
    if (worst == misfits.end() || *worst <= chi_square_quantile(config_.who_is_wrong.confidence, 6)) return false;
    std::vector<bool> accepted(closures_.size(), false);
    for (const std::size_t closure : best.closure_of_edge) accepted[closure] = true;
    for (const std::size_t e : groups[static_cast<std::size_t>(worst - misfits.begin())])
      accepted[best.closure_of_edge[best.fitting[e - map_.odometry_edges] - map_.odometry_edges]] = false;
    best = optimise(accepted, std::move(best.failed));
    return true;
  }

  const MapEstimate& map_;
  const std::vector<LoopClosure>& closures_;
  const MapConfig& config_;
  std::vector<PoseGraphEdge> closure_edges_;
};

void adopt(const Optimum& optimum, double min_jump_m, MapEstimate& map) {
  for (const std::size_t edge : optimum.fitting) {
    map.graph.edges.push_back(optimum.graph.edges[edge]);
    map.closures[optimum.closure_of_edge[edge - map.odometry_edges]].accepted = true;
  }
  map.graph.poses = optimum.robust.solution.poses;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  for (const estimation::FailedStretch& failed : optimum.failed) record_failure(failed, min_jump_m, map);
}

}  // namespace

std::vector<OdometryChain> odometry_chains(const std::vector<MapNode>& nodes,
                                           const std::vector<std::optional<Matrix6d>>& step_to) {
  std::vector<OdometryChain> chains;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (step_to[i])
      chains.back().step_covariance.push_back(*step_to[i]);
    else
      chains.push_back({.id = nodes[i].id.chain, .first_index = nodes[i].id.index});
    chains.back().T_odom_body.push_back(nodes[i].T_odom_body);
  }
  return chains;
}

namespace {

/// What odometry is worth by the closures that fit. What failed is a gap: the map's word on it is not odometry's.
std::map<ChainId, OdometryHonesty> honesty_after(const MapEstimate& map, const Optimum& optimum,
                                                 const std::vector<LoopClosure>& closures) {
  std::vector<std::optional<Matrix6d>> step_to(map.nodes.size());
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    const auto holds = [&](const estimation::FailedStretch& f) { return f.from < edge.to && edge.from < f.to; };
    if (std::ranges::none_of(optimum.failed, holds))
      step_to[edge.to] = edge.information.ldlt().solve(Matrix6d::Identity());
  }
  std::vector<LoopClosure> fitting;
  for (const std::size_t e : optimum.fitting)
    fitting.push_back(closures[optimum.closure_of_edge[e - map.odometry_edges]]);
  return odometry_honesty(odometry_chains(map.nodes, step_to), fitting);
}

/// True if the odometry of any chain was far worse than it said; it now says so.
bool raise_understated(const std::map<ChainId, OdometryHonesty>& honesty, MapEstimate& map) {
  for (const auto& [chain, worth] : honesty)
    if (worth.whole > kUnderstated) map.understated[chain] = worth.whole;
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = map.graph.edges[e];
    if (const auto found = map.understated.find(map.nodes[edge.from].id.chain); found != map.understated.end())
      edge.information /= found->second;
  }
  return !map.understated.empty();
}

/// Of submaps that do not contradict each other.
MapEstimate estimate_together(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config) {
  MapEstimate map;
  const NodeIndex index = attach_submaps(submaps, map);
  const auto spare = spare_pairs(verdicts, submaps, static_cast<std::size_t>(config.most_closed_pairs));
  map.spare_pairs = spare.size();
  const std::vector<LoopClosure> closures = collect_closures(verdicts, submaps, index, spare);
  if (config.judge_odometry) {
    for (const auto& [chain, worth] :
         odometry_honesty(odometry_chains(map.nodes, stated_steps(submaps, index)), closures))
      map.rotation_factors[chain] = worth.rotation;
    see_through(map);
  }
  Optimum optimum = Optimiser(map, index, closures, config).decide();
  auto honesty = honesty_after(map, optimum, closures);
  if (config.judge_odometry && raise_understated(honesty, map)) {
    optimum = Optimiser(map, index, closures, config).decide();
    honesty = honesty_after(map, optimum, closures);
  }
  for (const auto& [chain, worth] : honesty) map.overstated[chain] = std::min(1.0, worth.whole);
  for (const LoopClosure& closure : closures) map.closures.push_back({closure, false});
  map.converged = estimation::is_usable(optimum.robust.solution.summary.termination);
  if (map.converged) adopt(optimum, config.who_is_wrong.min_jump_m, map);
  label_components(map);
  return map;
}

}  // namespace

MapEstimate estimate_map(const SubmapSet& all_submaps, const VerdictSet& verdicts, const MapConfig& config) {
  std::vector<SubmapId> left_out;
  const SubmapSet submaps = without_contradictions(all_submaps, left_out);
  MapEstimate best = estimate_together(submaps, verdicts, config);
  // One chain's numbers may be what cannot be solved; the others keep their map. The largest counts, then the first.
  std::vector<SubmapId> unsolvable;
  for (auto chain = best.converged ? submaps.end() : submaps.begin(); chain != submaps.end();) {
    const auto next = submaps.upper_bound({chain->first.chain, std::numeric_limits<std::uint32_t>::max()});
    SubmapSet others(submaps.begin(), chain);
    others.insert(next, submaps.end());
    MapEstimate without = estimate_together(others, verdicts, config);
    if (without.converged && (!best.converged || without.nodes.size() > best.nodes.size())) {
      best = std::move(without);
      unsolvable.clear();
      for (auto it = chain; it != next; ++it) unsolvable.push_back(it->first);
    }
    chain = next;
  }
  left_out.insert(left_out.end(), unsolvable.begin(), unsolvable.end());
  best.left_out = std::move(left_out);
  return best;
}

}  // namespace tutti::server
