// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// A segment of a robot's run over which its odometry leaves the server's map by more than both allow for.
struct SuspectedOrigin {
  Timestamp from;
  Timestamp until;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();  ///< Middle of the segment in the server's estimate, in `world`.
  int scale = 0;                                      ///< The scale whose length is nearest to the segment's.
  double length_m = 0.0;                              ///< Length of the segment along the server's estimate.
  double translation_m = 0.0;  ///< Odometry against the map: difference of the relative poses from -> until.
  double rotation_rad = 0.0;
  double significance = 0.0;  ///< The difference over its threshold; at least 1.
  /// The difference also exceeds what the odometry's own covariance allows for: localisation failed, or the map is
  /// wrong there.
  bool alert = false;
  template <class V>
  void describe(V& v) {
    v.field(1, "from", from);
    v.field(2, "until", until);
    v.field(3, "place_m", place_m);
    v.field(4, "scale", scale);
    v.field(5, "length_m", length_m);
    v.field(6, "translation_m", translation_m);
    v.field(7, "rotation_rad", rotation_rad);
    v.field(8, "significance", significance);
    v.field(9, "alert", alert);
  }
};

/// Where, at which scale and since when a robot's raw odometry and the server's map differ. Rows are the synchronised
/// nodes in time order, columns the scales (0 = largest).
struct Explanation {
  std::vector<Timestamp> stamps;
  std::vector<double> distance_m;  ///< Along the server's estimate, 0 at the first node.
  /// The length that each scale stands for (DisagreementTest::scale_length_m()).
  std::vector<double> scale_length_m;
  Eigen::MatrixXd position_m;  ///< Disagreement, nodes x scales.
  Eigen::MatrixXd rotation_rad;
  Eigen::MatrixXd significance;          ///< Disagreement over its threshold, the larger of position and rotation.
  double direction_significance = 0.0;   ///< The same along the directions that closures determine.
  double aligned_rmse_m = 0.0;           ///< Between the two estimates, after one rigid alignment.
  double expected_rmse_m = 0.0;          ///< The error that the server expects of itself; 0 when unknown.
  std::vector<SuspectedOrigin> origins;  ///< In time order, none overlapping.
  /// Some difference exceeds what the server's uncertainty explains.
  [[nodiscard]] bool disagrees() const {
    return direction_significance > 1.0 || (significance.size() > 0 && significance.maxCoeff() > 1.0);
  }
};

/// Explains `found`, the result of `test` on raw odometry (odometry_at()), and finds the segments where the difference
/// arose, with the given false-alarm rate. `pairs` are those of the test. There are no origins when `found` does not
/// disagree.
Explanation explain(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                    std::span<const NodePair> pairs, const DisagreementTest& test, Disagreement found,
                    double false_alarm_rate);

}  // namespace tutti::consistency
