// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>

#include "tutti/consistency/internal/joints.hpp"
#include "tutti/consistency/internal/links.hpp"
#include "tutti/consistency/internal/odometry_error.hpp"
#include "tutti/consistency/internal/policies.hpp"
#include "tutti/consistency/internal/time_chain.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::internal {
namespace {

using Joints = std::vector<std::size_t>;

/// Moved by [position m; rotation rad] in the axes of the frame it is seen from.
Pose3 displaced(const Pose3& T, const Vector6d& by) {
  return {so3_exp(by.tail<3>()) * T.rotation, T.translation + by.head<3>()};
}

/// Where odometry bent to these joints will lie, to first order.
std::vector<Pose3> predicted(const TimeChain& chain, const JointPlan& plan) {
  std::vector<Pose3> out;
  for (std::size_t k = 0; k < chain.server.size(); ++k)
    out.push_back(displaced(chain.server[k], plan.residual.row(static_cast<Eigen::Index>(k)).transpose()));
  return out;
}

/// The joints of the links held, if these are a chain from one synchronised node to a later one.
std::optional<Joints> held_joints(const PolicyInput& input) {
  Joints joints;
  for (const Constraint& held : input.ledger.constraints()) {
    const auto a = node_at(input, held.from_stamp), b = node_at(input, held.to_stamp);
    if (!a || !b || (!joints.empty() && joints.back() != *a)) return std::nullopt;
    if (joints.empty()) joints.push_back(*a);
    joints.push_back(*b);
  }
  if (joints.empty()) return std::nullopt;
  return joints;
}

/// Splits the run in which the node lies where that leaves the least error; false: it cannot be split there.
bool split_run(const OdometryError& error, Joints& joints, std::size_t node) {
  const auto above = std::ranges::upper_bound(joints, node);
  const std::size_t low = above == joints.begin() ? 0 : *(above - 1);
  const std::size_t high = above == joints.end() ? error.size() - 1 : *above;
  std::optional<std::size_t> best;
  double least = 0.0;
  for (std::size_t k = low; k <= high; ++k) {
    if (std::ranges::binary_search(joints, k)) continue;
    const double left = above == joints.begin() ? error.hanging(k, low, k) : error.bridged(low, k);
    const double right = above == joints.end() ? error.hanging(k, k, high) : error.bridged(k, high);
    if (!best || left + right < least) {
      best = k;
      least = left + right;
    }
  }
  if (best) joints.insert(above, *best);
  return best.has_value();
}

/// What is left in position, m^2 summed over the nodes: what links are paid for.
double position_error(const JointPlan& plan) { return plan.residual.leftCols<3>().squaredNorm(); }

/// As many equally long links as pay.
JointPlan uniform_plan(const OdometryError& error, std::size_t most, double least_gain) {
  JointPlan best = fit_joints(error, {0});
  for (std::size_t links = 1; links <= most; ++links) {
    Joints joints;
    for (std::size_t i = 0; i <= links; ++i) joints.push_back(i * (error.size() - 1) / links);
    JointPlan plan = fit_joints(error, std::move(joints));
    const auto paid = static_cast<double>(links + 1 - best.joints.size()) * least_gain;
    if (position_error(plan) + paid < position_error(best)) best = std::move(plan);
    if (static_cast<double>(links + 1 - best.joints.size()) * least_gain > position_error(best)) break;
  }
  return best;
}

/// The RMSE that the server expects of its own map where it knows it well: from the sag that a quarter of the stretches
/// of each length stay below, so that one stretch it knows little of (odometry that failed there) does not loosen the
/// demands on all others. Sags of all lengths add up like the hats of a hierarchical basis, whose squares average 1/3;
/// times 1.2 for directions other than the worst, this is the RMSE of the whole on even maps (0.63 to 0.69 with the
/// median, tunnel and terrace).
double typical_rmse(const ShapeUncertainty& shape) {
  constexpr std::size_t kEnough = 4;
  constexpr double kShare = 0.4;
  double variance = 0.0;
  for (std::vector<ShapeSigma> stretches : shape.sag) {
    if (stretches.size() < kEnough) continue;
    const auto quarter = stretches.begin() + static_cast<std::ptrdiff_t>(stretches.size() / 4);
    std::ranges::nth_element(stretches, quarter, {}, &ShapeSigma::position_m);
    variance += kShare * quarter->position_m * quarter->position_m;
  }
  return variance > 0.0 ? std::min(shape.whole.position_m, std::sqrt(variance)) : shape.whole.position_m;
}

}  // namespace

bool AdaptivePolicy::disagree(const ChainAgreement& test, const TimeChain& chain, double expected_rmse_m) const {
  if (config_.adaptive.detection == "always") return true;
  if (config_.adaptive.detection == "rmse")
    return aligned_rmse(chain.server, chain.robot) > kRmseFactor * expected_rmse_m;
  return test.compare(chain.server, chain.robot).disagrees();
}

JointPlan AdaptivePolicy::plan(const TimeChain& chain, const OdometryError& fitting, const ChainAgreement& test,
                               std::size_t most, double least_gain) const {
  if (config_.adaptive.placement == "uniform") return uniform_plan(fitting, most, least_gain);
  const OdometryError placing(chain.server, chain.odometry, kPlacingLever_m);
  JointPlan plan = fit_joints(fitting, place_joints(placing, most, least_gain));
  if (config_.adaptive.detection != "agreement") return plan;
  // The sum of squares says little of what is large in one place or at one scale only; the wavelets do.
  while (plan.joints.size() <= most) {
    Eigen::Index node = 0, scale = 0;
    const auto left = test.compare(chain.server, predicted(chain, plan));
    if (left.significance.maxCoeff(&node, &scale) <= 1.0) break;
    if (!split_run(placing, plan.joints, static_cast<std::size_t>(node))) break;
    plan = fit_joints(fitting, std::move(plan.joints));
  }
  return plan;
}

Selection AdaptivePolicy::choose(const PolicyInput& input) const {
  ConstraintConfig constraint = config_.constraint;
  constraint.trust = config_.adaptive.trust;
  LinkCollector collector(input, constraint, true);
  const TimeChain chain = time_chain(input.graph, input.chain, input.nodes, input.comparison.pairs);
  const std::size_t nodes = chain.server.size();
  if (nodes < 2) return std::move(collector).take();
  const ShapeUncertainty* shape = shape_of(input.graph, input.chain);
  const bool stated = shape != nullptr && config_.adaptive.agreement.thresholds == "server";
  const double expected = stated ? std::max(typical_rmse(*shape), kLeastRmse_m) : config_.adaptive.tolerance_m;
  const ChainAgreement test(chain.ranks, shape, input.update, config_.adaptive.agreement);
  if (input.ledger.size() == 0 && !disagree(test, chain, expected))
    return std::move(collector).take();  // nothing tells the two apart

  const OdometryError error(chain.server, chain.odometry, kFittingLever_m);
  const double least_gain = config_.adaptive.least_gain * expected * expected;
  const std::size_t most = std::min(input.budget.value_or(nodes - 1), nodes - 1);
  JointPlan best = plan(chain, error, test, most, least_gain);
  const auto cost = [&](const JointPlan& p) {
    return position_error(p) + static_cast<double>(p.joints.size()) * least_gain;
  };
  // (No link at all is better at once: it takes a new disagreement to add some again.)
  if (const auto held = held_joints(input); held && held->size() <= most + 1 && best.joints.size() > 1) {
    JointPlan kept = fit_joints(error, *held);
    if (cost(kept) <= cost(best) + least_gain) best = std::move(kept);
  }
  std::vector<Pose3> T_start_joint;
  for (std::size_t j = 0; j < best.joints.size(); ++j)
    T_start_joint.push_back(displaced(chain.server[best.joints[j]], error.at_node(best.joints[j], best.offsets[j])));
  for (std::size_t j = 1; j < best.joints.size(); ++j)
    collector.add({best.joints[j - 1], best.joints[j]}, ConstraintKind::other,
                  T_start_joint[j - 1].inverse() * T_start_joint[j]);
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
