// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/spectral/graph.hpp"

/// Graphs for tests and benches.
namespace tutti::spectral::testing {

inline SparseMatrix laplacian_of(int nodes, const std::vector<WeightedEdge>& edges) {
  return laplacian(adjacency_from_edges(nodes, edges));
}

inline SparseMatrix path(int nodes) {
  std::vector<WeightedEdge> edges;
  for (int n = 0; n + 1 < nodes; ++n) edges.push_back({n, n + 1, 1.0});
  return laplacian_of(nodes, edges);
}

inline SparseMatrix cycle(int nodes) {
  std::vector<WeightedEdge> edges;
  for (int n = 0; n < nodes; ++n) edges.push_back({n, (n + 1) % nodes, 1.0});
  return laplacian_of(nodes, edges);
}

inline SparseMatrix complete(int nodes) {
  std::vector<WeightedEdge> edges;
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < a; ++b) edges.push_back({a, b, 1.0});
  return laplacian_of(nodes, edges);
}

inline SparseMatrix star(int nodes) {
  std::vector<WeightedEdge> edges;
  for (int n = 1; n < nodes; ++n) edges.push_back({0, n, 1.0});
  return laplacian_of(nodes, edges);
}

/// Weights over four decades; `parts` groups without edges between them, some nodes perhaps without any edge.
inline std::vector<WeightedEdge> random_edges(int nodes, int parts, Rng& rng) {
  std::vector<WeightedEdge> edges;
  const double share = 4.0 * parts / std::max(nodes, 4);
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < a; ++b)
      if (a % parts == b % parts && rng.bernoulli(share))
        edges.push_back({a, b, std::pow(10.0, rng.uniform(-3.0, 1.0))});
  return edges;
}

inline std::vector<int> random_permutation(int nodes, Rng& rng) {
  std::vector<int> out(static_cast<std::size_t>(nodes));
  std::iota(out.begin(), out.end(), 0);
  for (std::size_t n = out.size(); n > 1; --n) std::swap(out[n - 1], out[rng.index(n)]);
  return out;
}

/// A robot's run through 60 m corridors joined by right angles, out and back on the same trajectory half a metre aside,
/// one node per metre: about 27 neighbours within 7 m. `drift` bends it as odometry does: 1 is some metres at the end.
inline std::vector<Eigen::Vector3d> tunnel(int nodes, double drift, Rng rng) {
  const int half = (nodes + 1) / 2;
  const auto corridor_yaw = [](int metre) {
    const int turns = (metre + 30) / 60;
    return std::numbers::pi / 2.0 * (turns % 4 == 1 || turns % 4 == 2 ? 1.0 : 0.0);  // staircase: never meets itself
  };
  std::vector<Eigen::Vector3d> out;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double yaw_error = 0.0;
  double sway = 0.0;
  for (int n = 0; n < nodes; ++n) {
    const bool back = n >= half;
    const double yaw = corridor_yaw(back ? nodes - 1 - n : n) + (back ? std::numbers::pi : 0.0) + yaw_error;
    const Eigen::Vector3d left(-std::sin(yaw), std::cos(yaw), 0.0);
    sway += -0.1 * sway + rng.normal(0.05);
    out.push_back(position + (0.25 + sway) * left);
    position += Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.002 * drift * rng.normal());
    yaw_error += drift * (2e-5 + 3e-4 * rng.normal());
  }
  return out;
}

/// A square that is crossed in lanes half a metre apart, one node per metre: about 95 neighbours within 4 m.
inline std::vector<Eigen::Vector3d> area(int nodes, Rng rng) {
  const int side = std::max(1, static_cast<int>(std::sqrt(nodes / 2.0)));
  std::vector<Eigen::Vector3d> out;
  for (int n = 0; n < nodes; ++n) {
    const int lane = n / side, at = n % side;
    out.emplace_back((lane % 2 != 0 ? side - 1 - at : at) + rng.normal(0.1), 0.5 * lane + rng.normal(0.1), 0.0);
  }
  return out;
}

/// Distance to the first node, the paper's signal.
inline Eigen::VectorXd distance_signal(const std::vector<Eigen::Vector3d>& positions) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(positions.size()));
  for (std::size_t n = 0; n < positions.size(); ++n)
    out[static_cast<Eigen::Index>(n)] = (positions[n] - positions[0]).norm();
  return out;
}

}  // namespace tutti::spectral::testing
