// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency::internal {

/// The error of raw odometry along the server's estimate, to first order in the error of a single step.
///
/// With the first nodes laid on each other, odometry puts node k at exp(E_k) T_k, T_k being the server's; E_k is the
/// sum of what the steps before are off by, each moved to one common frame.
class OdometryDrift {
 public:
  /// Poses as the server has them, and raw odometry k - 1 -> k (entry 0 unused), one per node.
  OdometryDrift(std::span<const Pose3> server, std::span<const RelativePose> odometry);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// [position m; rotation rad] by which odometry misses node b when it is laid on node a, in the server's axes.
  [[nodiscard]] Vector6d missed(std::size_t a, std::size_t b) const;
  /// Per node [position m; rotation rad] in the server's axes, n x 6, with these nodes (sorted, not empty) fixed where
  /// the server has them: of a node between two fixed ones, a < k < b, by the most likely error,
  ///   (E_k - E_a) - S_k S_b^-1 (E_b - E_a),   S the covariance of odometry summed from a in the common frame
  /// (the linear-Gaussian bridge, the onboard smoother's first step); of one beyond the last fixed one E_k - E_a.
  [[nodiscard]] Eigen::MatrixXd with_fixed(std::span<const std::size_t> nodes) const;

 private:
  struct Node {
    Eigen::Vector3d x;  // from the centroid of all nodes
    Vector6d E;
    Matrix6d step;  // covariance, in the common frame
  };
  [[nodiscard]] Vector6d at_node(std::size_t node, const Vector6d& motion) const;
  std::vector<Node> nodes_;
};

}  // namespace tutti::consistency::internal
