// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chain_graph.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

namespace tutti::estimation::internal {
namespace {

/// Ends, roles and incidence; measurements stay to be filled in.
void join(std::span<const ChainConstraint> constraints, ChainGraph& now) {
  const std::size_t runs = now.runs();
  std::vector<std::size_t> position(now.nodes.back() + 1);
  for (std::size_t k = 0; k < now.nodes.size(); ++k) position[now.nodes[k]] = k;
  auto& edges = now.graph.edges;
  edges.resize(runs + constraints.size());
  std::size_t e = runs;
  for (std::size_t k = 0; k < runs; ++k) edges[k].from = k, edges[k].to = k + 1;
  for (const auto& constraint : constraints) {
    if (constraint.from == constraint.to) continue;
    edges[e].from = position[constraint.from];
    edges[e].to = position[constraint.to];
    ++e;
  }
  edges.resize(e);
  now.covariance.resize(edges.size() - runs);

  auto& start = now.incident_start;
  start.assign(now.nodes.size() + 1, 0);
  for (const auto& edge : edges) ++start[edge.from + 1], ++start[edge.to + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  now.incident.resize(2 * edges.size());
  std::vector<int> next(start.begin(), start.end() - 1);
  for (e = 0; e < edges.size(); ++e) {
    const int from = static_cast<int>(edges[e].from);
    const int to = static_cast<int>(edges[e].to);
    now.incident[next[from]++] = {to, static_cast<int>(e)};
    now.incident[next[to]++] = {from, static_cast<int>(e)};
  }
}

/// Nodes by their place in the chain, edges by their ends and order.
Carried compare(const ChainGraph& before, const ChainGraph& now) {
  Carried out;
  out.node.assign(before.nodes.size(), -1);
  out.changed.assign(now.nodes.size(), 1);
  out.edges.assign(now.graph.edges.size(), Carried::kNew);
  std::vector<std::size_t> old(now.nodes.size(), Carried::kNew);
  for (std::size_t k = 0, o = 0; k < now.nodes.size() && o < before.nodes.size();) {
    if (now.nodes[k] == before.nodes[o]) old[k] = o, out.node[o] = static_cast<int>(k);
    const bool next_old = before.nodes[o] <= now.nodes[k];
    k += now.nodes[k] <= before.nodes[o] ? 1 : 0;
    o += next_old ? 1 : 0;
  }
  for (std::size_t k = 0; k < now.nodes.size(); ++k) {
    if (old[k] == Carried::kNew) continue;
    const auto was = before.incident_to(old[k]);
    const auto is = now.incident_to(k);
    auto next = was.begin();
    std::size_t found = 0;
    for (const auto& [node, edge] : is) {
      const bool run = static_cast<std::size_t>(edge) < now.runs();
      const auto& ends = now.graph.edges[edge];
      const auto same = std::find_if(next, was.end(), [&, &n = node](const ChainGraph::Incident& other) {
        return out.node[other.node] == n && (static_cast<std::size_t>(other.edge) < before.runs()) == run &&
               (before.graph.edges[other.edge].from == old[k]) == (ends.from == k);
      });
      if (same == was.end()) continue;
      if (ends.from == k) out.edges[edge] = static_cast<std::size_t>(same->edge);
      next = same + 1;
      ++found;
    }
    out.changed[k] = found == is.size() && found == was.size() ? 0 : 1;
  }
  return out;
}

}  // namespace

std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints) {
  std::size_t last = 0;
  for (const auto& constraint : constraints)
    if (constraint.from != constraint.to) last = std::max({last, constraint.from, constraint.to});
  std::vector<char> constrained(last + 1, 0);
  constrained.front() = 1;
  for (const auto& constraint : constraints)
    if (constraint.from != constraint.to) constrained[constraint.from] = constrained[constraint.to] = 1;
  std::vector<std::size_t> nodes;
  for (std::size_t k = 0; k <= last; ++k)
    if (constrained[k] != 0) nodes.push_back(k);
  return nodes;
}

bool Carried::same_pattern() const {
  return std::none_of(node.begin(), node.end(), [](int n) { return n < 0; }) &&
         std::none_of(changed.begin(), changed.end(), [](char c) { return c != 0; });
}

Carried reduce(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
               std::span<const ChainConstraint> constraints, const Pose3& first, const ChainGraph& before,
               ChainGraph& now) {
  now.nodes = std::move(nodes);
  join(constraints, now);
  Carried carried = compare(before, now);
  auto& [poses, edges] = now.graph;
  poses.assign(1, first);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    poses.push_back(poses.back() * runs[k].T_begin_end);
    edges[k].T_from_to = runs[k].T_begin_end;
    edges[k].information = runs[k].information;
    std::size_t& same = carried.edges[k];  // unless of other steps
    if (same != Carried::kNew && !(before.graph.edges[same].T_from_to == runs[k].T_begin_end)) same = Carried::kNew;
  }
  std::size_t next = runs.size();
  for (const auto& [from, to, measurement] : constraints) {
    if (from == to) continue;
    const std::size_t e = next++;
    edges[e].T_from_to = measurement.T_a_b;
    now.covariance[e - runs.size()] = measurement.covariance;
    std::size_t& same = carried.edges[e];
    if (same != Carried::kNew && before.covariance[same - before.runs()] == measurement.covariance) {
      edges[e].information = before.graph.edges[same].information;
      if (!(before.graph.edges[same].T_from_to == measurement.T_a_b)) same = Carried::kNew;
    } else {
      edges[e].information = measurement.covariance.llt().solve(Matrix6d::Identity());
      same = Carried::kNew;
    }
  }
  return carried;
}

}  // namespace tutti::estimation::internal
