// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chain_graph.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "tutti/estimation/testing/chain_mission.hpp"

namespace tutti::estimation::internal {
namespace {

using namespace estimation::testing;

ChainConstraint any_constraint(Rng& rng, std::size_t nodes) {
  return {rng.index(nodes), rng.index(nodes), {random_pose(rng, 3.0, 1.0), random_covariance(rng, 2e-3, 1e-3)}};
}

/// Removes, replaces, adds and swaps.
void change(Rng& rng, std::size_t nodes, std::vector<ChainConstraint>& constraints) {
  for (std::size_t k = rng.index(4); k > 0 && !constraints.empty(); --k)
    constraints.erase(constraints.begin() + static_cast<std::ptrdiff_t>(rng.index(constraints.size())));
  for (std::size_t k = rng.index(3); k > 0 && !constraints.empty(); --k)
    constraints[rng.index(constraints.size())].measurement.T_a_b = random_pose(rng, 3.0, 1.0);
  for (std::size_t k = rng.index(4); k > 0; --k) constraints.push_back(any_constraint(rng, nodes));
  if (constraints.size() > 1 && rng.bernoulli(0.3)) std::swap(constraints.front(), constraints.back());
}

void expect_carried_is_true(const ChainGraph& before, const ChainGraph& now, const Carried& carried) {
  std::set<std::size_t> taken;
  for (std::size_t e = 0; e < carried.edges.size(); ++e) {
    if (carried.edges[e] == Carried::kNew) continue;
    RC_ASSERT(taken.insert(carried.edges[e]).second);
    const auto& was = before.graph.edges[carried.edges[e]];
    const auto& is = now.graph.edges[e];
    RC_ASSERT(before.nodes[was.from] == now.nodes[is.from]);
    RC_ASSERT(before.nodes[was.to] == now.nodes[is.to]);
    RC_ASSERT(was.T_from_to == is.T_from_to);
    RC_ASSERT(was.information == is.information);
  }
  for (std::size_t o = 0; o < before.nodes.size(); ++o) {
    if (carried.node[o] < 0) continue;
    const auto k = static_cast<std::size_t>(carried.node[o]);
    RC_ASSERT(before.nodes[o] == now.nodes[k]);
    if (carried.changed[k] != 0) continue;
    std::multiset<std::size_t> was;
    std::multiset<std::size_t> is;
    for (const auto& incident : before.incident_to(o)) was.insert(before.nodes[incident.node]);
    for (const auto& incident : now.incident_to(k)) is.insert(now.nodes[incident.node]);
    RC_ASSERT(was == is);
  }
}

RC_GTEST_PROP(ChainGraph, IsTheSameWhateverCameBefore, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const auto m = mission(rng, 40, 0);
  OdometryRuns runs;
  ChainGraph now;
  ChainGraph before;
  std::vector<ChainConstraint> constraints;
  for (int update = 0; update < 6; ++update) {
    change(rng, m.truth.size(), constraints);
    const auto nodes = reduced_nodes(constraints);
    runs.update(nodes, m.odometry);
    std::swap(now, before);
    const Carried carried = reduce(nodes, runs.all(), constraints, m.truth.front(), before, now);
    ChainGraph fresh;
    const Carried nothing = reduce(nodes, runs.all(), constraints, m.truth.front(), {}, fresh);
    RC_ASSERT(now.graph.poses == fresh.graph.poses);
    RC_ASSERT(now.graph.edges.size() == fresh.graph.edges.size());
    for (std::size_t e = 0; e < now.graph.edges.size(); ++e) {
      RC_ASSERT(now.graph.edges[e].T_from_to == fresh.graph.edges[e].T_from_to);
      RC_ASSERT(now.graph.edges[e].information == fresh.graph.edges[e].information);
    }
    RC_ASSERT(now.incident == fresh.incident);
    RC_ASSERT(!nothing.same_pattern());
    expect_carried_is_true(before, now, carried);
    RC_ASSERT(reduce(nodes, runs.all(), constraints, m.truth.front(), now, fresh).same_pattern());
  }
}

TEST(ChainGraph, KeepsWhatStayed) {
  Rng rng(1);
  const auto m = mission(rng, 40, 0);
  std::vector<ChainConstraint> constraints;
  for (std::size_t k = 0; k < 4; ++k) constraints.push_back({10 * k, 10 * k + 10, m.odometry[k]});
  OdometryRuns runs;
  ChainGraph before;
  ChainGraph now;
  const auto update = [&] {
    const auto nodes = reduced_nodes(constraints);
    runs.update(nodes, m.odometry);
    std::swap(now, before);
    return reduce(nodes, runs.all(), constraints, m.truth.front(), before, now);
  };
  update();
  constraints.push_back({15, 20, m.odometry[5]});
  constraints[3].measurement.T_a_b = random_pose(rng, 1.0, 0.1);
  const Carried carried = update();
  EXPECT_EQ(carried.node, (std::vector<int>{0, 1, 3, 4, 5}));
  EXPECT_EQ(carried.changed, (std::vector<char>{0, 1, 1, 1, 0, 0}));
  constexpr auto kNew = Carried::kNew;
  EXPECT_EQ(carried.edges, (std::vector<std::size_t>{0, kNew, kNew, 2, 3, 4, 5, 6, kNew, kNew}));
}

}  // namespace
}  // namespace tutti::estimation::internal
