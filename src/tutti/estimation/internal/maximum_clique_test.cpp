// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/maximum_clique.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "tutti/base/random.hpp"

namespace tutti::estimation::internal {
namespace {

BitGraph random_graph(Rng& rng, int n, double density) {
  BitGraph graph(n);
  for (int a = 0; a < n; ++a)
    for (int b = a + 1; b < n; ++b)
      if (rng.bernoulli(density)) graph.connect(a, b);
  return graph;
}

bool is_clique(const BitGraph& graph, const std::vector<int>& vertices) {
  for (std::size_t a = 0; a < vertices.size(); ++a)
    for (std::size_t b = a + 1; b < vertices.size(); ++b)
      if (!graph.connected(vertices[a], vertices[b])) return false;
  return true;
}

std::size_t brute_force(const BitGraph& graph) {
  std::size_t best = 0;
  for (unsigned subset = 0; subset < (1U << graph.vertices()); ++subset) {
    if (static_cast<std::size_t>(std::popcount(subset)) <= best) continue;
    std::vector<int> vertices;
    for (int v = 0; v < graph.vertices(); ++v)
      if ((subset >> v) & 1U) vertices.push_back(v);
    if (is_clique(graph, vertices)) best = vertices.size();
  }
  return best;
}

TEST(MaximumClique, IsMaximumOnSmallGraphs) {
  Rng rng(1);
  for (int k = 0; k < 60; ++k) {
    const BitGraph graph = random_graph(rng, 1 + static_cast<int>(rng.index(12)), rng.uniform(0.1, 0.95));
    const Clique clique = maximum_clique(graph, 100'000);
    EXPECT_TRUE(clique.is_maximum);
    EXPECT_TRUE(is_clique(graph, clique.vertices));
    EXPECT_EQ(clique.vertices.size(), brute_force(graph));
  }
}

TEST(MaximumClique, FindsAPlantedCliqueInALargeGraph) {
  Rng rng(2);
  BitGraph graph = random_graph(rng, 1000, 0.3);
  std::vector<int> planted;
  for (int v = 3; v < 1000; v += 25) planted.push_back(v);
  for (const int a : planted)
    for (const int b : planted)
      if (a < b) graph.connect(a, b);
  const Clique clique = maximum_clique(graph, 20'000);
  EXPECT_TRUE(is_clique(graph, clique.vertices));
  EXPECT_TRUE(std::includes(clique.vertices.begin(), clique.vertices.end(), planted.begin(), planted.end()));
}

TEST(MaximumClique, SaysWhenItRanOutOfSteps) {
  Rng rng(3);
  const BitGraph graph = random_graph(rng, 300, 0.8);
  const Clique hurried = maximum_clique(graph, 10);
  EXPECT_FALSE(hurried.is_maximum);
  EXPECT_TRUE(is_clique(graph, hurried.vertices));
  EXPECT_GE(hurried.vertices.size(), 20U);
}

TEST(MaximumClique, EmptyGraphAndNoEdges) {
  EXPECT_TRUE(maximum_clique(BitGraph(0), 10).vertices.empty());
  EXPECT_EQ(maximum_clique(BitGraph(70), 1000).vertices.size(), 1U);
}

}  // namespace
}  // namespace tutti::estimation::internal
