// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/consistency/compare.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/consistency/ledger.hpp"
#include "tutti/consistency/policy.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/robot/odometry_watch.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

struct AgentConfig {
  SubmapConfig submap;
  consistency::CompareConfig compare;
  consistency::DisagreementConfig disagreement;
  consistency::PolicyConfig policy;
  estimation::OnboardSmootherConfig smoother{.polishing_steps =
                                                 1};  ///< Few links, long runs: one step gives them back millimetres.
  bool explain = true;
  OdometryWatchConfig jumps;
  template <class V>
  void describe(V& v) {
    v.field("submap", submap);
    v.field("compare", compare);
    v.field("disagreement", disagreement);
    v.field("policy", policy);
    v.field("smoother", smoother);
    v.field("jumps", jumps);
    v.field("explain", explain, any(), "Say after every update where and when odometry and map part.");
  }
};

/// Where another robot was last known to be, in its newest session, in this robot's `map` frame.
struct Whereabouts {
  RobotId robot;
  Timestamp stamp;
  Pose3 T_map_body;
};

/// What one proxy graph changed.
struct UpdateSummary {
  std::uint64_t revision = 0;
  std::size_t synchronised = 0;      ///< Pairs of nodes compared.
  std::size_t proposed = 0;          ///< Constraints the policy chose.
  std::size_t constraints = 0;       ///< In the ledger afterwards.
  int order = 0;                     ///< Of the Chebyshev transform; 0 = exact or not computed.
  consistency::LedgerUpdate ledger;  ///< What became of the constraints.
  /// How the optimisation with them ended.
  estimation::Termination optimised = estimation::Termination::not_run;
  /// They could not be solved: the ledger holds what it held before, or nothing.
  bool taken_back = false;
  consistency::Explanation explanation;  ///< Of raw odometry against the server's map.
};

/// The steps of an update, in order. An observer is told when each ends, so that whoever owns a clock can time them.
enum class UpdateStage { compare, choose, optimise };
using StageObserver = std::function<void(UpdateStage)>;

/// What of an agent's state changes as it goes on; it does not grow with the way.
struct AgentHead {
  std::uint64_t session = 0;   ///< ChainId::session; goes on with the state.
  std::uint64_t sequence = 0;  ///< Of the next message.
  std::uint64_t epoch = 0;     ///< Of the newest proxy graph seen: ProxyGraph::age().
  std::uint64_t revision = 0;
  std::uint64_t comparisons = 0;  ///< Proxy graphs compared.
  SubmapBuilderState submaps;
  RelativePose since_node{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  OdometryWatch::State watch;  ///< What was fed.
  Pose3 T_odom_body;           ///< Newest sample.
  Pose3 T_map_odom;
  Matrix6d covariance = Matrix6d::Zero();  ///< RobotAgent::covariance().
  std::vector<Whereabouts> whereabouts;
  /// Of the map, by the newest proxy graph; nothing: it does not know this chain.
  std::optional<std::uint32_t> component;
};

/// An agent's whole state, by value: restart it from this and it goes on as if nothing had happened.
struct AgentState : AgentHead {
  estimation::SmootherState smoother;  ///< Its odometry is only added to; the rest changes when a graph is received.
  consistency::Ledger ledger;          ///< The same.
  // These are only added to.
  std::vector<Keyframe> keyframes;          ///< Nodes of the smoother's chain.
  std::vector<std::uint32_t> submap_of;     ///< Of each keyframe: the submap it was first in.
  std::vector<RelativePose> node_odometry;  ///< Raw, between representative keyframes; [k] ends at the k-th.
};

/// One robot: odometry and scans in, submaps out; proxy graphs in, corrected trajectory out. No threads, sockets or
/// clocks inside; works the same whether or not a server is ever heard.
class RobotAgent {
 public:
  /// `config.policy.name` must be a known policy (checked: throws on our own mistake; validate user input before).
  /// `session` is larger than in any start of this robot before, such as the time of the start (ChainId).
  RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config, Rng rng);
  /// Goes on from a saved state and its session, with the same configuration and randomness as then.
  RobotAgent(RobotId robot, const AgentConfig& config, Rng rng, AgentState state);
  ~RobotAgent();
  RobotAgent(RobotAgent&&) noexcept;
  RobotAgent& operator=(RobotAgent&&) noexcept;

  /// Raw odometry, see SubmapBuilder::add_odometry; a bad sample is refused and nothing changes. Quaternions are
  /// normalised where they are off by rounding only (1e-3). Covariances may lack a coordinate (odometry in the plane)
  /// or call one unknown; what is used and uploaded has standard deviations of at most 10 m and 0.3 rad and an inverse
  /// (geometry/covariance.hpp). Where it jumps (OdometryWatch) the robot is taken to stay, as unsure as a step may be,
  /// and a submap of its own leads across: what sensors see before and after is never in one.
  Status add_odometry(Timestamp stamp, const Pose3& T_odom_body, const Matrix6d& increment_covariance);
  Status add_scan(const Scan& scan);
  /// SubmapBuilder::add_images()
  Status add_images(const TrackedImages& images);
  /// SubmapBuilder::add_moment()
  void add_moment(Timestamp stamp);
  /// SubmapBuilder's functions of these names
  [[nodiscard]] bool wants_scan() const { return submaps_.wants_scan(); }
  [[nodiscard]] bool wants_scan(Timestamp stamp) const { return submaps_.wants_scan(stamp); }
  [[nodiscard]] bool wants_images(Timestamp stamp) const { return submaps_.wants_images(stamp); }
  [[nodiscard]] NextKeyframe next_keyframe() const { return submaps_.next_keyframe(); }
  /// Of the newest keyframe before this moment; nothing: there is none.
  [[nodiscard]] std::optional<Timestamp> keyframe_before(Timestamp stamp) const;
  /// SubmapConfig::has_scans and has_images, of a robot of which that becomes known later.
  void expect_sensors(bool scans, bool images);
  /// Stamp of the latest odometry sample.
  [[nodiscard]] std::optional<Timestamp> newest_sample() const { return submaps_.newest_sample(); }
  /// The newest; nothing: none yet.
  [[nodiscard]] std::optional<Timestamp> heard_images() const { return submaps_.state().heard_images; }
  /// SubmapBuilder::settled()
  [[nodiscard]] std::optional<Timestamp> settled() const { return submaps_.settled(); }
  /// Since the last one that was taken; nothing: the robot is not known to have that sensor.
  [[nodiscard]] std::optional<std::uint64_t> keyframes_without_scan() const;
  [[nodiscard]] std::optional<std::uint64_t> keyframes_without_images() const;
  /// Ends the run: the last, shorter submap becomes an outgoing message.
  void finish();
  /// Submaps ready to be sent, oldest first; taken once. Their scans are merged here, which add_odometry() and
  /// add_scan() need not wait for: until then they are kept whole, so ask regularly.
  std::vector<SubmapMessage> take_outgoing();
  /// SubmapBuilder::take_image_errors()
  std::vector<Error> take_image_errors() { return submaps_.take_image_errors(); }
  /// Told once.
  std::vector<OdometryJump> take_odometry_jumps() { return std::exchange(jumps_, {}); }
  /// SubmapBuilder::take_scan_errors()
  std::vector<Error> take_scan_errors() { return submaps_.take_scan_errors(); }

  /// Compares the server's map with the own one and adds the constraints it takes. An older revision than the newest
  /// seen changes nothing (synchronised = 0). `budget` limits policies that need one.
  UpdateSummary receive(const ProxyGraphMessage& message, std::optional<std::size_t> budget = std::nullopt,
                        const StageObserver& stage_ended = {});

  /// The next graph is news, whatever its age: the map is another one.
  void forget_map_age() { state_.epoch = state_.revision = 0; }
  /// Newer than any that was received; another one changes nothing.
  [[nodiscard]] bool is_news(const ProxyGraph& graph) const { return graph.age() > newest_heard(); }

  /// ProxyGraph::age() of the newest; (0, 0): none.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> newest_heard() const { return {state_.epoch, state_.revision}; }

  [[nodiscard]] AgentState state() const;
  // The parts of state(), which takes the longer the longer the way is.
  [[nodiscard]] AgentHead head() const;
  [[nodiscard]] const estimation::SmootherState& smoother() const { return smoother_.state(); }
  [[nodiscard]] const std::vector<std::uint32_t>& submap_of() const { return state_.submap_of; }
  [[nodiscard]] const std::vector<RelativePose>& node_odometry() const { return state_.node_odometry; }
  [[nodiscard]] RobotId robot() const { return chain_.robot; }
  [[nodiscard]] const ChainId& chain() const { return chain_; }
  [[nodiscard]] const std::vector<Keyframe>& keyframes() const { return state_.keyframes; }
  [[nodiscard]] const consistency::Ledger& ledger() const { return state_.ledger; }
  [[nodiscard]] const consistency::ConstraintPolicy& policy() const { return *policy_; }
  /// Of the own chain: one per keyframe but the first.
  [[nodiscard]] std::size_t odometry_factors() const { return smoother_.size() - 1; }
  /// T_map_body at the keyframes; `map` starts where `odom` does.
  [[nodiscard]] Trajectory corrected() const;
  /// Takes odometry into the corrected map. Only receive() changes it; the identity while nothing is corrected.
  [[nodiscard]] const Pose3& T_map_odom() const { return state_.T_map_odom; }
  /// The newest sample, in the frame of the first one, whatever has jumped since.
  [[nodiscard]] const Pose3& T_odom_body() const { return state_.T_odom_body; }
  [[nodiscard]] OdometryWatch watch() const { return {config_.jumps, state_.watch}; }
  /// From the frame of what is fed now, which is another one after each jump; the identity while there was none.
  [[nodiscard]] const std::optional<StampedPose>& newest_fed() const {
    return state_.watch.newest;
  }  ///< As it was fed.
  [[nodiscard]] Pose3 T_odom_fed() const { return watch().T_odom_fed(); }
  /// The corrected pose at the newest odometry sample: T_map_odom * T_odom_body. It jumps when receive() corrects.
  [[nodiscard]] Pose3 T_map_body() const { return state_.T_map_odom * state_.T_odom_body; }
  /// Newest proxy graph heard; zeros: none.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> map_age() const { return {state_.epoch, state_.revision}; }
  /// Of T_map_body(), right tangent: how far the body may be from there, seen from where `map` begins (the first
  /// sample). It grows with odometry, and is what the map allows for when receive() corrects (map_covariance.hpp).
  [[nodiscard]] const Matrix6d& covariance() const { return state_.covariance; }
  /// Of the newest proxy graph; nothing: it does not know this chain, or none was heard.
  [[nodiscard]] std::optional<std::uint32_t> component() const { return state_.component; }
  [[nodiscard]] const std::vector<Whereabouts>& whereabouts() const { return state_.whereabouts; }

 private:
  void add_keyframes();
  void add_keyframe(const KeyframeStep& step, std::uint32_t submap);
  [[nodiscard]] std::vector<consistency::RobotNode> nodes() const;
  [[nodiscard]] Matrix6d covariance_by(const ProxyGraph& graph) const;
  estimation::Termination optimise();
  void locate_others(const ProxyGraph& graph, std::span<const consistency::RobotNode> own,
                     std::span<const consistency::NodePair> pairs);

  ChainId chain_;
  AgentConfig config_;
  Rng rng_;
  std::unique_ptr<consistency::ConstraintPolicy> policy_;
  SubmapBuilder submaps_;
  estimation::OnboardSmoother smoother_;
  AgentState state_;  // but for what submaps_ and smoother_ hold
  std::vector<OdometryJump> jumps_;
};

}  // namespace tutti::robot
