// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_estimate.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <ranges>
#include <set>
#include <tuple>
#include <unordered_map>

#include "tutti/estimation/chi_square.hpp"
#include "tutti/estimation/influence.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/closure_groups.hpp"
#include "tutti/server/relocate_failures.hpp"
#include "tutti/server/rotation_honesty.hpp"
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
void see_through(MapEstimate& map, std::vector<estimation::OdometryChain>& chains) {
  for (estimation::OdometryChain& chain : chains)
    for (Matrix6d& covariance : chain.step_covariance)
      covariance = scale_rotation(covariance, map.rotation_factors.at(chain.id));
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = map.graph.edges[e];
    edge.information = scale_rotation(edge.information, 1.0 / map.rotation_factors.at(map.nodes[edge.from].id.chain));
  }
}

/// What failed odometry is let go by over its whole stretch: enough for any jump, and the map stays in one piece.
constexpr double kFreeTranslation = 100.0;
constexpr double kFreeRotation = 3.0;

/// How often the convicted stretches are looked for again in the map they made.
constexpr int kRelocations = 2;
/// ... which must fit as many closures, or this share of them when what is convicted is half as long or less.
constexpr double kAlmostAll = 0.95;

/// How many groups of closures can be refused as lone witnesses against all the rest.
constexpr int kRefusals = 5;

/// Chi-square (6 dof, 0.999) below which the odometry of a stretch agrees with the map after all.
constexpr double kRightAfterAll = 22.46;

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

/// As it was judged: a step that jumped by what it was instead, else with a variance.
void doubt(PoseGraph& graph, const MapEstimate& map, const NodeIndex& index, const DoubtedStretch& doubted,
           double sigma_m, double sigma_rad) {
  const auto& [chain, from, to] = doubted.stretch;
  const std::size_t a = index.at({chain, from}), b = index.at({chain, to});
  if (!doubted.motion) return weaken(graph, map, a, b, sigma_m, sigma_rad);
  for (std::size_t e = 0; e < map.odometry_edges; ++e)
    if (graph.edges[e].from == a && graph.edges[e].to == b)
      graph.edges[e] = {a, b, doubted.motion->T_a_b, information_of(doubted.motion->covariance)};
}

/// Says by how much failed odometry missed, and leaves the graph as sure of it as it then deserves. A stretch that
/// turns out to have been right, nearly or within its own doubt, is no failure.
void record_failure(const DoubtedStretch& doubted, const NodeIndex& index, double min_jump_m, MapEstimate& map) {
  const auto& [chain, from, to] = doubted.stretch;
  const std::size_t a = index.at({chain, from}), b = index.at({chain, to});
  const auto raw = [&](std::size_t i, std::size_t j) {
    return map.nodes[i].T_odom_body.inverse() * map.nodes[j].T_odom_body;
  };
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (edge.from < a || edge.to > b) continue;
    const Matrix6d to_end = adjoint(raw(b, edge.to));
    covariance += to_end * edge.information.inverse() * to_end.transpose();
  }
  const Vector6d jump = local(raw(a, b), map.nodes[a].T_world_body.inverse() * map.nodes[b].T_world_body);
  const double jump_m = jump.head<3>().norm();
  const double jump_rad = jump.tail<3>().norm();
  if (estimation::failure_size(jump_m, jump_rad) < 0.5 * min_jump_m) return;
  if (jump.dot(covariance.llt().solve(jump)) < kRightAfterAll) return;
  map.failed_odometry.push_back({chain, from, to, jump_m, jump_rad});
  doubt(map.graph, map, index, doubted, jump_m, jump_rad);
}

void label_components(MapEstimate& map) {
  std::vector<std::size_t> root(map.nodes.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const PoseGraphEdge& edge : map.graph.edges) {
    const auto [low, high] = std::minmax({find(edge.from), find(edge.to)});
    root[high] = low;
  }
  std::unordered_map<std::size_t, std::uint32_t> label;
  for (std::size_t i = 0; i < map.nodes.size(); ++i)
    map.nodes[i].component = label.try_emplace(find(i), static_cast<std::uint32_t>(label.size())).first->second;
  map.components = static_cast<std::uint32_t>(label.size());
}

/// What a verdict on closures and odometry makes of the map.
struct Optimum {
  std::vector<DoubtedStretch> failed;
  PoseGraph graph;                           ///< Odometry, let go where it failed, and the closures not rejected.
  std::vector<std::size_t> closure_of_edge;  ///< Of the edges beyond odometry.
  estimation::GncResult robust;
  std::vector<std::size_t> fitting;  ///< Edges of closures that fit the map.

  [[nodiscard]] std::size_t convicted() const {  ///< Steps of odometry.
    std::size_t steps = 0;
    for (const auto& [chain, from, to] : failed | std::views::transform(&DoubtedStretch::stretch)) steps += to - from;
    return steps;
  }
  [[nodiscard]] bool explains_better_than(const Optimum& other) const {
    if (fitting.size() >= other.fitting.size()) return true;
    return 2 * convicted() <= other.convicted() &&
           static_cast<double>(fitting.size()) >= kAlmostAll * static_cast<double>(other.fitting.size());
  }
};

class Judgement {
 public:
  /// All must outlive this.
  Judgement(const MapEstimate& map, const NodeIndex& index, const std::vector<LoopClosure>& closures,
            const std::vector<estimation::OdometryChain>& chains, const MapConfig& config)
      : map_(map),
        index_(index),
        closures_(closures),
        chains_(chains),
        config_(config),
        trial_(chains, closures, config.trial) {}

  /// The map with the failures where the trial puts them, then where the maps so made put them, as long as that
  /// explains the closures better.
  Optimum decide() {
    const estimation::OdometryVerdict first = trial_.decide();
    std::vector<DoubtedStretch> failed;
    for (const auto& stretch : first.failed) failed.push_back({stretch, kFreeTranslation, kFreeRotation, std::nullopt});
    Optimum best = optimise(first.accepted, std::move(failed));
    for (int round = 0; round < kRelocations && !best.failed.empty(); ++round) {
      Optimum next = relocated(best);
      if (!next.explains_better_than(best)) break;
      best = std::move(next);
    }
    for (int round = 0; round < kRefusals && refuse_lone_witness(best);) ++round;
    return best;
  }

 private:
  [[nodiscard]] Optimum optimise(const std::vector<bool>& accepted, std::vector<DoubtedStretch> failed) const {
    Optimum out{.failed = std::move(failed), .graph = map_.graph, .closure_of_edge = {}, .robust = {}, .fitting = {}};
    for (const DoubtedStretch& doubted : out.failed)
      doubt(out.graph, map_, index_, doubted, doubted.sigma_m, doubted.sigma_rad);
    for (std::size_t i = 0; i < closures_.size(); ++i) {
      if (!accepted[i]) continue;
      out.graph.edges.push_back({.from = index_.at(closures_[i].from),
                                 .to = index_.at(closures_[i].to),
                                 .T_from_to = closures_[i].measurement.T_a_b,
                                 .information = information_of(closures_[i].measurement.covariance)});
      out.closure_of_edge.push_back(i);
    }
    std::vector<estimation::EdgeRole> roles(out.graph.edges.size(), estimation::EdgeRole::robust);
    std::fill_n(roles.begin(), map_.odometry_edges, estimation::EdgeRole::trusted);
    out.robust = estimation::solve_pose_graph_gnc(out.graph, config_.gnc, roles);
    for (std::size_t e = map_.odometry_edges; e < out.graph.edges.size(); ++e)
      if (out.robust.inlier_weight[e] >= 0.5) out.fitting.push_back(e);
    return out;
  }

  /// Takes back the group of closures at one pair of places that contradicts all the rest of the map most, if it does
  /// beyond chance: as a lone closure against odometry, a lone group convicts itself. False if there is none.
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
    if (worst == misfits.end() || *worst <= estimation::chi_square_6_quantile(config_.trial.confidence)) return false;
    std::vector<bool> accepted(closures_.size(), false);
    for (const std::size_t closure : best.closure_of_edge) accepted[closure] = true;
    for (const std::size_t e : groups[static_cast<std::size_t>(worst - misfits.begin())])
      accepted[best.closure_of_edge[best.fitting[e - map_.odometry_edges] - map_.odometry_edges]] = false;
    best = optimise(accepted, std::move(best.failed));
    return true;
  }

  /// The map with the failures of another one moved to where that says they are.
  [[nodiscard]] Optimum relocated(const Optimum& other) {
    const auto pose_of = [&](KeyframeId id) { return other.robust.solution.poses[index_.at(id)]; };
    auto moved = relocate_failures(other.failed, chains_, closures_, pose_of);
    std::vector<estimation::OdometryStretch> stretches;
    for (const DoubtedStretch& doubted : moved) stretches.push_back(doubted.stretch);
    const auto accepted = trial_.assume(stretches).accepted;
    return optimise(accepted, std::move(moved));
  }

  const MapEstimate& map_;
  const NodeIndex& index_;
  const std::vector<LoopClosure>& closures_;
  const std::vector<estimation::OdometryChain>& chains_;
  const MapConfig& config_;
  estimation::OdometryTrial trial_;
};

void adopt(const Optimum& optimum, const NodeIndex& index, double min_jump_m, MapEstimate& map) {
  for (const std::size_t edge : optimum.fitting) {
    map.graph.edges.push_back(optimum.graph.edges[edge]);
    map.closures[optimum.closure_of_edge[edge - map.odometry_edges]].accepted = true;
  }
  map.graph.poses = optimum.robust.solution.poses;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  for (const DoubtedStretch& doubted : optimum.failed) record_failure(doubted, index, min_jump_m, map);
}

}  // namespace

std::vector<estimation::OdometryChain> odometry_chains(const std::vector<MapNode>& nodes,
                                                       const std::vector<std::optional<Matrix6d>>& step_to) {
  std::vector<estimation::OdometryChain> chains;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (step_to[i])
      chains.back().step_covariance.push_back(*step_to[i]);
    else
      chains.push_back({.id = nodes[i].id.chain, .first_index = nodes[i].id.index});
    chains.back().T_odom_body.push_back(nodes[i].T_odom_body);
    chains.back().stamps.push_back(nodes[i].stamp);
  }
  return chains;
}

namespace {

/// Of submaps that do not contradict each other.
MapEstimate estimate_together(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config) {
  MapEstimate map;
  const NodeIndex index = attach_submaps(submaps, map);
  const auto spare = spare_pairs(verdicts, submaps, static_cast<std::size_t>(config.most_closed_pairs));
  map.spare_pairs = spare.size();
  const std::vector<LoopClosure> closures = collect_closures(verdicts, submaps, index, spare);
  std::vector<estimation::OdometryChain> chains = odometry_chains(map.nodes, stated_steps(submaps, index));
  if (config.judge_rotation) {
    map.rotation_factors = rotation_variance_factors(chains, closures);
    see_through(map, chains);
  }
  const Optimum optimum = Judgement(map, index, closures, chains, config).decide();
  for (const LoopClosure& closure : closures) map.closures.push_back({closure, false});
  map.converged = estimation::is_usable(optimum.robust.solution.summary.termination);
  if (map.converged) adopt(optimum, index, config.trial.min_jump_m, map);
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
