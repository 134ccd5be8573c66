// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

/// What is known of all poses at the optimum `poses`: errors (right tangent) with the covariance H^-1, H the joint
/// Gauss-Newton Hessian of all edges; the first node of each connected component does not move. Factorised once, when
/// made.
class JointPosterior {
 public:
  using Pair = std::pair<std::size_t, std::size_t>;
  /// `pairs`: those whose relative_covariances() will be asked for; each far pair adds fill. `weights` scales each
  /// edge's information (empty: all 1).
  JointPosterior(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const Pair> pairs = {},
                 std::span<const double> weights = {});
  ~JointPosterior();
  JointPosterior(const JointPosterior&) = delete;
  JointPosterior& operator=(const JointPosterior&) = delete;

  /// Covariances of relative poses T_a_b = T_a^-1 T_b (right tangent) of the pairs, in their order: the exact blocks of
  /// the inverse, computed only on the pattern of the sparse factor (Takahashi, Fagan, Chin 1973; blocked by
  /// supernodes). About the time of one factorisation. Pairs in different components, or in one that does not determine
  /// its poses: infinity on the diagonal. a == b: zero where determined.
  [[nodiscard]] std::vector<Matrix6d> relative_covariances() const;

  /// `count` joint samples of the nodes' errors: (6 nodes) x count, rows [6 k, 6 k + 6) what node k of `nodes` is off
  /// by. Zero mean, the covariance of the posterior, nearly normal: L^-T z, z sums of 64 random signs. A node's sample
  /// does not depend on which others are asked for. In a component that does not determine its poses: infinity.
  [[nodiscard]] Eigen::MatrixXd samples(std::span<const std::size_t> nodes, std::size_t count, Rng rng) const;

  /// Joint covariance of the nodes' errors, (6 nodes) x (6 nodes), exact; infinity on the diagonal of those in a
  /// component that does not determine its poses.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const std::size_t> nodes) const;

 private:
  struct Factorised;
  [[nodiscard]] std::vector<int> variables_of(std::span<const std::size_t> nodes) const;
  std::unique_ptr<const Factorised> factorised_;
};

}  // namespace tutti::estimation
