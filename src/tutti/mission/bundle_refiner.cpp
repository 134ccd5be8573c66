// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bundle_refiner.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace tutti::mission {
namespace {

using server::JudgedClosure;

/// Pairs of submaps of which the map has accepted a closure.
std::vector<SubmapPair> accepted_pairs(const server::MapToRefine& map) {
  std::set<std::pair<KeyframeId, KeyframeId>> accepted;
  for (const JudgedClosure& judged : map.estimate.closures)
    if (judged.accepted) accepted.insert({judged.closure.from, judged.closure.to});
  std::vector<SubmapPair> out;
  for (const auto& [pair, verdict] : map.verdicts)
    if (std::ranges::any_of(verdict.closures, [&](const LoopClosure& c) { return accepted.contains({c.from, c.to}); }))
      out.push_back(pair);
  return out;
}

}  // namespace

/// Submaps whose keyframes the map all has, with what their cameras saw.
Result<std::vector<bundle::PosedSubmap>> BundleRefiner::posed(const server::MapToRefine& map) const {
  std::vector<bundle::PosedSubmap> out;
  for (const auto& [id, size] : map.payload_sizes) {
    if (size.observations == 0) continue;
    auto payload = map.payloads.visual(id);
    if (!payload) return tl::unexpected(payload.error());
    auto submap = std::make_shared<Submap>(*map.submaps.at(id));
    submap->visual = std::move(*payload);
    bundle::PosedSubmap at{.submap = nullptr, .T_world_body = {}};
    for (const Keyframe& keyframe : submap->keyframes) {
      const KeyframeId node{id.chain, keyframe.index};
      const auto found = std::ranges::lower_bound(map.estimate.nodes, node, {}, &server::MapNode::id);
      if (found == map.estimate.nodes.end() || found->id != node) break;  // of a submap that was left out
      at.T_world_body.push_back(found->T_world_body);
    }
    if (at.T_world_body.size() != submap->keyframes.size()) continue;
    at.submap = std::move(submap);
    out.push_back(std::move(at));
  }
  return out;
}

Result<server::Refinement> BundleRefiner::refine(const server::MapToRefine& map) const {
  auto submaps = posed(map);
  if (!submaps) return tl::unexpected(submaps.error());
  server::Refinement out;
  if (submaps->empty()) return out;
  const auto refined =
      bundle::refine_map({.submaps = std::move(*submaps), .closed = accepted_pairs(map), .matches = {}}, config_);
  if (!refined) return tl::unexpected(refined.error());
  for (const bundle::RelativeFactor& factor : refined->factors) out.steps.push_back({factor.from, factor.measurement});
  for (const bundle::BundleKeyframe& keyframe : refined->keyframes)
    out.T_world_body.emplace(keyframe.id, keyframe.T_world_body);
  return out;
}

std::shared_ptr<const BundleRefiner> make_refiner(const MissionConfig& config) {
  if (config.closures.finder != "visual" && config.closures.finder != "sensors") return nullptr;
  return std::make_shared<const BundleRefiner>(config.refinement);
}

}  // namespace tutti::mission
