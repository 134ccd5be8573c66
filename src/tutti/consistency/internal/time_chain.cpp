// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/time_chain.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/consistency/signal.hpp"

namespace tutti::consistency::internal {

TimeChain time_chain(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                     std::span<const NodePair> pairs) {
  TimeChain out;
  if (pairs.empty()) return out;
  const auto first = std::ranges::find(graph.nodes, chain, &ProxyNode::chain) - graph.nodes.begin();
  const Pose3 T_start_world = graph.nodes[pairs.front().proxy].T_world_body.inverse();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    out.server.push_back(T_start_world * graph.nodes[pairs[k].proxy].T_world_body);
    out.robot.push_back(nodes[pairs[k].robot].T_map_body);
    out.ranks.push_back(pairs[k].proxy - static_cast<std::size_t>(first));
    RelativePose step{.covariance = Matrix6d::Zero()};
    for (std::size_t n = k == 0 ? pairs[k].robot : pairs[k - 1].robot; n < pairs[k].robot; ++n)
      step = compound(step, nodes[n + 1].odometry);
    out.odometry.push_back(step);
  }
  return out;
}

double aligned_rmse(std::span<const Pose3> server, std::span<const Pose3> robot) {
  const Eigen::MatrixXd off = PoseSignal().difference(server, robot);
  return std::sqrt(off.leftCols<3>().squaredNorm() / static_cast<double>(server.size()));
}

const ShapeUncertainty* shape_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto found = std::ranges::find(graph.shapes, chain, &ShapeUncertainty::chain);
  return found == graph.shapes.end() ? nullptr : &*found;
}

}  // namespace tutti::consistency::internal
