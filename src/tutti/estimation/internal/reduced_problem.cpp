// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/reduced_problem.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace tutti::estimation::internal {
namespace {

std::size_t position_of(const std::vector<std::size_t>& nodes, std::size_t node) {
  return static_cast<std::size_t>(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
}

bool same_pattern(const ChainGraph& a, const ChainGraph& b) {
  return a.nodes == b.nodes &&
         std::equal(a.graph.edges.begin(), a.graph.edges.end(), b.graph.edges.begin(), b.graph.edges.end(),
                    [](const auto& p, const auto& q) { return p.from == q.from && p.to == q.to; });
}

}  // namespace

std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints) {
  std::vector<std::size_t> nodes{0};
  nodes.reserve(2 * constraints.size() + 1);
  for (const auto& constraint : constraints) {
    if (constraint.from == constraint.to) continue;
    nodes.push_back(constraint.from);
    nodes.push_back(constraint.to);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

ChainGraph reduce(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
                  std::span<const ChainConstraint> constraints, const Pose3& first) {
  ChainGraph out{.nodes = std::move(nodes), .graph = {}, .roles = {}, .edges = {}};
  PoseGraph& graph = out.graph;
  graph.poses.reserve(out.nodes.size());
  graph.edges.reserve(runs.size() + constraints.size());
  graph.poses.push_back(first);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    graph.poses.push_back(graph.poses.back() * runs[k].T_begin_end);
    graph.edges.push_back({k, k + 1, runs[k].T_begin_end, runs[k].information});
  }
  out.roles.assign(runs.size(), EdgeRole::trusted);
  for (const auto& constraint : constraints) {
    out.edges.push_back(graph.edges.size());
    if (constraint.from == constraint.to) continue;
    graph.edges.push_back({position_of(out.nodes, constraint.from), position_of(out.nodes, constraint.to),
                           constraint.measurement.T_a_b,
                           constraint.measurement.covariance.llt().solve(Matrix6d::Identity())});
    out.roles.push_back(constraint.doubtful ? EdgeRole::robust : EdgeRole::trusted);
  }
  return out;
}

ReducedProblem::ReducedProblem(ChainGraph graph)
    : reduced_(std::move(graph)),
      structure_(analyse_blocks(reduced_.graph)),
      gauss_newton_(reduced_.graph, structure_) {}

bool ReducedProblem::assign(ChainGraph& graph) {
  if (!same_pattern(reduced_, graph)) return false;
  reduced_ = std::move(graph);
  return true;
}

}  // namespace tutti::estimation::internal
