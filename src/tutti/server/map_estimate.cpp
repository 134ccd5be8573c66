// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_estimate.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <span>
#include <tuple>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/closure_honesty.hpp"
#include "tutti/judge/judge_closures.hpp"
#include "tutti/judge/odometry_honesty.hpp"
#include "tutti/server/spare_pairs.hpp"

namespace tutti::server {
namespace {

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
judge::NodeIndex attach_submaps(const SubmapSet& submaps, MapEstimate& map) {
  std::size_t keyframes = 0;
  for (const auto& [id, submap] : submaps) keyframes += submap->keyframes.size();
  map.nodes.reserve(keyframes);
  for (const auto& [id, submap] : submaps)
    for (const Keyframe& k : submap->keyframes) {
      const KeyframeId node{id.chain, k.index};
      if (map.nodes.empty() || map.nodes.back().id < node)
        map.nodes.push_back({node, k.stamp, k.representative, k.T_odom_body, k.T_odom_body, 0});
    }
  judge::NodeIndex index;
  index.reserve(map.nodes.size());
  map.graph.poses.reserve(map.nodes.size());
  map.graph.edges.reserve(map.nodes.size());
  for (std::size_t i = 0; i < map.nodes.size(); ++i) index.emplace(map.nodes[i].id, i);
  for (const MapNode& node : map.nodes) map.graph.poses.push_back(node.T_odom_body);
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      map.graph.edges.push_back(
          {.from = index.at({id.chain, submap->keyframes[k].index}),
           .to = index.at({id.chain, submap->keyframes[k + 1].index}),
           .T_from_to = submap->odometry[k].T_a_b,
           .information = judge::information_of(bounded_covariance(submap->odometry[k].covariance))});
  map.odometry_edges = map.graph.edges.size();
  return index;
}

/// Per node the covariance, as stated but for its bounds, of the step that ends there.
std::vector<std::optional<Matrix6d>> stated_steps(const SubmapSet& submaps, const judge::NodeIndex& index) {
  std::vector<std::optional<Matrix6d>> out(index.size());
  for (const auto& [id, submap] : submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      out[index.at({id.chain, submap->keyframes[k + 1].index})] = bounded_covariance(submap->odometry[k].covariance);
  return out;
}

std::vector<SubmapSet> by_chain(const SubmapSet& submaps) {
  std::vector<SubmapSet> out;
  for (const auto& [id, submap] : submaps) {
    if (out.empty() || out.back().begin()->first.chain != id.chain) out.emplace_back();
    out.back().emplace_hint(out.back().end(), id, submap);
  }
  return out;
}

judge::Closures collect_closures(const VerdictSet& verdicts, const DecisionSet& decisions, const SubmapSet& submaps,
                                 const judge::NodeIndex& index, const std::set<SubmapPair>& spare,
                                 const std::set<SubmapPair>& refuted) {
  judge::Closures out;
  std::vector<std::pair<LoopClosure, std::optional<Wish>>> all;
  for (const auto& [pair, verdict] : verdicts) {
    if (!has_both(submaps, pair)) continue;
    const auto decision = decisions.find(pair);
    const auto wish = decision == decisions.end() ? std::nullopt : std::optional(decision->second.wish);
    if (spare.contains(pair) && wish != Wish::accept && wish != Wish::reject) continue;
    for (const LoopClosure& closure : verdict.closures)
      if (index.contains(closure.from) && index.contains(closure.to)) {
        all.emplace_back(closure, wish);
        LoopClosure& added = all.back().first;
        added.measurement.covariance = bounded_covariance(closure.measurement.covariance);
        if (!refuted.contains(pair) || wish == Wish::reject) continue;
        out.refuted.push_back(added);
        all.pop_back();
      }
  }
  for (const auto& [pair, decision] : decisions) {
    if (decision.wish != Wish::accept || !has_both(submaps, pair)) continue;
    for (const LoopClosure& closure : decision.by_hand)
      if (index.contains(closure.from) && index.contains(closure.to)) {
        all.emplace_back(closure, decision.wish);
        LoopClosure& added = all.back().first;
        added.measurement.covariance = bounded_covariance(closure.measurement.covariance);
      }
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.from, a.first.to) < std::tie(b.first.from, b.first.to);
  });
  for (auto& [closure, wish] : all) {
    if (wish == Wish::reject) {
      out.rejected.push_back(std::move(closure));
      continue;
    }
    out.judged.push_back(std::move(closure));
    out.certain.push_back(wish == Wish::accept);
  }
  return out;
}

/// Closures that err by more than they say now say so.
void raise_understated(const std::vector<judge::OdometrySegment>& segments, judge::Closures& closures,
                       MapEstimate& map) {
  map.closure_factors = judge::closure_honesty(segments, closures.judged);
  for (LoopClosure& closure : closures.judged)
    if (const auto found = map.closure_factors.find(std::minmax(closure.from.chain, closure.to.chain));
        found != map.closure_factors.end())
      closure.measurement.covariance = judge::scaled(closure.measurement.covariance, found->second);
}

/// Odometry whose rotations have less than this share of their stated variance says much too much of its errors.
constexpr double kOverstatedRotation = 0.15;

/// Odometry whose rotations count as much as the closures show that they are worth, of chains with a factor of at most
/// `most`.
PoseGraph seen_through(const MapEstimate& map, double most = 1.0) {
  PoseGraph out = map.graph;
  for (PoseGraphEdge& edge : out.edges)
    if (const auto factor = map.rotation_factors.find(map.nodes[edge.from].id.chain);
        factor != map.rotation_factors.end() && factor->second <= most)
      edge.information = judge::scale_rotation(edge.information, 1.0 / factor->second);
  return out;
}

/// Odometry whose loops are so many times their stated variance, at least, says much too little of its errors.
constexpr double kUnderstated = 4.0;

/// Probability with which the odometry of a segment agrees with the map after all.
constexpr double kRightAfterAll = 0.999;

/// Says by how much failed odometry missed, and leaves the graph as sure of it as it then deserves. A segment that
/// turns out to have been right, nearly or within its own doubt, is no failure.
void record_failure(const judge::FailedSegment& failed, MapEstimate& map) {
  const MapNode &a = map.nodes[failed.from], &b = map.nodes[failed.to];
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (edge.from < failed.from || edge.to > failed.to) continue;
    const Matrix6d to_end = adjoint(b.T_odom_body.inverse() * map.nodes[edge.to].T_odom_body);
    covariance += to_end * inverse_of(edge.information) * to_end.transpose();
  }
  const Vector6d jump = local(a.T_odom_body.inverse() * b.T_odom_body, a.T_world_body.inverse() * b.T_world_body);
  const double jump_m = jump.head<3>().norm(), jump_rad = jump.tail<3>().norm();
  if (squared_distance(jump, covariance) < chi_square_quantile(kRightAfterAll, 6)) return;
  map.failed_odometry.push_back({a.id.chain, a.id.index, b.id.index, jump_m, jump_rad});
  judge::weaken(map.graph, map.odometry_edges, failed.from, failed.to, jump_m, jump_rad);
}

void label_components(MapEstimate& map) {
  const auto [label, count] = components(map.graph);
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].component = static_cast<std::uint32_t>(label[i]);
  map.components = static_cast<std::uint32_t>(count);
  map.degrees_of_freedom = degrees_of_freedom(map.graph);
}

void adopt(const judge::Optimum& optimum, MapEstimate& map) {
  for (std::size_t k = 0; k < optimum.closure_of_edge.size(); ++k) {
    map.graph.edges.push_back(optimum.graph.edges[map.odometry_edges + k]);
    map.closures[optimum.closure_of_edge[k]].accepted = true;
  }
  for (std::size_t c = 0; c < map.closures.size(); ++c) {
    map.closures[c].objection = optimum.objections[c];
    map.closures[c].price = optimum.prices[c];
  }
  map.graph.poses = optimum.solution.poses;
  map.cost = optimum.solution.summary.final_cost;
  map.from_measurements = optimum.from_measurements;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
  for (const judge::FailedSegment& failed : optimum.failed) record_failure(failed, map);
}

}  // namespace

std::vector<judge::OdometrySegment> odometry_segments(const std::vector<MapNode>& nodes,
                                                      const std::vector<std::optional<Matrix6d>>& step_to) {
  std::vector<judge::OdometrySegment> segments;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (step_to[i])
      segments.back().step_covariance.push_back(*step_to[i]);
    else
      segments.push_back({.id = nodes[i].id.chain});
    segments.back().index.push_back(nodes[i].id.index);
    segments.back().T_odom_body.push_back(nodes[i].T_odom_body);
  }
  return segments;
}

namespace {

/// The honesty of odometry by the closures that fit. Failed odometry is a gap: the map's word on it is not odometry's.
std::map<ChainId, judge::OdometryHonesty> honesty_after(const MapEstimate& map, const judge::Optimum& optimum,
                                                        const std::vector<LoopClosure>& closures) {
  std::vector<std::optional<Matrix6d>> step_to(map.nodes.size());
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    const auto holds = [&](const judge::FailedSegment& f) { return f.from < edge.to && edge.from < f.to; };
    if (std::ranges::none_of(optimum.failed, holds)) step_to[edge.to] = inverse_of(edge.information);
  }
  std::vector<LoopClosure> fitting;
  for (const std::size_t c : optimum.closure_of_edge) fitting.push_back(closures[c]);
  return judge::odometry_honesty(odometry_segments(map.nodes, step_to), fitting);
}

/// Probability with which the poses miss by no more than this what honest measurements say.
constexpr double kHonestMiss = 0.999;

/// Whether the map misses its measurements by more than they allow for. Odometry that fails once makes all loops over
/// that segment miss and may look far worse than it says everywhere; the map then fits all the same.
bool is_contradicted(const judge::Optimum& optimum) {
  const std::size_t degrees = degrees_of_freedom(optimum.graph);
  return degrees > 0 &&
         optimum.solution.summary.final_cost > chi_square_quantile(kHonestMiss, static_cast<double>(degrees));
}

/// True if the odometry of any chain was far worse than it said; it now says so.
bool raise_understated(const std::map<ChainId, judge::OdometryHonesty>& honesty, const judge::Optimum& optimum,
                       MapEstimate& map, PoseGraph& searched) {
  std::map<ChainId, double> factors;
  for (const auto& [chain, worth] : honesty)
    if (worth.whole > kUnderstated) factors[chain] = worth.whole;
  if (factors.empty() || !is_contradicted(optimum)) return false;
  map.understated = std::move(factors);
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const auto found = map.understated.find(map.nodes[map.graph.edges[e].from].id.chain);
    if (found == map.understated.end()) continue;
    for (PoseGraph* graph : {&map.graph, &searched}) graph->edges[e].information /= found->second;
  }
  return true;
}

/// The map of submaps that do not contradict each other.
MapEstimate estimate_together(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config,
                              const DecisionSet& decisions, const std::set<SubmapPair>& refuted) {
  MapEstimate map;
  const judge::NodeIndex index = attach_submaps(submaps, map);
  const auto spare = spare_pairs(verdicts, submaps,
                                 {.with_one_chain = static_cast<std::size_t>(config.most_closed_pairs),
                                  .in_all = static_cast<std::size_t>(config.most_pairs_in_all)});
  map.spare_pairs = spare.size();
  judge::Closures closures = collect_closures(verdicts, decisions, submaps, index, spare, refuted);
  const std::vector<LoopClosure> stated = closures.judged;
  const std::vector<judge::OdometrySegment> segments = odometry_segments(map.nodes, stated_steps(submaps, index));
  if (config.judge_closures) raise_understated(segments, closures, map);
  if (config.judge_odometry)
    for (const auto& [chain, worth] : judge::odometry_honesty(segments, closures.judged))
      map.rotation_factors[chain] = worth.rotation;
  PoseGraph searched = seen_through(map);
  map.graph = seen_through(map, kOverstatedRotation);
  const auto decide = [&] {
    return judge::judge_closures({map.nodes, map.graph, searched, map.odometry_edges}, index, closures,
                                 config.outlier_rejection, config.gnc);
  };
  judge::Optimum optimum = decide();
  auto honesty = honesty_after(map, optimum, closures.judged);
  if (config.judge_odometry && raise_understated(honesty, optimum, map, searched)) {
    const judge::SearchWork before = optimum.work;
    optimum = decide();
    optimum.work += before;
    honesty = honesty_after(map, optimum, closures.judged);
  }
  map.work = optimum.work;
  for (const auto& [chain, worth] : honesty) map.overstated[chain] = std::min(1.0, worth.whole);
  for (std::size_t c = 0; c < closures.judged.size(); ++c)
    map.closures.push_back({stated[c], false, closures.certain[c], judge::Objection::no_map});
  map.converged = estimation::is_usable(optimum.solution.summary.termination);
  if (map.converged) adopt(optimum, map);
  for (const LoopClosure& closure : closures.rejected)
    map.closures.push_back({closure, false, true, judge::Objection::operators});
  for (const LoopClosure& closure : closures.refuted)
    map.closures.push_back({closure, false, false, judge::Objection::fixes});
  std::ranges::stable_sort(
      map.closures, {}, [](const JudgedClosure& judged) { return std::pair(judged.closure.from, judged.closure.to); });
  label_components(map);
  return map;
}

}  // namespace

const MapNode* find_node(const MapEstimate& map, const KeyframeId& id) {
  const auto node = std::ranges::lower_bound(map.nodes, id, {}, &MapNode::id);
  return node != map.nodes.end() && node->id == id ? &*node : nullptr;
}

MapEstimate estimate_map(const SubmapSet& all_submaps, const VerdictSet& verdicts, const MapConfig& config,
                         const DecisionSet& decisions, const std::set<SubmapPair>& refuted) {
  std::vector<SubmapId> left_out;
  const SubmapSet submaps = without_contradictions(all_submaps, left_out);
  const auto estimate = [&](const SubmapSet& some) {
    return estimate_together(some, verdicts, config, decisions, refuted);
  };
  MapEstimate best = estimate(submaps);
  if (best.converged) {
    best.left_out = std::move(left_out);
    return best;
  }
  // Some chains' numbers may be what cannot be solved; the others keep their map. The largest counts, then the first.
  SubmapSet used = submaps;
  const auto try_with = [&](SubmapSet some) {
    MapEstimate map = estimate(some);
    if (!map.converged || (best.converged && map.nodes.size() <= best.nodes.size())) return;
    best = std::move(map);
    used = std::move(some);
  };
  const std::vector<SubmapSet> chains = by_chain(submaps);
  SubmapSet sound;  // what can be solved alone
  for (const SubmapSet& chain : chains)
    if (estimate(chain).converged) sound.insert(chain.begin(), chain.end());
  if (!sound.empty() && sound.size() < submaps.size()) try_with(std::move(sound));
  const std::span<const SubmapSet> left = best.converged ? std::span<const SubmapSet>() : std::span(chains);
  for (const SubmapSet& chain : left) {
    SubmapSet others = submaps;
    std::erase_if(others, [&](const auto& entry) { return chain.contains(entry.first); });
    try_with(std::move(others));
  }
  for (const auto& [id, submap] : submaps)
    if (!used.contains(id)) left_out.push_back(id);
  best.left_out = std::move(left_out);
  return best;
}

}  // namespace tutti::server
