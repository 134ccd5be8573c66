// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/compare_trajectories.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/consistency/policy.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::mission {
namespace {

constexpr RobotId kRobot{};
constexpr double kNodesPerTrajectory = 500.0;
constexpr std::size_t kMostNodes = 2000;  // where B parts from A all the time
constexpr double kLeastSpacing_m = 0.1;
constexpr double kArm_m = 5.0;
constexpr double kPartedSpacings = 2.0;    // nearer than that, the next node shows it
constexpr double kWholeStep = 1.0 - 1e-6;  // poses that are just the spacing apart, but for rounding
constexpr double kMargin = 0.9;            // of the tolerance: with the links B is nearer to A than that
constexpr double kLeastStep_m = 0.01;      // of distance, for the covariance of a motion: standing still is not exact

/// A time that both sides know.
struct Node {
  std::size_t index = 0;  ///< B's pose.
  evaluation::PosePair pair;
  double along_m = 0.0;  ///< Along A, from the first pair.
};

/// Whether B moved otherwise than A since the last node by more than the distance between nodes, as A may stand still
/// meanwhile; a rotation counts by how far it moves a point kArm_m away.
bool parted(const Node& last, const Node& here, double spacing_m) {
  const Pose3 error = (last.pair.reference.inverse() * here.pair.reference).inverse() *
                      (last.pair.estimate.inverse() * here.pair.estimate);
  return std::max(error.translation.norm(), kArm_m * rotation_angle(error)) >= kPartedSpacings * spacing_m;
}

/// B's poses that have a partner, thinned: the first, the last, one every `spacing_m` along A, and one where B parted
/// from A before that.
std::vector<Node> thin(const std::vector<Node>& all, double spacing_m) {
  std::vector<Node> out{all.front()};
  for (std::size_t i = 1; i + 1 < all.size(); ++i) {
    const bool far = all[i].along_m - out.back().along_m >= kWholeStep * spacing_m &&
                     all.back().along_m - all[i].along_m >= 0.5 * spacing_m;
    if (far || parted(out.back(), all[i], spacing_m)) out.push_back(all[i]);
  }
  out.push_back(all.back());
  return out;
}

std::vector<Node> pair_up(const Trajectory& a, const Trajectory& b, const evaluation::AssociationConfig& config) {
  std::vector<Node> out;
  std::size_t index = 0;
  for (const evaluation::PosePair& pair : evaluation::associate(b, a, config)) {
    while (b[index].stamp != pair.stamp) ++index;
    const double step_m =
        out.empty() ? 0.0 : (pair.reference.translation - out.back().pair.reference.translation).norm();
    out.push_back({index, pair, out.empty() ? 0.0 : out.back().along_m + step_m});
  }
  return out;
}

/// B's own motion from one node to a later one.
RelativePose motion(const NamedTrajectory& b, const Node& from, const Node& to,
                    const CompareTrajectoriesConfig& config) {
  RelativePose out{from.pair.estimate.inverse() * to.pair.estimate, Matrix6d::Zero()};
  if (b.step_covariance.empty()) {
    const double along_m = std::max(to.along_m - from.along_m, kLeastStep_m);
    const double rotation_rad = config.odometry_deg * kRadPerDeg;
    out.covariance.diagonal().head<3>().setConstant(config.odometry_m * config.odometry_m * along_m);
    out.covariance.diagonal().tail<3>().setConstant(rotation_rad * rotation_rad * along_m);
    return out;
  }
  for (std::size_t k = from.index; k < to.index; ++k)
    out.covariance =
        compound_covariance(b.poses[k].pose.inverse() * b.poses[k + 1].pose, out.covariance, b.step_covariance[k]);
  return out;
}

std::vector<consistency::RobotNode> robot_nodes(const NamedTrajectory& b, const std::vector<Node>& nodes,
                                                const CompareTrajectoriesConfig& config) {
  std::vector<consistency::RobotNode> out;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    out.push_back({.stamp = nodes[i].pair.stamp, .T_map_body = nodes[i].pair.estimate, .chain_index = i});
    if (i > 0) out.back().odometry = motion(b, nodes[i - 1], nodes[i], config);
  }
  return out;
}

/// A as a server would send it, a graph of neighbours at seven nodes' spacing.
ProxyGraph proxy_graph(const std::vector<Node>& nodes, double spacing_m, const CompareTrajectoriesConfig& config) {
  const PoseSigma sigma{config.tolerance_m, config.tolerance_deg * kRadPerDeg};
  // Over the whole run, the steps' covariances compound to the tolerance.
  const double share = 1.0 / static_cast<double>(nodes.size() - 1);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(share * sigma.position_m * sigma.position_m);
  covariance.diagonal().tail<3>().setConstant(share * sigma.rotation_rad * sigma.rotation_rad);
  ProxyGraph graph{.revision = 1, .radius_m = 7.0 * spacing_m, .sigma_m = std::sqrt(spacing_m)};
  for (const Node& node : nodes)
    graph.nodes.push_back({.chain = kRobot,
                           .stamp = node.pair.stamp,
                           .T_world_body = node.pair.reference,
                           .covariance = graph.nodes.empty() ? Matrix6d(Matrix6d::Zero()) : covariance});
  graph.components = {{kRobot, 0}};
  graph.uncertainties = {consistency::even_uncertainty(kRobot, nodes.size(), sigma)};
  return graph;
}

/// Bends B's own motion at the nodes by the constraints.
void correct(const std::vector<consistency::RobotNode>& nodes, TrajectoryComparison& out) {
  estimation::OnboardSmoother smoother({}, nodes.front().T_map_body);
  for (std::size_t i = 1; i < nodes.size(); ++i) smoother.append(nodes[i].odometry);
  std::vector<estimation::ChainConstraint> links;
  for (const auto& c : out.constraints) links.push_back({.from = c.from, .to = c.to, .measurement = c.measurement});
  smoother.set_constraints(std::move(links));
  smoother.solve();
  out.corrected.clear();
  for (std::size_t i = 0; i < nodes.size(); ++i) out.corrected.push_back({nodes[i].stamp, smoother.pose(i)});
}

evaluation::AteResult lay_on(const Trajectory& judge, Trajectory& trajectory) {
  const auto fit =
      evaluation::ate(evaluation::associate(trajectory, judge, {.interpolate = false, .max_difference_s = 0.0}));
  TUTTI_CHECK(fit.has_value());
  for (StampedPose& p : trajectory) p.pose = fit->T_reference_estimate * p.pose;
  return *fit;
}

using Choose = std::function<std::vector<consistency::Constraint>(double error_share)>;

/// Bends B by the fewest links with which its nodes are as near A as A is sure of itself (RMSE), with a margin: what it
/// takes to be nearer than that is wasted. `choose` lets each node be off by a share of that: the largest is looked for
/// that does; with the least one where that does not, either.
void fix(const std::vector<consistency::RobotNode>& nodes, const CompareTrajectoriesConfig& config,
         const Choose& choose, TrajectoryComparison& out) {
  constexpr double kLeastShare = 0.25, kMostShare = 6.0;
  constexpr int kHalvings = 5;
  const Trajectory judged = out.judged;
  const auto bend = [&](std::vector<consistency::Constraint> links) {
    out.constraints = std::move(links);
    out.corrected = judged;
    if (!out.constraints.empty()) correct(nodes, out);
    out.discontinuity = evaluation::discontinuity(judged, out.corrected).value_or(evaluation::Discontinuity{});
    out.after = lay_on(out.judge, out.corrected);
    return out.after.rmse_m <= kMargin * config.tolerance_m;
  };
  if (!bend(choose(kLeastShare)) || out.constraints.empty()) return;
  auto fewest = out.constraints;
  double reaches = kLeastShare, fails = kMostShare;
  for (int i = 0; i < kHalvings; ++i) {
    const double share = std::sqrt(reaches * fails);
    const bool is_near = bend(choose(share));
    (is_near ? reaches : fails) = share;
    if (is_near && out.constraints.size() < fewest.size()) fewest = out.constraints;
  }
  bend(std::move(fewest));
}

Status check_covariances(const NamedTrajectory& b) {
  TUTTI_CHECK(b.step_covariance.empty() || b.step_covariance.size() + 1 == b.poses.size());
  for (std::size_t k = 0; k < b.step_covariance.size(); ++k)
    if (!is_definite(b.step_covariance[k]))
      return fail(ErrorCode::invalid, "covariance of the motion from pose {} to {} is not positive definite", k, k + 1);
  return {};
}

double epoch_s(Timestamp stamp) { return static_cast<double>(stamp.ns) * 1e-9; }

std::string span(const Trajectory& trajectory) {
  return trajectory.empty() ? std::string("no pose")
                            : fmt::format("{} poses, {:.3f} to {:.3f} s", trajectory.size(),
                                          epoch_s(trajectory.front().stamp), epoch_s(trajectory.back().stamp));
}

}  // namespace

Result<TrajectoryComparison> compare_trajectories(const NamedTrajectory& a, const NamedTrajectory& b,
                                                  const CompareTrajectoriesConfig& config) {
  if (auto ok = check_covariances(b); !ok) return tl::unexpected(ok.error());
  const std::vector<Node> all = pair_up(a.poses, b.poses, config.association);
  if (all.size() < 2)
    return fail(ErrorCode::invalid,
                "{} of B's poses ha{} one of A at the same time, expected at least 2: A has {}; B has {}", all.size(),
                all.size() == 1 ? "s" : "ve", span(a.poses), span(b.poses));
  TrajectoryComparison out{.name = b.name, .poses = b.poses.size(), .paired = all.size()};
  out.length_m = all.back().along_m;
  out.spacing_m =
      config.spacing_m > 0.0 ? config.spacing_m : std::max(out.length_m / kNodesPerTrajectory, kLeastSpacing_m);
  std::vector<Node> nodes = thin(all, out.spacing_m);
  while (config.spacing_m == 0.0 && nodes.size() > kMostNodes) nodes = thin(all, out.spacing_m *= 2.0);
  for (const Node& node : nodes) {
    out.judge.push_back({node.pair.stamp, node.pair.reference});
    out.judged.push_back({node.pair.stamp, node.pair.estimate});
  }
  const ProxyGraph graph = proxy_graph(nodes, out.spacing_m, config);
  const auto robot = robot_nodes(b, nodes, config);
  const std::vector<consistency::NodePair> pairs = consistency::synchronise(graph, kRobot, robot).pairs;
  const consistency::DisagreementTest test(graph, kRobot, pairs, {.false_alarm_rate = config.false_alarm_rate});
  const consistency::Disagreement found = test(consistency::odometry_at(robot, pairs));
  const consistency::Ledger nothing_held;
  const auto choose = [&](double error_share) {
    const auto policy = consistency::make_policy({.name = "adaptive", .adaptive_error_share = error_share}, {});
    TUTTI_CHECK(policy.has_value());
    return (*policy)->choose({graph, kRobot, robot, pairs, nothing_held, &test, &found}).constraints;
  };
  fix(robot, config, choose, out);
  out.explanation = consistency::explain(graph, kRobot, robot, pairs, test, found, config.false_alarm_rate);

  out.before = lay_on(out.judge, out.judged);
  return out;
}

}  // namespace tutti::mission
