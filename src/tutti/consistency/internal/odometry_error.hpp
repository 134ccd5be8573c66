// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency::internal {

/// What raw odometry is off by along the server's estimate, to first order in what a single step is off by.
///
/// With the first nodes laid on each other, odometry puts node k at exp(E_k) T_k, T_k being the server's; E_k is the
/// sum of what the steps before are off by, each moved to one common frame, and C_k the sum of their covariances there.
/// When nodes a < b are held where the server has them, the most likely error of a node between them is
///   rho_k = (E_k - E_a) - (C_k - C_a) G,   G = (C_b - C_a)^-1 (E_b - E_a),
/// (the linear-Gaussian bridge, the onboard smoother's first step), and of a node beyond the last held one E_k - E_a.
/// How bad an error is: |position|^2 + (lever |rotation|)^2, m^2. Its sum over a stretch with the ends held where the
/// server has them comes from prefix sums in constant time.
class OdometryError {
 public:
  /// Poses as the server has them, and raw odometry k - 1 -> k (entry 0 unused), one per node. `lever_m` > 0: what a
  /// radian counts.
  OdometryError(std::span<const Pose3> server, std::span<const RelativePose> odometry, double lever_m);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Sum of squared errors, m^2, over the nodes in (a, b) with both held.
  [[nodiscard]] double bridged(std::size_t a, std::size_t b) const;
  /// The same over the nodes from first to last, first <= last, when of them all only `held` (one of the ends) is held.
  [[nodiscard]] double hanging(std::size_t held, std::size_t first, std::size_t last) const;
  struct Fit {
    std::vector<Vector6d> offsets;  ///< From the server's pose, one per held node.
    double squared_error = 0.0;     ///< m^2, over all nodes, the held ones twice.
  };
  /// Where to hold these nodes (sorted, not empty) so that all nodes together come as near as they can to where the
  /// server has them: linear least squares, block tridiagonal, in time proportional to the number of nodes.
  [[nodiscard]] Fit fit(std::span<const std::size_t> held) const;
  /// Per node [position m; rotation rad] in the axes of the server's frame, with these nodes held at these offsets
  /// (empty: exactly where the server has them).
  [[nodiscard]] Eigen::MatrixXd residual(std::span<const std::size_t> held, std::span<const Vector6d> offsets) const;
  /// An offset of a node as [position m; rotation rad] in the server's axes.
  [[nodiscard]] Vector6d at_node(std::size_t node, const Vector6d& offset) const;
  /// [position; rotation] by which odometry misses node b when it is laid on node a, in the server's axes, and the
  /// covariance of that according to the odometry.
  [[nodiscard]] Vector6d missed(std::size_t a, std::size_t b) const;
  [[nodiscard]] Matrix6d missed_covariance(std::size_t a, std::size_t b) const;

 private:
  /// Sums over nodes 0 .. k, M = J^T J + lever^2 diag(0, 1), J = [1, -[x]x]: an error E moves node k by J E.
  struct Sums {
    double EME = 0.0;
    Vector6d ME = Vector6d::Zero(), CME = Vector6d::Zero();
    Matrix6d M = Matrix6d::Zero(), CM = Matrix6d::Zero(), CMC = Matrix6d::Zero();
  };
  struct Node {
    Eigen::Vector3d x;  // from the centroid of all nodes
    Vector6d E = Vector6d::Zero();
    Matrix6d C = Matrix6d::Zero();
    Sums sums;
  };
  /// Shorter runs are summed node by node: differences of prefix sums lose as many digits twice over as the covariance
  /// up to here exceeds that of the run.
  static constexpr std::size_t kNodeByNode = 64;
  [[nodiscard]] Matrix6d metric_of(std::size_t k) const;  ///< M of Sums.
  [[nodiscard]] Sums sums_over(std::size_t first, std::size_t last) const;
  /// A stretch's squared error as a function of its ends' offsets:
  /// constant - 2 (right_a . a + right_b . b) + a . aa a + 2 a . ab b + b . bb b.
  struct Quadratic {
    double constant = 0.0;
    Vector6d right_a = Vector6d::Zero(), right_b = Vector6d::Zero();
    Matrix6d aa = Matrix6d::Zero(), ab = Matrix6d::Zero(), bb = Matrix6d::Zero();
  };
  [[nodiscard]] Quadratic between(std::size_t a, std::size_t b) const;  // nodes in (a, b]
  std::vector<Node> nodes_;
  double lever_m_;
};

}  // namespace tutti::consistency::internal
