// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/chain_reduction.hpp"

#include <algorithm>

#include "tutti/estimation/internal/chain_run.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Edges of a node: what matters is whether it is exactly one trusted step in and one out.
struct Passage {
  std::size_t in = kNone;
  std::size_t out = kNone;
  bool other = false;
  [[nodiscard]] bool only_passes() const { return in != kNone && out != kNone && !other; }
};

std::vector<Passage> passages(const PoseGraph& graph, std::span<const EdgeRole> roles) {
  std::vector<Passage> nodes(graph.poses.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& [from, to, T, information] = graph.edges[e];
    const bool step = !roles.empty() && roles[e] == EdgeRole::trusted && from < to;
    if (step && nodes[from].out == kNone)
      nodes[from].out = e;
    else
      nodes[from].other = true;
    if (step && nodes[to].in == kNone)
      nodes[to].in = e;
    else
      nodes[to].other = true;
  }
  return nodes;
}

RelativePose step_of(const PoseGraphEdge& edge) { return {edge.T_from_to, inverse_of(edge.information)}; }

/// Poses of the nodes of a run of these steps.
std::vector<Pose3> poses_of(const PoseGraph& graph, std::span<const std::size_t> steps, std::span<const Pose3> all) {
  std::vector<Pose3> out{all[graph.edges[steps.front()].from]};
  for (const std::size_t e : steps) out.push_back(all[graph.edges[e].to]);
  return out;
}

}  // namespace

ReducedGraph reduce_chains(const PoseGraph& graph, std::span<const EdgeRole> roles, std::span<const std::size_t> fixed,
                           std::span<const Pose3> about) {
  std::vector<Passage> nodes = passages(graph, roles);
  for (const std::size_t i : fixed) nodes[i].other = true;
  ReducedGraph out;
  std::vector<std::size_t> position(nodes.size(), kNone);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].only_passes()) continue;
    position[i] = out.nodes.size();
    out.nodes.push_back(i);
    out.graph.poses.push_back(graph.poses[i]);
  }
  out.edge.resize(graph.edges.size());
  std::vector<RelativePose> steps;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    if (position[edge.from] == kNone) continue;  // within a run, or its end: taken from the run's begin
    if (position[edge.to] != kNone) {
      out.edge[e] = out.graph.edges.size();
      out.graph.edges.push_back({position[edge.from], position[edge.to], edge.T_from_to, edge.information});
      out.roles.push_back(roles.empty() ? EdgeRole::robust : roles[e]);
      continue;
    }
    ReducedGraph::Run run{.edge = out.graph.edges.size(), .steps = {e}};
    steps.assign(1, step_of(edge));
    std::size_t end = edge.to;
    for (; position[end] == kNone; end = graph.edges[run.steps.back()].to) {
      run.steps.push_back(nodes[end].out);
      steps.push_back(step_of(graph.edges[run.steps.back()]));
    }
    const internal::RunSum sum =
        about.empty() ? internal::sum_odometry(steps) : internal::sum_about(steps, poses_of(graph, run.steps, about));
    out.graph.edges.push_back(internal::as_edge(sum, position[edge.from], position[end]));
    out.roles.push_back(EdgeRole::trusted);
    out.runs.push_back(std::move(run));
  }
  return out;
}

void expand_chains(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> reduced_poses,
                   std::vector<Pose3>& poses) {
  for (std::size_t k = 0; k < reduced.nodes.size(); ++k) poses[reduced.nodes[k]] = reduced_poses[k];
  std::vector<RelativePose> steps;
  std::vector<Pose3> run_poses;
  for (const auto& run : reduced.runs) {
    const PoseGraphEdge& compound = reduced.graph.edges[run.edge];
    steps.clear();
    for (const std::size_t e : run.steps) steps.push_back(step_of(graph.edges[e]));
    run_poses.assign(steps.size() + 1, reduced_poses[compound.from]);
    run_poses.back() = reduced_poses[compound.to];
    internal::distribute_odometry(steps, compound, run_poses);
    for (std::size_t k = 1; k < steps.size(); ++k) poses[graph.edges[run.steps[k]].from] = run_poses[k];
  }
}

Eigen::MatrixXd expand_moves(const PoseGraph& graph, const ReducedGraph& reduced, std::span<const Pose3> about,
                             const Eigen::MatrixXd& reduced_moves) {
  const auto row = [](std::size_t node) { return static_cast<Eigen::Index>(6 * node); };
  Eigen::MatrixXd out(row(graph.poses.size()), reduced_moves.cols());
  for (std::size_t k = 0; k < reduced.nodes.size(); ++k)
    out.middleRows<6>(row(reduced.nodes[k])) = reduced_moves.middleRows<6>(row(k));
  std::vector<RelativePose> steps;
  for (const auto& run : reduced.runs) {
    steps.clear();
    for (const std::size_t e : run.steps) steps.push_back(step_of(graph.edges[e]));
    const PoseGraphEdge& compound = reduced.graph.edges[run.edge];
    const Eigen::MatrixXd inner = internal::spread_about(steps, poses_of(graph, run.steps, about),
                                                         reduced_moves.middleRows<6>(row(compound.from)),
                                                         reduced_moves.middleRows<6>(row(compound.to)));
    for (std::size_t k = 1; k < steps.size(); ++k)
      out.middleRows<6>(row(graph.edges[run.steps[k]].from)) = inner.middleRows<6>(row(k - 1));
  }
  return out;
}

}  // namespace tutti::estimation
