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

/// A stretch of a robot's run over which its odometry parts from the server's map by more than both allow for.
struct SuspectedOrigin {
  Timestamp from;
  Timestamp until;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();  ///< Of the middle of the stretch, by the server: `world`.
  int scale = 0;               ///< Of Explanation::significance: where the disagreement stands out most.
  double length_m = 0.0;       ///< Of the stretch, along the server's estimate.
  double translation_m = 0.0;  ///< Odometry against the map over the stretch: relative pose from -> until.
  double rotation_rad = 0.0;
  double significance = 0.0;  ///< Over its threshold; >= 1.
  /// More than the odometry itself allows for (its covariance): localisation failed, or the map is wrong there.
  bool alert = false;
};

/// Where, at which scale and since when a robot's estimate and the server's map differ. Rows are the synchronised
/// nodes in time order, columns the scales (0 = largest).
struct Explanation {
  std::vector<Timestamp> stamps;
  std::vector<double> distance_m;  ///< Along the server's estimate, 0 at the first node.
  std::vector<double>
      scale_length_m;          ///< What length of the way each scale speaks of, from the smallest wave it holds.
  Eigen::MatrixXd position_m;  ///< Disagreement, nodes x scales.
  Eigen::MatrixXd rotation_rad;
  Eigen::MatrixXd significance;  ///< Disagreement over its threshold, the larger of position and rotation; 1 = at it.
  double direction_significance = 0.0;   ///< The same for what closures know far better than odometry.
  double aligned_rmse_m = 0.0;           ///< Of the two estimates after one rigid alignment.
  double expected_rmse_m = 0.0;          ///< What the server says its own error is; 0 = it does not say.
  std::vector<SuspectedOrigin> origins;  ///< In time order, none overlapping.
  /// Something stands out of the server's uncertainty: the two do not agree.
  [[nodiscard]] bool disagrees() const {
    return direction_significance > 1.0 || (significance.size() > 0 && significance.maxCoeff() > 1.0);
  }
};

/// What `test` said of raw odometry (odometry_at()), `found`, put into words, and where the difference was born: looked
/// for at that false-alarm rate. `pairs`: those of the test.
Explanation explain(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                    std::span<const NodePair> pairs, const DisagreementTest& test, Disagreement found,
                    double false_alarm_rate);

}  // namespace tutti::consistency
