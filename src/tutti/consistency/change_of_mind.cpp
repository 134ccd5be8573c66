// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/change_of_mind.hpp"

#include <algorithm>
#include <vector>

#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/signal.hpp"

namespace tutti::consistency {
namespace {

/// Three standard deviations, on both sides. The first comparison of a DisagreementTest has half of the rate.
constexpr double kThreeSigma = 0.0027;

}  // namespace

MapChange map_change(const ProxyGraph& older, const ProxyGraph& newer, const ChainId& chain) {
  MapChange out;
  std::vector<RobotNode> nodes;
  for (const ProxyNode& node : nodes_of(newer, chain))
    nodes.push_back({.stamp = node.stamp, .T_map_body = node.T_world_body, .odometry = {}});
  const std::vector<NodePair> pairs = synchronise(older, chain, nodes).pairs;
  if (pairs.size() < 2 || uncertainty_of(older, chain) == nullptr) return out;
  std::vector<Pose3> before, after;
  for (const NodePair& pair : pairs) {
    before.push_back(older.nodes[pair.proxy].T_world_body);
    after.push_back(nodes[pair.robot].T_map_body);
  }
  const DisagreementTest test(older, chain, pairs, {.false_alarm_rate = kThreeSigma});
  out.significance = test(after).largest();

  const Eigen::MatrixXd moved = pose_difference(before, after);
  const Eigen::VectorXd metres = moved.leftCols<3>().rowwise().norm(), radians = moved.rightCols<3>().rowwise().norm();
  out.translation_m = metres.maxCoeff();
  out.rotation_rad = radians.maxCoeff();
  std::vector<Timestamp> far;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (metres(static_cast<Eigen::Index>(k)) >= 0.5 * out.translation_m) far.push_back(nodes[pairs[k].robot].stamp);
  out.from = far.front();
  out.until = far.back();
  return out;
}

}  // namespace tutti::consistency
