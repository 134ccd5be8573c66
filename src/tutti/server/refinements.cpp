// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/refinements.hpp"

#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/estimation/termination.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/judge_closures.hpp"
#include "tutti/server/known_ground.hpp"

namespace tutti::server {
namespace {

bool has_failed(const MapEstimate& map, const KeyframeId& from) {
  return std::ranges::any_of(map.failed_odometry, [&](const FailedOdometry& failed) {
    return failed.chain == from.chain && failed.from <= from.index && from.index < failed.to;
  });
}

std::map<KeyframeId, const RelativePose*> newest_steps(const Refinements& refinements) {
  std::map<KeyframeId, const RelativePose*> out;
  for (const auto& [revision, refinement] : refinements.all())
    for (const RefinedStep& step : refinement->steps) out.insert_or_assign(step.from, &step.measurement);
  return out;
}

void put_steps(const Refinements& refinements, MapEstimate& map) {
  const auto steps = newest_steps(refinements);
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    PoseGraphEdge& edge = map.graph.edges[e];
    const KeyframeId from = map.nodes[edge.from].id, to = map.nodes[edge.to].id;
    const auto step = steps.find(from);
    if (step == steps.end() || to.index != from.index + 1 || has_failed(map, from)) continue;
    const auto overstated = map.overstated.find(from.chain);
    map.odometry_of_steps[e] =
        inverse_of(edge.information) * (overstated == map.overstated.end() ? 1.0 : overstated->second);
    edge.T_from_to = step->second->T_a_b;
    edge.information = judge::information_of(bounded_covariance(step->second->covariance));
  }
}

/// The submaps that have the keyframes that closures join: two for a keyframe that is shared.
std::map<KeyframeId, std::vector<SubmapId>> submaps_of_closures(const MapEstimate& map, const SubmapSet& submaps) {
  std::map<KeyframeId, std::vector<SubmapId>> out;
  for (std::size_t e = map.odometry_edges; e < map.graph.edges.size(); ++e)
    for (const std::size_t node : {map.graph.edges[e].from, map.graph.edges[e].to}) out[map.nodes[node].id];
  for (const auto& [id, submap] : submaps) {
    const KeyframeId last{id.chain, submap->keyframes.back().index};
    for (auto it = out.lower_bound({id.chain, submap->keyframes.front().index}); it != out.end() && it->first <= last;
         ++it)
      it->second.push_back(id);
  }
  return out;
}

bool ties(const Refinement& refinement, const std::vector<SubmapId>& some, const std::vector<SubmapId>& others) {
  return std::ranges::any_of(some, [&](const SubmapId& a) {
    return std::ranges::any_of(
        others, [&](const SubmapId& b) { return std::ranges::binary_search(refinement.closed, ordered(a, b)); });
  });
}

void put_closures(const Refinements& refinements, const SubmapSet& submaps, MapEstimate& map) {
  const auto submaps_with = submaps_of_closures(map, submaps);
  for (std::size_t e = map.odometry_edges; e < map.graph.edges.size(); ++e) {
    PoseGraphEdge& edge = map.graph.edges[e];
    const KeyframeId a = map.nodes[edge.from].id, b = map.nodes[edge.to].id;
    for (const auto& [revision, refinement] : std::views::reverse(refinements.all())) {
      const auto from = refinement->T_world_body.find(a), to = refinement->T_world_body.find(b);
      if (from == refinement->T_world_body.end() || to == refinement->T_world_body.end()) continue;
      if (!ties(*refinement, submaps_with.at(a), submaps_with.at(b))) continue;
      edge.T_from_to = from->second.inverse() * to->second;
      break;
    }
  }
}

bool has_all(const MapEstimate& map, const Submap& submap) {
  return std::ranges::all_of(submap.keyframes, [&](const Keyframe& keyframe) {
    return find_node(map, {submap.id.chain, keyframe.index}) != nullptr;
  });
}

/// Where the map has the keyframes of a submap, all of which it has.
std::vector<Pose3> poses_of(const Submap& submap, const MapEstimate& map) {
  std::vector<Pose3> out;
  for (const Keyframe& keyframe : submap.keyframes)
    out.push_back(find_node(map, {submap.id.chain, keyframe.index})->T_world_body);
  return out;
}

/// Submaps of the scope that are not in the other, and those of pairs that are in one of the two only and that none of
/// these is of: a new submap fits itself to what it closes with, which waits for the whole.
std::set<SubmapId> difference(const RefinementScope& scope, const RefinementScope& before) {
  std::set<SubmapId> out;
  std::ranges::set_difference(scope.submaps, before.submaps, std::inserter(out, out.end()));
  std::vector<SubmapPair> pairs;
  std::ranges::set_symmetric_difference(scope.closed, before.closed, std::back_inserter(pairs));
  const std::set<SubmapId> added = out;
  for (const auto& [first, second] : pairs)
    for (const SubmapId& id : {first, second})
      if (scope.submaps.contains(id) && !added.contains(first) && !added.contains(second)) out.insert(id);
  return out;
}

/// Those in `submaps` that are right before and after `id` in its chain.
std::vector<SubmapId> neighbours(const SubmapId& id, const std::set<SubmapId>& submaps) {
  std::vector<SubmapId> out;
  const auto at = submaps.lower_bound(id);
  if (at != submaps.begin() && std::prev(at)->chain == id.chain) out.push_back(*std::prev(at));
  const auto after = submaps.upper_bound(id);
  if (after != submaps.end() && after->chain == id.chain) out.push_back(*after);
  return out;
}

/// The submaps that are tied to the free ones, and are not free.
std::set<SubmapId> fixed_submaps(const RefinementScope& scope, const std::set<SubmapId>& free) {
  std::set<SubmapId> out;
  for (const SubmapId& id : free)
    for (const SubmapId& next : neighbours(id, scope.submaps)) out.insert(next);
  for (const auto& [first, second] : scope.closed) {
    if (free.contains(first)) out.insert(second);
    if (free.contains(second)) out.insert(first);
  }
  std::erase_if(out, [&](const SubmapId& id) { return free.contains(id); });
  return out;
}

}  // namespace

bool Refinements::add(Refinement refinement) {
  TUTTI_CHECK(refinement.why.empty(), "a refinement that failed");
  const std::uint64_t revision = refinement.revision;
  if (all_.contains(revision) || (has_whole() && revision < all_.begin()->first)) return false;
  if (refinement.whole) all_.erase(all_.begin(), all_.lower_bound(revision));
  all_.emplace(revision, std::make_shared<const Refinement>(std::move(refinement)));
  return true;
}

RefinementScope Refinements::scope() const {
  RefinementScope out;
  for (const auto& [revision, refinement] : all_) {
    const std::set<SubmapId> free(refinement->submaps.begin(), refinement->submaps.end());
    out.submaps.insert(free.begin(), free.end());
    std::erase_if(out.closed, [&](const SubmapPair& p) { return free.contains(p.first) || free.contains(p.second); });
    out.closed.insert(refinement->closed.begin(), refinement->closed.end());
  }
  return out;
}

std::size_t Refinements::parts() const { return all_.size() - (has_whole() ? 1 : 0); }

MapEstimate refined(const MapEstimate& map, const SubmapSet& submaps, const Refinements& refinements) {
  if (refinements.all().empty() || !map.converged) return map;
  MapEstimate out = map;
  put_steps(refinements, out);
  if (out.odometry_of_steps.empty()) return map;
  put_closures(refinements, submaps, out);
  auto solution = estimation::solve_pose_graph(out.graph, {.initialisation = "given"});
  if (!estimation::is_usable(solution.summary.termination)) return map;
  out.graph.poses = std::move(solution.poses);
  for (std::size_t i = 0; i < out.nodes.size(); ++i) out.nodes[i].T_world_body = out.graph.poses[i];
  return out;
}

RefinementScope refinable(const MapEstimate& map, const SubmapSet& submaps,
                          const std::map<SubmapId, PayloadSize>& sizes, const VerdictSet& verdicts,
                          const MapRefiner& refiner) {
  RefinementScope out;
  for (const auto& [id, size] : sizes)
    if (refiner.can_refine(size) && std::ranges::find(map.left_out, id) == map.left_out.end() &&
        has_all(map, *submaps.at(id)))
      out.submaps.insert(id);
  out.closed = accepted_pairs(map, verdicts);
  std::erase_if(out.closed, [&](const SubmapPair& pair) {
    return !out.submaps.contains(pair.first) || !out.submaps.contains(pair.second);
  });
  return out;
}

std::optional<RefinementJob> plan_refinement(const RefinementScope& scope, const Refinements& refinements,
                                             const MapEstimate& estimate, const MapEstimate& map,
                                             const SubmapSet& submaps, const RefinementCadence& cadence,
                                             std::uint64_t revision) {
  std::set<SubmapId> free = difference(scope, refinements.scope());
  const bool settles = cadence.settle && refinements.parts() > 0;
  if (scope.submaps.empty() || (free.empty() && !settles)) return std::nullopt;
  RefinementJob job{.revision = revision};
  job.whole = free.empty() || !refinements.has_whole() || refinements.parts() + 1 >= cadence.every;
  if (job.whole) {
    free = scope.submaps;
  } else {
    for (const SubmapId& id : std::set(free))
      for (const SubmapId& next : neighbours(id, scope.submaps)) free.insert(next);
    job.whole = 2 * free.size() > scope.submaps.size();
    if (job.whole) free = scope.submaps;
  }
  std::set<SubmapId> all = fixed_submaps(scope, free);
  all.insert(free.begin(), free.end());
  for (const SubmapId& id : all)
    job.parts.push_back({id, free.contains(id), poses_of(*submaps.at(id), job.whole ? estimate : map)});
  for (const SubmapPair& pair : scope.closed)
    if (free.contains(pair.first) || free.contains(pair.second)) job.closed.push_back(pair);
  return job;
}

}  // namespace tutti::server
