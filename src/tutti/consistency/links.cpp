// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/links.hpp"

#include <algorithm>
#include <map>

namespace tutti::consistency {

std::optional<std::size_t> node_at(const PolicyInput& input, Timestamp stamp) {
  const auto& pairs = input.pairs;
  const auto at =
      std::ranges::lower_bound(pairs, stamp, {}, [&](const NodePair& pair) { return input.nodes[pair.robot].stamp; });
  if (at == pairs.end() || input.nodes[at->robot].stamp != stamp) return std::nullopt;
  return static_cast<std::size_t>(at - pairs.begin());
}

Neighbourhood::Neighbourhood(const PolicyInput& input, const PolicyConfig& config)
    : mid_hops_(static_cast<std::size_t>(config.mid_hops)),
      nearest_submaps_(static_cast<std::size_t>(config.nearest_submaps)) {
  std::map<std::uint32_t, std::size_t> place;  // of each submap in submaps_
  std::vector<double> count;
  const auto& pairs = input.pairs;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const Eigen::Vector3d& x = input.graph.nodes[pairs[n].proxy].T_world_body.translation;
    const auto [found, is_new] = place.try_emplace(input.nodes[pairs[n].robot].submap, submaps_.size());
    if (is_new) {
      submaps_.push_back({Eigen::Vector3d::Zero(), n});
      count.push_back(0.0);
    }
    SubmapPlace& submap = submaps_[found->second];
    count[found->second] += 1.0;
    submap.centroid_world += (x - submap.centroid_world) / count[found->second];
    positions_world_.push_back(x);
    submap_of_.push_back(found->second);
  }
}

std::vector<Link> Neighbourhood::links(std::size_t node, ConstraintKind kind) const {
  switch (kind) {
    case ConstraintKind::small:
      return hop_links(node, 1);
    case ConstraintKind::mid:
      return hop_links(node, mid_hops_);
    case ConstraintKind::large:
      return submap_links(node);
    case ConstraintKind::other:
      break;
  }
  return {};
}

std::vector<Link> Neighbourhood::hop_links(std::size_t node, std::size_t hops) const {
  std::vector<Link> out;
  if (node >= hops) out.push_back({node - hops, node});
  if (node + hops < positions_world_.size()) out.push_back({node, node + hops});
  return out;
}

std::vector<Link> Neighbourhood::submap_links(std::size_t node) const {
  const std::size_t own = submap_of_[node];
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (std::size_t s = 0; s < submaps_.size(); ++s)
    if (s != own) by_distance.emplace_back((submaps_[s].centroid_world - submaps_[own].centroid_world).norm(), s);
  const std::size_t k = std::min(nearest_submaps_, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(k), by_distance.end());
  std::vector<Link> out;
  for (std::size_t i = 0; i < k; ++i) out.push_back({submaps_[own].first, submaps_[by_distance[i].second].first});
  return out;
}

LinkCollector::LinkCollector(const PolicyInput& input, bool from_scratch)
    : maker_(input.graph, input.chain, input.nodes, input.pairs) {
  selection_.replaces_all = from_scratch && maker_.size() >= 2;
  if (from_scratch) return;
  for (const Constraint& kept : input.ledger.constraints()) {
    const auto a = node_at(input, kept.from_stamp), b = node_at(input, kept.to_stamp);
    if (!a || !b) continue;
    linked_.emplace(std::min(*a, *b), std::max(*a, *b));
    selection_.constraints.push_back(maker_.make(*a, *b, kept.kind));
  }
}

void LinkCollector::add(Link link, ConstraintKind kind) {
  if (link.a == link.b) return;
  if (!linked_.emplace(std::min(link.a, link.b), std::max(link.a, link.b)).second) return;
  selection_.constraints.push_back(maker_.make(link.a, link.b, kind));
  ++added_;
}

void LinkCollector::add(const std::vector<Link>& links, ConstraintKind kind) {
  for (const Link& link : links) add(link, kind);
}

Selection LinkCollector::take() && { return std::move(selection_); }

}  // namespace tutti::consistency
