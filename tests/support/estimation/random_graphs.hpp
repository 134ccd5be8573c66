// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/model/pose_graph.hpp"

/// Small pose graphs with known truth for the tests of this module.
namespace tutti::estimation::testing {

inline Vector6d random_tangent(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d xi;
  for (int k = 0; k < 3; ++k) {
    xi[k] = rng.normal(sigma_m);
    xi[3 + k] = rng.normal(sigma_rad);
  }
  return xi;
}

inline Pose3 random_pose(Rng& rng, double size_m = 5.0, double angle_rad = 1.0) {
  return retract({}, random_tangent(rng, size_m, angle_rad));
}

/// Full (correlated) covariance with about the given sigmas.
inline Matrix6d random_covariance(Rng& rng, double sigma_m, double sigma_rad) {
  Matrix6d root;
  for (int k = 0; k < 6; ++k) root.col(k) = random_tangent(rng, sigma_m, sigma_rad);
  return 0.2 * root * root.transpose() + diagonal_covariance(sigma_m, sigma_rad);
}

/// Noise drawn from a covariance.
inline Vector6d sample(Rng& rng, const Matrix6d& covariance) {
  return covariance.llt().matrixL() * random_tangent(rng, 1.0, 1.0);
}

struct RandomGraph {
  std::vector<Pose3> truth;
  PoseGraph graph;  ///< poses = truth
  std::vector<Matrix6d> covariances;
};

/// A wandering chain of `nodes` with `loops` extra edges, measured with noise times `noise`.
inline RandomGraph random_graph(Rng& rng, std::size_t nodes, std::size_t loops, double noise, double sigma_m = 0.05,
                                double sigma_rad = 0.02) {
  RandomGraph out;
  for (std::size_t k = 0; k < nodes; ++k)
    out.truth.push_back(k == 0 ? random_pose(rng) : out.truth.back() * random_pose(rng, 0.5, 0.3));
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t k = 0; k + 1 < nodes; ++k) pairs.emplace_back(k, k + 1);
  while (pairs.size() < nodes - 1 + loops) {
    const auto a = static_cast<std::size_t>(rng.index(nodes));
    const auto b = static_cast<std::size_t>(rng.index(nodes));
    if (a != b) pairs.emplace_back(a, b);
  }
  for (const auto& [a, b] : pairs) {
    const Matrix6d covariance = random_covariance(rng, sigma_m, sigma_rad);
    const Pose3 exact = out.truth[a].inverse() * out.truth[b];
    out.graph.edges.push_back({a, b, retract(exact, noise * sample(rng, covariance)), inverse_of(covariance)});
    out.covariances.push_back(covariance);
  }
  out.graph.poses = out.truth;
  return out;
}

inline double largest_position_difference(const std::vector<Pose3>& a, const std::vector<Pose3>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, (a[k].translation - b[k].translation).norm());
  return largest;
}

inline double largest_rotation_difference(const std::vector<Pose3>& a, const std::vector<Pose3>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, rotation_angle(a[k].inverse() * b[k]));
  return largest;
}

inline std::vector<Matrix6d> relative_covariances(const PoseGraph& graph, std::span<const Pose3> poses,
                                                  std::span<const std::pair<std::size_t, std::size_t>> pairs,
                                                  std::span<const double> weights = {}) {
  return JointPosterior(graph, poses, pairs, weights).relative_covariances();
}

}  // namespace tutti::estimation::testing
