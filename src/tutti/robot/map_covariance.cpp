// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/map_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "tutti/consistency/chain_uncertainty.hpp"

namespace tutti::robot {
namespace {

double square(double x) { return x * x; }

/// Variances in the worst direction.
struct Variances {
  double position_m2 = 0.0, rotation_rad2 = 0.0;
};

/// One node against the whole chain: the map's covariance of all scales together, and never less than the chain's mean.
Variances at_node(const ChainUncertainty& known, std::size_t node) {
  Variances out;
  for (const ScaleUncertainty& scale : known.scales) {
    if (scale.sigma.empty()) continue;
    const PoseSigma& sigma = scale.sigma[std::min(node / ChainUncertainty::kBlock, scale.sigma.size() - 1)];
    out.position_m2 += square(sigma.position_m);
    out.rotation_rad2 += square(sigma.rotation_rad);
  }
  out.position_m2 = std::max(out.position_m2, square(known.whole.position_m) / 3.0);
  out.rotation_rad2 = std::max(out.rotation_rad2, square(known.whole.rotation_rad) / 3.0);
  return out;
}

/// Steps between neighbours as if they were independent: too large where closures tie distant nodes together.
Matrix6d step_by_step(std::span<const ProxyNode> nodes, std::size_t from, std::size_t to) {
  Matrix6d out = Matrix6d::Zero();
  for (std::size_t n = from + 1; n <= to; ++n)
    out = compound_covariance(nodes[n - 1].T_world_body.inverse() * nodes[n].T_world_body, out, nodes[n].covariance);
  return out;
}

/// Both ends against the whole chain, which may err in opposite ways, and the distance between them a lever of the
/// first one's rotation.
Matrix6d end_to_end(const ChainUncertainty& known, std::span<const ProxyNode> nodes, std::size_t from, std::size_t to) {
  const Variances a = at_node(known, from), b = at_node(known, to);
  const double lever_m2 = (nodes[to].T_world_body.translation - nodes[from].T_world_body.translation).squaredNorm();
  const double position_m = std::sqrt(a.position_m2) + std::sqrt(b.position_m2);
  const double rotation_rad = std::sqrt(a.rotation_rad2) + std::sqrt(b.rotation_rad2);
  Vector6d out;
  out << Eigen::Vector3d::Constant(square(position_m) + a.rotation_rad2 * lever_m2),
      Eigen::Vector3d::Constant(square(rotation_rad));
  return out.asDiagonal();
}

/// The map's covariance of T_from^-1 T_to: the smaller of two bounds.
Matrix6d by_map(const ProxyGraph& graph, const ChainId& chain, Timestamp from_stamp, Timestamp to_stamp) {
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  if (nodes.empty()) return Matrix6d::Zero();
  // A node that the reduction removed lies between two that it kept.
  const auto at_or_after = [&](Timestamp stamp) {
    const auto found = std::ranges::lower_bound(nodes, stamp, {}, &ProxyNode::stamp);
    return static_cast<std::size_t>(std::min(found, nodes.end() - 1) - nodes.begin());
  };
  std::size_t from = at_or_after(from_stamp);
  if (from > 0 && nodes[from].stamp > from_stamp) --from;
  const std::size_t to = std::max(from, at_or_after(to_stamp));
  Matrix6d out = step_by_step(nodes, from, to);
  if (const ChainUncertainty* known = uncertainty_of(graph, chain); known != nullptr && to > from) {
    const Matrix6d other = end_to_end(*known, nodes, from, to);
    if (other.topLeftCorner<3, 3>().trace() < out.topLeftCorner<3, 3>().trace()) out = other;
    // The robot follows the map without what is doubted; it may be right all the same.
    const ProxyGraph followed = consistency::without_doubted(graph, chain);
    const auto relative = [&](std::span<const ProxyNode> of) {
      return of[from].T_world_body.inverse() * of[to].T_world_body;
    };
    const Vector6d doubt = local(relative(nodes_of(followed, chain)), relative(nodes));
    out += doubt * doubt.transpose();
  }
  return out;
}

}  // namespace

Matrix6d map_covariance(const ProxyGraph& graph, const ChainId& chain, std::span<const Timestamp> stamps,
                        const consistency::Ledger& ledger, const estimation::SmootherState& smoother) {
  std::vector<bool> spanned(smoother.poses.size(), false);  // by a link: the step that ends at each node
  std::size_t first = smoother.poses.size(), last = 0;
  for (const consistency::Constraint& link : ledger.constraints()) {
    const auto [from, to] = std::minmax(link.from, link.to);
    std::fill(spanned.begin() + static_cast<std::ptrdiff_t>(from) + 1,
              spanned.begin() + static_cast<std::ptrdiff_t>(to) + 1, true);
    first = std::min(first, from);
    last = std::max(last, to);
  }
  Matrix6d out = Matrix6d::Zero();
  Pose3 before = smoother.poses.front();
  for (std::size_t k = 1; k < smoother.poses.size(); ++k) {
    const Pose3 pose = smoother.poses[k], step = std::exchange(before, pose).inverse() * pose;
    out = compound_covariance(step, out, spanned[k] ? Matrix6d(Matrix6d::Zero()) : smoother.odometry[k - 1].covariance);
    if (k == last) out += by_map(graph, chain, stamps[first], stamps[last]);
  }
  return 0.5 * (out + out.transpose());
}

}  // namespace tutti::robot
