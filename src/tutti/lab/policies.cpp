// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/policies.hpp"

#include <algorithm>
#include <iterator>
#include <span>
#include <string_view>
#include <vector>

#include "tutti/consistency/links.hpp"

namespace tutti::lab {
namespace {

using consistency::ConstraintKind;
using consistency::Link;
using consistency::LinkCollector;
using consistency::PolicyInput;
using consistency::Selection;

constexpr std::size_t kDefaultBudget = 25;  ///< Until one is set.
/// Draws per link wanted; a graph that yields less than one new link in so many draws has none left.
constexpr std::size_t kDrawsPerLink = 50;

struct LabPolicy {
  std::string_view name;
  std::unique_ptr<consistency::ConstraintPolicy> (*make)(const Rng& rng);
};
using Made = std::unique_ptr<consistency::ConstraintPolicy>;
constexpr LabPolicy kPolicies[] = {
    {"every_node_2", [](const Rng&) -> Made { return std::make_unique<EveryNode2Policy>(); }},
    {"uniform", [](const Rng&) -> Made { return std::make_unique<UniformPolicy>(kDefaultBudget); }},
    {"random", [](const Rng& rng) -> Made { return std::make_unique<RandomPolicy>(kDefaultBudget, rng); }},
    {"skeleton", [](const Rng&) -> Made { return std::make_unique<SkeletonPolicy>(); }},
};

}  // namespace

Selection UniformPolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.pairs.size();
  if (nodes < 2) return std::move(collector).take();
  const std::size_t links = std::min(budget(), nodes - 1);
  const auto end = [&](std::size_t link) { return (link * (nodes - 1) + links / 2) / links; };  // rounded
  for (std::size_t link = 0; link < links; ++link) collector.add({end(link), end(link + 1)}, ConstraintKind::other);
  return std::move(collector).take();
}

Selection RandomPolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.pairs.size();
  if (nodes < 2) return std::move(collector).take();
  const consistency::Neighbourhood neighbourhood(input, {});
  constexpr ConstraintKind kKinds[] = {ConstraintKind::small, ConstraintKind::mid, ConstraintKind::large};
  Rng rng = rng_.fork(input.graph.revision);
  for (std::size_t draw = 0; draw < kDrawsPerLink * budget() && collector.size() < budget(); ++draw) {
    const auto node = static_cast<std::size_t>(rng.index(nodes));
    const ConstraintKind kind = kKinds[rng.index(3)];
    for (const Link& link : neighbourhood.links(node, kind))
      if (collector.size() < budget()) collector.add(link, kind);
  }
  return std::move(collector).take();
}

Selection EveryNode2Policy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.pairs.size();
  for (std::size_t i = 0; i < nodes; ++i)
    for (std::size_t hop = 1; hop <= 2 && i + hop < nodes; ++hop) collector.add({i, i + hop}, ConstraintKind::other);
  return std::move(collector).take();
}

Result<std::unique_ptr<consistency::ConstraintPolicy>> make_policy(const std::string& name,
                                                                   const robot::AgentConfig& config, const Rng& rng) {
  if (const LabPolicy* own = row_of(std::span(kPolicies), name)) return own->make(rng);
  consistency::PolicyConfig of_product = config.policy;
  of_product.name = name;
  if (auto policy = consistency::make_policy(of_product, config.compare)) return policy;
  std::vector<std::string> known = names_of(consistency::policies());
  std::ranges::move(names_of(kPolicies), std::back_inserter(known));
  return fail(ErrorCode::configuration, "policy '{}' is unknown, expected {}", name, or_list(known));
}

}  // namespace tutti::lab
