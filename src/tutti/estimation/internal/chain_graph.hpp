// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/internal/odometry_runs.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation::internal {

/// Positions in the chain of the reduced graph's nodes, increasing: the first pose and every constrained one.
std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints);

/// The constrained nodes of a chain, joined by runs and constraints.
struct ChainGraph {
  std::vector<std::size_t> nodes;
  PoseGraph graph;  ///< Node k is nodes[k], composed from raw odometry; edge k run k, then constraints.
  std::vector<Matrix6d> covariance;  ///< Of each edge that is no run.

  struct Incident {
    int node = 0;  ///< At the other end.
    int edge = 0;
    friend bool operator==(const Incident&, const Incident&) = default;
  };
  std::vector<int> incident_start{0};  ///< Per node, into `incident`.
  std::vector<Incident> incident;

  [[nodiscard]] std::size_t runs() const { return nodes.empty() ? 0 : nodes.size() - 1; }
  [[nodiscard]] std::span<const Incident> incident_to(std::size_t node) const {
    return std::span(incident).subspan(incident_start[node], incident_start[node + 1] - incident_start[node]);
  }
};

/// What a graph took over from the one before.
struct Carried {
  std::vector<int> node;           ///< Per node before: where it is now, -1 = gone.
  std::vector<char> changed;       ///< Per node now: it is new, or its neighbours are not those it had.
  std::vector<std::size_t> edges;  ///< Per edge now: the same one before, measurement and all; else kNew.

  static constexpr std::size_t kNew = -1;
  [[nodiscard]] bool same_pattern() const;
};

/// Fills `now` (whose memory is used again). Runs that are in `before` must be the same there.
Carried reduce(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
               std::span<const ChainConstraint> constraints, const Pose3& first, const ChainGraph& before,
               ChainGraph& now);

}  // namespace tutti::estimation::internal
