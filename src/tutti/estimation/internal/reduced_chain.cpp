// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/reduced_chain.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "tutti/estimation/internal/chain_run.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation::internal {
namespace {

/// Chi-square by which rounding may seem to raise the cost of the full graph.
constexpr double kCostTolerance = 1e-3;

/// By how much the cost of the full graph is higher at `after` than at `before`.
double full_cost_change(std::span<const std::size_t> nodes, const LongList<RelativePose>& odometry,
                        const PoseGraph& graph, std::span<const Pose3> before, std::span<const Pose3> after) {
  double change = 0.0;
  for (std::size_t i = 0; i < nodes.back(); ++i) {
    const RelativePose step = odometry[i];
    const Eigen::LLT<Matrix6d> factor(step.covariance);
    Eigen::Matrix<double, 6, 2> r;
    r.col(0) = between_residual(before[i], before[i + 1], step.T_a_b);
    r.col(1) = between_residual(after[i], after[i + 1], step.T_a_b);
    factor.matrixL().solveInPlace(r);
    change += r.col(1).squaredNorm() - r.col(0).squaredNorm();
  }
  for (std::size_t e = nodes.size() - 1; e < graph.edges.size(); ++e) {
    const PoseGraphEdge& edge = graph.edges[e];
    const auto cost = [&](std::span<const Pose3> poses) {
      const Vector6d r = between_residual(poses[nodes[edge.from]], poses[nodes[edge.to]], edge.T_from_to);
      return r.dot(edge.information * r);
    };
    change += cost(after) - cost(before);
  }
  return change;
}

}  // namespace

std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints) {
  std::vector<std::size_t> nodes{0};
  for (const auto& constraint : constraints)
    if (constraint.from != constraint.to) nodes.insert(nodes.end(), {constraint.from, constraint.to});
  std::ranges::sort(nodes);
  const auto repeated = std::ranges::unique(nodes);
  nodes.erase(repeated.begin(), repeated.end());
  return nodes;
}

std::size_t update_runs(std::span<const std::size_t> nodes, const LongList<RelativePose>& odometry,
                        std::vector<PoseGraphEdge>& runs) {
  const std::vector<PoseGraphEdge> before = std::exchange(runs, {});
  std::size_t compounded = 0;
  auto old = before.begin();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const std::size_t begin = nodes[k], end = nodes[k + 1];
    while (old != before.end() && old->from < begin) ++old;
    if (old != before.end() && old->from == begin && old->to == end) {
      runs.push_back(*old);
    } else {
      runs.push_back(as_edge(sum_odometry(odometry.part(begin, end)), begin, end));
      compounded += end - begin;
    }
  }
  return compounded;
}

PoseGraph reduced_graph(std::span<const std::size_t> nodes, std::span<const PoseGraphEdge> runs,
                        std::span<const ChainConstraint> constraints, const Pose3& first) {
  PoseGraph graph{.poses = {first}, .edges = {}};
  graph.edges.reserve(runs.size() + constraints.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    graph.edges.push_back({k, k + 1, runs[k].T_from_to, runs[k].information});
    graph.poses.push_back(graph.poses.back() * runs[k].T_from_to);
  }
  const auto position = [&](std::size_t node) {
    return static_cast<std::size_t>(std::ranges::lower_bound(nodes, node) - nodes.begin());
  };
  for (const auto& [from, to, measurement] : constraints)
    if (from != to)
      graph.edges.push_back({position(from), position(to), measurement.T_a_b, inverse_of(measurement.covariance)});
  return graph;
}

void place(std::span<const PoseGraphEdge> runs, std::span<const Pose3> reduced, const LongList<RelativePose>& odometry,
           LongList<Pose3>& poses) {
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const auto [from, to] = std::pair(runs[k].from, runs[k].to);
    poses.set(to, reduced[k + 1]);
    std::vector<Pose3> placed = poses.part(from, to + 1);
    distribute_odometry(odometry.part(from, to), runs[k], placed);
    for (std::size_t i = from + 1; i < to; ++i) poses.set(i, placed[i - from]);
  }
}

bool polish(std::span<const std::size_t> nodes, const LongList<RelativePose>& odometry, PoseGraph& graph,
            GraphEquations& equations, LongList<Pose3>& poses) {
  const std::vector<Pose3> before = poses.part(0, nodes.back() + 1);
  std::vector<Pose3> polished = before;
  const auto steps_of = [&](std::size_t k) { return odometry.part(nodes[k], nodes[k + 1]); };
  const auto poses_of = [&](std::size_t k) {
    return std::span(polished).subspan(nodes[k], nodes[k + 1] - nodes[k] + 1);
  };
  std::vector<RunSum> sums;
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    sums.push_back(sum_about(steps_of(k), poses_of(k)));
    graph.edges[k] = as_edge(sums[k], k, k + 1);
  }
  std::vector<Pose3> reduced;
  for (const std::size_t node : nodes) reduced.push_back(before[node]);
  if (!is_usable(minimise(equations, reduced, {}, {.max_iterations = 1}).termination)) return false;

  Vector6d delta = Vector6d::Zero();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const Vector6d next = local(before[nodes[k + 1]], reduced[k + 1]);
    distribute_about(steps_of(k), sums[k], delta, next, poses_of(k));
    delta = next;
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) polished[nodes[k]] = reduced[k];
  if (!(full_cost_change(nodes, odometry, graph, before, polished) < kCostTolerance)) return false;
  for (std::size_t i = 0; i < polished.size(); ++i) poses.set(i, polished[i]);
  return true;
}

}  // namespace tutti::estimation::internal
