// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/consistency/internal/odometry_drift.hpp"
#include "tutti/consistency/internal/policies.hpp"
#include "tutti/consistency/links.hpp"
#include "tutti/consistency/time_chain.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::internal {
namespace {

using Joints = std::vector<std::size_t>;

/// Where nodes displaced by [position m; rotation rad] in the server's axes lie.
std::vector<Pose3> displaced(std::span<const Pose3> server, const Eigen::MatrixXd& by) {
  std::vector<Pose3> out;
  for (std::size_t k = 0; k < server.size(); ++k) {
    const Vector6d off = by.row(static_cast<Eigen::Index>(k)).transpose();
    out.push_back({so3_exp(off.tail<3>()) * server[k].rotation, server[k].translation + off.head<3>()});
  }
  return out;
}

/// Splits every run between two joints at the node with the largest value above 1. False: none.
bool split(Joints& joints, const Eigen::VectorXd& value) {
  const std::size_t before = joints.size();
  Joints added;
  for (std::size_t j = 1; j < joints.size(); ++j) {
    const std::size_t inner = joints[j] - joints[j - 1] - 1;
    if (inner == 0) continue;
    Eigen::Index at = 0;
    const auto first = static_cast<Eigen::Index>(joints[j - 1]) + 1;
    if (value.segment(first, static_cast<Eigen::Index>(inner)).maxCoeff(&at) > 1.0)
      added.push_back(static_cast<std::size_t>(first + at));
  }
  joints.insert(joints.end(), added.begin(), added.end());
  std::ranges::sort(joints);
  return joints.size() > before;
}

}  // namespace

Selection AdaptivePolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.pairs.size();
  if (nodes < 2 || input.test == nullptr || !input.test->is_informed()) return std::move(collector).take();
  TUTTI_CHECK(input.odometry_disagreement != nullptr, "a test without what it says");
  const bool corrects = input.ledger.size() > 0;
  if (input.odometry_disagreement->largest() <= (corrects ? kRelease : 1.0)) return std::move(collector).take();

  const TimeChain chain = time_chain(input.graph, input.nodes, input.pairs);
  const OdometryDrift drift(chain.server, chain.odometry);
  const Eigen::VectorXd allowed = (config_.adaptive_error_share * input.test->sigma_m()).cwiseMax(kLeastError_m);
  Joints joints{0, nodes - 1};
  Eigen::MatrixXd rest = drift.with_fixed(joints);
  const auto split_at = [&](const Eigen::VectorXd& value) {
    if (!split(joints, value)) return false;
    rest = drift.with_fixed(joints);
    return true;
  };
  const auto error = [&]() -> Eigen::VectorXd { return rest.leftCols<3>().rowwise().norm().cwiseQuotient(allowed); };
  for (bool again = true; again;) {
    while (split_at(error())) {
    }
    const Disagreement left = (*input.test)(displaced(chain.server, rest));
    again = left.disagrees() && left.significance.size() > 0 && split_at(left.significance.rowwise().maxCoeff());
  }
  for (std::size_t j = 1; j < joints.size(); ++j) collector.add({joints[j - 1], joints[j]}, ConstraintKind::other);
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
