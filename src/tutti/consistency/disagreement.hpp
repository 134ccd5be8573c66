// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::consistency {

/// Settings of the test of whether robot and map differ.
struct DisagreementConfig {
  double false_alarm_rate = 0.01;
  std::string without = "nothing";

  /// For one comparison of a mission, with so many synchronised nodes: its share of the mission's false alarms.
  /// Comparisons while a run doubles in length see much the same, however often the map changes meanwhile, and count as
  /// one: doubling k = 1, 2, ... has the share 1 / (k (k + 1)), which sums to 1 over a run of any length. It follows
  /// from the nodes alone, so that whoever compares the same two finds the same (docs/math.md).
  [[nodiscard]] DisagreementConfig for_run_of(std::size_t nodes) const;

  template <class V>
  void describe(V& v) {
    v.field("false_alarm_rate", false_alarm_rate, between(1e-9, 0.5),
            "Chance that a robot which differs from the server's map only within the map's own uncertainty is told "
            "otherwise, once per mission.");
    v.field("without", without, one_of({"nothing", "coefficients", "directions"}),
            "Leaves out one of the two kinds of tests, to see what it is worth.");
  }
};

/// The difference between robot and server. Rows are the synchronised nodes in time order, columns the scales (0 =
/// largest). A significance is a size divided by its threshold: above 1 it exceeds what the server's uncertainty
/// explains.
struct Disagreement {
  /// Length of the wavelet coefficient of the position error; eq. (8) with one graph for both sides.
  Eigen::MatrixXd position_m;
  Eigen::MatrixXd rotation_rad;  ///< Length of that of the rotation error.
  Eigen::MatrixXd significance;  ///< The larger significance of position and rotation; 0 at scales that are not tested.
  double direction_significance = 0.0;  ///< Significance along the directions of KnownDirection.
  [[nodiscard]] double largest() const;
  [[nodiscard]] bool disagrees() const { return largest() > 1.0; }
};

/// Tests the hypothesis that a robot differs from the server's map only within the server's own uncertainty. The
/// robot's errors, after one rigid alignment, are seen through the Meyer wavelets of the chain's own proximity graph at
/// the server's positions, just as the server has seen draws of its own errors (ChainUncertainty), and
/// along the directions that closures determine.
///
/// Half of the false-alarm rate is for single coefficients (chi distribution, 3 degrees of freedom), which detect local
/// differences. The other half is for the directions (chi-square of all, and each one alone), which detect that a robot
/// has not returned to where closures say it has.
class DisagreementTest {
 public:
  /// `pairs` are the chain's synchronised nodes in time order, at least two. The rate of `config` is of this one test.
  /// Keeps a pointer into `graph`, which must outlive the test.
  DisagreementTest(const ProxyGraph& graph, const ChainId& chain, std::span<const NodePair> pairs,
                   const DisagreementConfig& config);

  /// The server has sent the uncertainty of this chain. Otherwise nothing disagrees.
  [[nodiscard]] bool is_informed() const { return uncertainty_ != nullptr; }
  /// Tests a robot's poses at the synchronised nodes, given in any one frame.
  [[nodiscard]] Disagreement operator()(std::span<const Pose3> robot) const;
  /// Standard deviation of the server's position of each synchronised node, over all scales, m; empty when the server
  /// does not send it.
  [[nodiscard]] const Eigen::VectorXd& sigma_m() const { return sigma_m_; }
  [[nodiscard]] int scales() const;
  /// The distance along the trajectory that a scale stands for, m: half of the wave whose frequency on the graph is the
  /// middle of the scale's band. For scale 0, the length of the whole trajectory.
  [[nodiscard]] double scale_length_m(int scale) const;

 private:
  /// Fills in the scales from the wavelet coefficients of all nodes, n x (6 scales).
  void measure_scales(const Eigen::MatrixXd& W, Disagreement& out) const;
  [[nodiscard]] double measure_directions(std::span<const Pose3> robot) const;

  std::vector<Pose3> server_;       ///< All nodes of the chain.
  std::vector<std::size_t> ranks_;  ///< Positions of the synchronised nodes in server_.
  const ChainUncertainty* uncertainty_;
  DisagreementConfig config_;
  spectral::SparseMatrix laplacian_;
  std::unique_ptr<spectral::WaveletFilter> filter_;
  Eigen::VectorXd sigma_m_;
};

/// Poses of the synchronised nodes by raw odometry, starting from the identity.
std::vector<Pose3> odometry_at(std::span<const RobotNode> nodes, std::span<const NodePair> pairs);

}  // namespace tutti::consistency
