// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/time_chain.hpp"

#include <cmath>

#include "tutti/consistency/signal.hpp"

namespace tutti::consistency {

TimeChain time_chain(const ProxyGraph& graph, std::span<const RobotNode> nodes, std::span<const NodePair> pairs) {
  TimeChain out;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    out.server.push_back(graph.nodes[pairs[k].proxy].T_world_body);
    out.robot.push_back(nodes[pairs[k].robot].T_map_body);
    RelativePose step{.covariance = Matrix6d::Zero()};
    for (std::size_t n = k == 0 ? pairs[k].robot : pairs[k - 1].robot; n < pairs[k].robot; ++n)
      step = compound(step, nodes[n + 1].odometry);
    out.odometry.push_back(step);
  }
  return out;
}

double aligned_rmse(std::span<const Pose3> server, std::span<const Pose3> robot) {
  const Eigen::MatrixXd off = pose_difference(server, robot);
  return std::sqrt(off.leftCols<3>().squaredNorm() / static_cast<double>(server.size()));
}

}  // namespace tutti::consistency
