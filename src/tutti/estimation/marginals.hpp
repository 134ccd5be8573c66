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

/// The joint posterior of all poses at the optimum `poses`: errors (right tangent) with the covariance H^-1, where H is
/// the Gauss-Newton Hessian of all edges and the first node of each connected component does not move. The constructor
/// factorises H; const calls use the factor.
class JointPosterior {
 public:
  using Pair = std::pair<std::size_t, std::size_t>;
  /// `pairs`: node pairs that relative_covariances() is to return; each pair of far nodes adds fill-in to the factor.
  /// `weights`: per edge a factor on its information; empty: all 1.
  JointPosterior(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const Pair> pairs = {},
                 std::span<const double> weights = {});
  ~JointPosterior();
  JointPosterior(const JointPosterior&) = delete;
  JointPosterior& operator=(const JointPosterior&) = delete;

  /// Covariances of relative poses T_a_b = T_a^-1 T_b (right tangent) of the pairs, in their order: the exact blocks of
  /// the inverse, computed only on the pattern of the sparse factor (Takahashi, Fagan, Chin 1973; blocked by
  /// supernodes). About the time of one factorisation. Pairs in different components, or in one that does not determine
  /// its poses: infinity on the diagonal. A pair of a node with itself: zero, where its component is determined.
  [[nodiscard]] std::vector<Matrix6d> relative_covariances() const;

  /// `count` joint samples of the errors of `nodes`: a (6 nodes.size()) x count matrix whose rows [6 k, 6 k + 6) are
  /// the error of nodes[k]. The samples have zero mean and the covariance of the posterior and are nearly normal: L^-T
  /// z, z being sums of 64 random signs. A node's samples do not depend on which other nodes are asked for. Infinity
  /// for nodes of a component that does not determine its poses.
  [[nodiscard]] Eigen::MatrixXd samples(std::span<const std::size_t> nodes, std::size_t count, Rng rng) const;

  /// Joint covariance of the errors of `nodes`, a square matrix of 6 nodes.size() rows, exact; infinity on the diagonal
  /// for nodes of a component that does not determine its poses.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const std::size_t> nodes) const;

 private:
  struct Factorised;
  [[nodiscard]] std::vector<int> variables_of(std::span<const std::size_t> nodes) const;
  std::unique_ptr<const Factorised> factorised_;
};

}  // namespace tutti::estimation
