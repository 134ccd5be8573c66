// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/agent.hpp"

#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::robot {
namespace {

std::unique_ptr<consistency::ConstraintPolicy> known_policy(const consistency::PolicyConfig& config) {
  auto policy = consistency::make_policy(config.name, config);
  TUTTI_CHECK(policy.has_value(), "{}", policy.error().message);
  return std::move(*policy);
}

}  // namespace

RobotAgent::RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config, Rng rng)
    : robot_(robot),
      session_(session),
      config_(config),
      rng_(std::move(rng)),
      submaps_(robot, config.submap),
      smoother_(config.smoother),
      policy_(known_policy(config.policy)) {}
RobotAgent::~RobotAgent() = default;
RobotAgent::RobotAgent(RobotAgent&&) noexcept = default;
RobotAgent& RobotAgent::operator=(RobotAgent&&) noexcept = default;

Status RobotAgent::add_odometry(Timestamp stamp, const Pose3& T_odom_body, const Matrix6d& increment_covariance) {
  const std::uint32_t submap = submaps_.current_submap();
  const auto keyframe = submaps_.add_odometry(stamp, T_odom_body, increment_covariance);
  if (!keyframe) return tl::unexpected(keyframe.error());
  if (last_odometry_) {
    const Pose3 step = last_odometry_->inverse() * T_odom_body;
    smoother_.append({step, increment_covariance});
    since_node_ = {since_node_.T_a_b * step, compound_covariance(step, since_node_.covariance, increment_covariance)};
  } else {
    smoother_.set_first_pose(T_odom_body);
  }
  last_odometry_ = T_odom_body;
  if (*keyframe) {
    keyframes_.push_back(**keyframe);
    chain_index_.push_back(smoother_.size() - 1);
    submap_of_.push_back(submap);
    if ((*keyframe)->representative)
      node_odometry_.push_back(std::exchange(since_node_, {.T_a_b = {}, .covariance = Matrix6d::Zero()}));
  }
  if (auto submap_done = submaps_.take_submap()) send(std::move(*submap_done));
  return {};
}

Status RobotAgent::add_scan(const Scan& scan) { return submaps_.add_scan(scan); }

void RobotAgent::finish() {
  if (auto last = submaps_.finish()) send(std::move(*last));
}

void RobotAgent::send(Submap submap) {
  outgoing_.push_back(
      {.header = {.robot = robot_, .session = session_, .sequence = sequence_++}, .submap = std::move(submap)});
}

std::vector<SubmapMessage> RobotAgent::take_outgoing() { return std::exchange(outgoing_, {}); }

std::vector<consistency::RobotNode> RobotAgent::nodes() const {
  std::vector<consistency::RobotNode> nodes;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    if (!keyframes_[k].representative) continue;
    nodes.push_back({.stamp = keyframes_[k].stamp,
                     .T_map_body = smoother_.pose(chain_index_[k]),
                     .chain_index = chain_index_[k],
                     .odometry = node_odometry_[nodes.size()],
                     .submap = submap_of_[k]});
  }
  return nodes;
}

// The method of the paper, one step a line (DESIGN 2, steps 4 to 7).
UpdateSummary RobotAgent::receive(const ProxyGraphMessage& message, std::optional<std::size_t> budget,
                                  const StageObserver& stage_ended) {
  UpdateSummary summary{.revision = message.graph.revision, .constraints = ledger_.size()};
  if (message.graph.revision <= revision_) return summary;  // late or repeated
  revision_ = message.graph.revision;
  const auto ended = [&](UpdateStage stage) {
    if (stage_ended) stage_ended(stage);
  };

  const std::vector<consistency::RobotNode> own = nodes();
  const auto comparison = consistency::compare(message.graph, robot_, own, config_.compare);
  ended(UpdateStage::compare);

  const auto selection = policy_->choose({.graph = message.graph,
                                          .robot = robot_,
                                          .nodes = own,
                                          .comparison = comparison,
                                          .budget = budget,
                                          .rng = rng_.fork(revision_),
                                          .ledger = ledger_});
  ledger_.update(selection.constraints, config_.ledger, selection.replaces_all);
  ended(UpdateStage::choose);

  optimise();
  locate_others(message.graph, own, comparison.pairs);
  ended(UpdateStage::optimise);

  summary.synchronised = comparison.pairs.size();
  summary.proposed = selection.constraints.size();
  summary.constraints = ledger_.size();
  summary.order = comparison.order;
  if (comparison.disagreement.rows() > 0) {
    summary.mean_disagreement = comparison.disagreement.colwise().mean().transpose();
    summary.max_disagreement = comparison.disagreement.colwise().maxCoeff().transpose();
  }
  return summary;
}

void RobotAgent::optimise() {
  std::vector<estimation::ChainConstraint> constraints;
  for (const consistency::Constraint& c : ledger_.constraints())
    constraints.push_back({.from = c.from, .to = c.to, .measurement = c.measurement});
  smoother_.set_constraints(std::move(constraints));
  smoother_.solve();
}

// Frames differ by an unknown transform; the newest common node ties them together where this robot is now.
void RobotAgent::locate_others(const ProxyGraph& graph, std::span<const consistency::RobotNode> own,
                               std::span<const consistency::NodePair> pairs) {
  whereabouts_.clear();
  if (pairs.empty()) return;
  const Pose3& T_map_newest = smoother_.pose(own[pairs.back().robot].chain_index);  // as corrected now
  const Pose3 T_map_world = T_map_newest * graph.nodes[pairs.back().proxy].T_world_body.inverse();
  const auto component_of = [&](RobotId robot) -> std::optional<std::uint32_t> {
    for (const RobotComponent& entry : graph.components)
      if (entry.robot == robot) return entry.component;
    return std::nullopt;
  };
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const ProxyNode& node = graph.nodes[i];
    const bool last = i + 1 == graph.nodes.size() || graph.nodes[i + 1].robot != node.robot;
    if (!last || node.robot == robot_ || component_of(node.robot) != component_of(robot_)) continue;
    whereabouts_.push_back({node.robot, node.stamp, T_map_world * node.T_world_body});
  }
}

Trajectory RobotAgent::corrected() const {
  Trajectory out;
  for (std::size_t k = 0; k < keyframes_.size(); ++k)
    out.push_back({keyframes_[k].stamp, smoother_.pose(chain_index_[k])});
  return out;
}

}  // namespace tutti::robot
