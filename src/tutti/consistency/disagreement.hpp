// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
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

struct DisagreementConfig {
  double false_alarm_rate = 0.01;
  std::string without = "nothing";

  template <class V>
  void describe(V& v) {
    v.field("false_alarm_rate", false_alarm_rate, between(1e-9, 0.5),
            "Chance that a robot which differs from the server's map only within the map's own uncertainty is told "
            "otherwise, once per mission.");
    v.field("without", without, one_of({"nothing", "coefficients", "directions"}),
            "Leaves out one of the two kinds of tests, to see what it is worth.");
  }
};

/// A difference between robot and server. Rows are the synchronised nodes in time order, columns the scales (0 =
/// largest). A significance is a size over its threshold: above 1 it stands out of the server's uncertainty.
struct Disagreement {
  Eigen::MatrixXd position_m;           ///< Length of the wavelet coefficient, eq. (8) on one graph for both.
  Eigen::MatrixXd rotation_rad;         ///< The same in rotation.
  Eigen::MatrixXd significance;         ///< The larger of the two; 0 at scales that are not tested.
  double direction_significance = 0.0;  ///< Of what closures know far better than odometry (KnownDirection).
  [[nodiscard]] double largest() const;
  [[nodiscard]] bool disagrees() const { return largest() > 1.0; }
};

/// Tests the hypothesis that a robot differs from the server's map only within the server's own uncertainty. What the
/// robot's nodes are off by, after one rigid alignment, is seen through the Meyer wavelets of the chain's own proximity
/// graph at the server's positions, as the server has seen draws of its own errors (ChainUncertainty), and along the
/// directions that closures know.
///
/// Half of the false-alarm rate is for single coefficients (chi, 3 degrees of freedom), which find what is local; half
/// for the directions (chi-square of all, and each alone), which find that a robot is not back where closures say it
/// is. Updates while the run doubles in length see much the same and count as one look: look k = 1, 2, ... has the
/// share 1 / (k (k + 1)) of the rate, which sums to 1 over a mission of any length. docs/math.md.
class DisagreementTest {
 public:
  /// `pairs`: the chain's synchronised nodes in time order, at least two. `update` counts from 1.
  DisagreementTest(const ProxyGraph& graph, const ChainId& chain, std::span<const NodePair> pairs, std::uint64_t update,
                   const DisagreementConfig& config);

  /// The server says how sure it is: otherwise nothing disagrees.
  [[nodiscard]] bool is_informed() const { return uncertainty_ != nullptr; }
  /// Poses of the synchronised nodes in any one frame.
  [[nodiscard]] Disagreement operator()(std::span<const Pose3> robot) const;
  /// Per synchronised node what the server's position of it is off by, all scales together, m; empty when it does not
  /// say.
  [[nodiscard]] const Eigen::VectorXd& sigma_m() const { return sigma_m_; }
  [[nodiscard]] int scales() const;
  /// What length of the map a scale speaks of, m: half of the wave through space that the graph calls as fast as the
  /// middle of the scale's band; of scale 0 the whole way.
  [[nodiscard]] double scale_length_m(int scale) const;

 private:
  /// From the coefficients of all nodes, n x (scales * 6).
  void measure_scales(const Eigen::MatrixXd& W, Disagreement& out) const;
  [[nodiscard]] double measure_directions(std::span<const Pose3> robot) const;

  std::vector<Pose3> server_;       ///< Of all nodes of the chain.
  std::vector<std::size_t> ranks_;  ///< Of the synchronised ones among them.
  const ChainUncertainty* uncertainty_;
  double look_;  ///< The false-alarm rate of this look.
  DisagreementConfig config_;
  spectral::SparseMatrix laplacian_;
  std::unique_ptr<spectral::WaveletFilter> filter_;
  Eigen::VectorXd sigma_m_;
};

/// Raw odometry at the synchronised nodes, from the identity on.
std::vector<Pose3> odometry_at(std::span<const RobotNode> nodes, std::span<const NodePair> pairs);

}  // namespace tutti::consistency
