// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/agent.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/robot/map_covariance.hpp"
#include "tutti/robot/mend_submap.hpp"
#include "tutti/robot/odometry_sample.hpp"

namespace tutti::robot {
namespace {

/// One polishing step, because few constraints over long runs leave millimetres without it.
const estimation::OnboardSmootherConfig kSmoother{.polishing_steps = 1};

std::unique_ptr<const consistency::ConstraintPolicy> known_policy(const AgentConfig& config) {
  auto policy = consistency::make_policy(config.policy, config.compare);
  TUTTI_CHECK(policy.has_value(), "{}", policy.error().message);
  return std::move(*policy);
}

}  // namespace

RobotAgent::RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config)
    : RobotAgent(robot, session, config, known_policy(config)) {}
RobotAgent::RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config,
                       std::unique_ptr<const consistency::ConstraintPolicy> policy)
    : RobotAgent(robot, config, std::move(policy), AgentState{{.session = session}}) {}
RobotAgent::RobotAgent(RobotId robot, const AgentConfig& config, AgentState state)
    : RobotAgent(robot, config, known_policy(config), std::move(state)) {}
RobotAgent::RobotAgent(RobotId robot, const AgentConfig& config,
                       std::unique_ptr<const consistency::ConstraintPolicy> policy, AgentState state)
    : chain_(robot, state.session),
      config_(config),
      policy_(std::move(policy)),
      submaps_(chain_, config.submap, std::move(state.submaps)),
      smoother_(kSmoother, std::move(state.smoother)),
      state_(std::move(state)),
      fit_(config.submap.fit) {}
RobotAgent::~RobotAgent() = default;
RobotAgent::RobotAgent(RobotAgent&&) noexcept = default;
RobotAgent& RobotAgent::operator=(RobotAgent&&) noexcept = default;

Status RobotAgent::add(const Input& input) {
  const auto* sample = std::get_if<OdometrySample>(&input);
  Status ok = sample == nullptr ? submaps_.add(input) : add_odometry(*sample);
  add_keyframes();
  return ok;
}

Status RobotAgent::add_odometry(const OdometrySample& sample) {
  const auto fed = usable_step(chain_.robot, sample);
  if (!fed) return tl::unexpected(fed.error());
  OdometryWatch watch = this->watch();
  const auto [T_odom_body, jump] = watch.take({sample.stamp, fed->T_odom_body});
  const Matrix6d covariance = jump ? unknown_step() : fed->covariance;
  const bool is_first = state_.keyframes.empty();
  if (auto ok = submaps_.add(OdometryStep{sample.stamp, T_odom_body, covariance, jump.has_value()}); !ok) return ok;
  state_.watch = watch.state();
  if (jump) jumps_.push_back(*jump);
  fit_.add_odometry({sample.stamp, T_odom_body}, jump.has_value());
  if (!is_first) {
    const Matrix6d moved =
        compound_covariance(state_.T_odom_body.inverse() * T_odom_body, state_.covariance, covariance);
    state_.covariance = 0.5 * (moved + moved.transpose());
  }
  state_.T_odom_body = T_odom_body;
  return {};
}

void RobotAgent::add_keyframes() {
  for (const NewKeyframe& keyframe : submaps_.take_keyframes()) add_keyframe(keyframe.step, keyframe.submap);
}

void RobotAgent::add_keyframe(const KeyframeStep& step, std::uint32_t submap) {
  if (state_.keyframes.empty()) {
    smoother_.set_first_pose(step.keyframe.T_odom_body);
  } else {
    smoother_.append(step.odometry);
    state_.since_node = compound(state_.since_node, step.odometry);
  }
  state_.keyframes.push_back(step.keyframe);
  state_.submap_of.push_back(submap);
  if (step.keyframe.representative)
    state_.node_odometry.push_back(std::exchange(state_.since_node, {.T_a_b = {}, .covariance = Matrix6d::Zero()}));
}

void RobotAgent::add_keyframe_time(Timestamp stamp) {
  submaps_.add_keyframe_time(stamp);
  add_keyframes();
}

void RobotAgent::finish() {
  submaps_.finish();
  add_keyframes();
}

std::optional<Timestamp> RobotAgent::keyframe_before(Timestamp stamp) const {
  const auto at = std::ranges::lower_bound(state_.keyframes, stamp, {}, &Keyframe::stamp);
  return at == state_.keyframes.begin() ? std::nullopt : std::optional((*(at - 1)).stamp);
}

void RobotAgent::expect_sensors(bool scans, bool images) {
  config_.submap.has_scans = scans;
  config_.submap.has_images = images;
  submaps_.expect_sensors(scans, images);
}

std::optional<std::uint64_t> RobotAgent::keyframes_without_scan() const {
  const SubmapBuilderState& submaps = submaps_.state();
  if (!config_.submap.has_scans && !submaps.heard_scan) return std::nullopt;
  return submaps.keyframes_without_scan;
}

std::optional<std::uint64_t> RobotAgent::keyframes_without_images() const {
  const SubmapBuilderState& submaps = submaps_.state();
  if (!config_.submap.has_images && !submaps.heard_images) return std::nullopt;
  return submaps.keyframes_without_images;
}

std::vector<SubmapMessage> RobotAgent::take_outgoing() {
  std::vector<SubmapMessage> out;
  const auto observe = [&](const FinishedSubmap& finished, const SubmapSteps& steps) {
    fit_.add(finished, steps, submaps_.state().drift);
  };
  while (auto submap = submaps_.take_submap(observe))
    out.push_back({.header = {.robot = chain_.robot, .session = chain_.session, .sequence = state_.sequence++},
                   .submap = std::move(*submap)});
  return out;
}

std::vector<consistency::RobotNode> RobotAgent::nodes() const {
  std::vector<consistency::RobotNode> nodes;
  for (std::size_t k = 0; k < state_.keyframes.size(); ++k) {
    const Keyframe keyframe = state_.keyframes[k];
    if (!keyframe.representative) continue;
    nodes.push_back({.stamp = keyframe.stamp,
                     .T_map_body = smoother_.pose(k),
                     .chain_index = k,
                     .odometry = state_.node_odometry[nodes.size()],
                     .submap = state_.submap_of[k]});
  }
  return nodes;
}

// The method of the paper, one step a line (docs/math.md, "Comparison and constraints").
UpdateSummary RobotAgent::receive(const ProxyGraphMessage& message, const StageObserver& stage_ended) {
  UpdateSummary summary{.revision = message.graph.revision, .constraints = state_.ledger.size()};
  if (!is_news(message.graph)) return summary;  // late or repeated
  std::tie(state_.epoch, state_.revision) = message.graph.age();
  const auto ended = [&](UpdateStage stage) {
    if (stage_ended) stage_ended(stage);
  };

  const ProxyGraph graph = consistency::without_doubted(message.graph, chain_);
  const std::vector<consistency::RobotNode> own = nodes();
  const std::vector<consistency::NodePair> pairs = consistency::synchronise(graph, chain_, own).pairs;

  std::optional<consistency::DisagreementTest> test;
  consistency::Disagreement odometry_disagreement;
  ++state_.comparisons;
  if (pairs.size() >= 2 && (config_.explain || policy_->needs_test())) {
    test.emplace(graph, chain_, pairs, config_.disagreement.for_run_of(pairs.size()));
    odometry_disagreement = (*test)(consistency::odometry_at(own, pairs));
  }
  const std::size_t withdrawn = state_.ledger.withdraw_unknown(graph, chain_);
  const consistency::Ledger kept = state_.ledger;
  const auto selection = policy_->choose({.graph = graph,
                                          .chain = chain_,
                                          .nodes = own,
                                          .pairs = pairs,
                                          .ledger = state_.ledger,
                                          .test = test ? &*test : nullptr,
                                          .odometry_disagreement = &odometry_disagreement});
  summary.ledger = state_.ledger.update(selection.constraints, selection.replaces_all);
  summary.ledger.withdrawn += withdrawn;
  ended(UpdateStage::choose);

  summary.optimised = optimise();
  if (!estimation::is_usable(summary.optimised)) {
    summary.taken_back = true;
    state_.ledger = kept;
    if (!estimation::is_usable(optimise())) {
      state_.ledger = {};
      optimise();
    }
  }
  state_.T_map_odom = state_.ledger.size() == 0
                          ? Pose3{}
                          : smoother_.pose(smoother_.size() - 1) * state_.keyframes.back().T_odom_body.inverse();
  state_.covariance = covariance_by(message.graph);
  state_.component = component_of(message.graph, chain_);
  locate_others(message.graph, own, pairs);
  ended(UpdateStage::optimise);

  if (config_.explain && test)
    summary.explanation = consistency::explain(graph, chain_, own, pairs, *test, std::move(odometry_disagreement),
                                               config_.disagreement.false_alarm_rate);
  summary.synchronised = pairs.size();
  summary.proposed = selection.constraints.size();
  summary.constraints = state_.ledger.size();
  summary.order = selection.order;
  return summary;
}

estimation::Termination RobotAgent::optimise() {
  std::vector<estimation::ChainConstraint> constraints;
  for (const consistency::Constraint& c : state_.ledger.constraints())
    constraints.push_back({.from = c.from, .to = c.to, .measurement = c.measurement});
  smoother_.set_constraints(std::move(constraints));
  return smoother_.solve().termination;
}

Matrix6d RobotAgent::covariance_by(const ProxyGraph& graph) const {
  if (state_.keyframes.empty()) return Matrix6d::Zero();
  std::vector<Timestamp> stamps;
  for (const Keyframe& keyframe : state_.keyframes) stamps.push_back(keyframe.stamp);
  const Matrix6d at_keyframe = map_covariance(graph, chain_, stamps, state_.ledger, smoother_.state());
  const RelativePose since = submaps_.since_keyframe();
  return compound_covariance(since.T_a_b, at_keyframe, since.covariance);
}

// Frames differ by an unknown transform; the newest common node ties them together where this robot is now.
void RobotAgent::locate_others(const ProxyGraph& graph, std::span<const consistency::RobotNode> own,
                               std::span<const consistency::NodePair> pairs) {
  state_.whereabouts.clear();
  T_map_world_.reset();
  if (pairs.empty()) return;
  const Pose3& T_map_newest = smoother_.pose(own[pairs.back().robot].chain_index);  // as corrected now
  const Pose3 T_map_world = T_map_newest * graph.nodes[pairs.back().proxy].T_world_body.inverse();
  T_map_world_ = T_map_world;
  for (const LastSeen& seen : graph.last_seen)
    if (seen.chain.robot != chain_.robot && component_of(graph, seen.chain) == component_of(graph, chain_))
      state_.whereabouts.push_back({seen.chain.robot, seen.stamp, T_map_world * seen.T_world_body, seen.name});
}

AgentHead RobotAgent::head() const {
  AgentHead out = state_;
  out.submaps = submaps_.state();
  return out;
}

AgentState RobotAgent::state() const {
  AgentState out = state_;
  out.submaps = submaps_.state();
  out.smoother = smoother_.state();
  return out;
}

Trajectory RobotAgent::corrected() const {
  Trajectory out;
  for (std::size_t k = 0; k < state_.keyframes.size(); ++k)
    out.push_back({state_.keyframes[k].stamp, smoother_.pose(k)});
  return out;
}

}  // namespace tutti::robot
