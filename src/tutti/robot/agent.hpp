// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/consistency/compare.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/consistency/ledger.hpp"
#include "tutti/consistency/policy.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/robot/fit_watch.hpp"
#include "tutti/robot/odometry_watch.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

/// Settings of a robot; `describe` explains each.
struct AgentConfig {
  SubmapConfig submap;
  consistency::CompareConfig compare;
  consistency::DisagreementConfig disagreement;
  consistency::PolicyConfig policy;
  bool explain = true;  ///< States after every update where and when odometry and map part.
  template <class V>
  void describe(V& v) {
    v.field("submap", submap);
    v.field("compare", compare);
    v.field("disagreement", disagreement);
    v.field("policy", policy);
  }
};

/// Where another robot was last known to be, in its newest session, in this robot's `map` frame.
struct Whereabouts {
  RobotId robot;
  Timestamp stamp;
  Pose3 T_map_body;
  std::string name;  ///< LastSeen::name
};

/// The changes that one proxy graph made on the robot.
struct UpdateSummary {
  std::uint64_t revision = 0;
  std::size_t synchronised = 0;      ///< Pairs of nodes that were compared.
  std::size_t proposed = 0;          ///< Constraints that the policy chose.
  std::size_t constraints = 0;       ///< Constraints in the ledger afterwards.
  int order = 0;                     ///< Selection::order
  consistency::LedgerUpdate ledger;  ///< The changes of the ledger.
  /// How the optimisation with the new constraints ended.
  estimation::Termination optimised = estimation::Termination::not_run;
  /// The optimisation failed. The ledger is then what it was before, without withdrawn constraints; or nothing if
  /// that fails too.
  bool taken_back = false;
  /// Where raw odometry differs from the server's map; empty unless AgentConfig::explain.
  consistency::Explanation explanation;
};

/// The stages of an update, in order: to choose constraints by where robot and map disagree, and to optimise with them.
/// An observer is called when each one ends, so that a caller with a clock can time them.
enum class UpdateStage { choose, optimise };
using StageObserver = std::function<void(UpdateStage)>;

/// The part of an agent's state whose size does not grow with the length of the run.
struct AgentHead {
  std::uint64_t session = 0;   ///< ChainId::session; a restored state goes on with it.
  std::uint64_t sequence = 0;  ///< The next message's.
  std::uint64_t epoch = 0;     ///< ProxyGraph::age() of the newest graph heard.
  std::uint64_t revision = 0;
  std::uint64_t comparisons = 0;  ///< Number of proxy graphs that were compared.
  SubmapBuilderState submaps;
  RelativePose since_node{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  OdometryWatch::State watch;  ///< The odometry as it was fed.
  Pose3 T_odom_body;           ///< At the newest sample, in the frame of the first one.
  Pose3 T_map_odom;
  Matrix6d covariance = Matrix6d::Zero();  ///< RobotAgent::covariance().
  std::vector<Whereabouts> whereabouts;
  /// The chain's component in the newest proxy graph; nothing when the graph does not know the chain.
  std::optional<std::uint32_t> component;
};

/// An agent's whole state, by value. An agent made from it goes on as if it had never stopped.
struct AgentState : AgentHead {
  estimation::SmootherState smoother;  ///< Its odometry only grows; the rest changes when a graph is received.
  consistency::Ledger ledger;          ///< Changes when a graph is received.
  // These only grow.
  LongList<Keyframe> keyframes;  ///< The nodes of the smoother's chain.
  /// SubmapId::index, per keyframe, of the first submap that the keyframe is in.
  std::vector<std::uint32_t> submap_of;
  /// Raw odometry between representative keyframes; entry k ends at the k-th.
  LongList<RelativePose> node_odometry;
};

/// One robot: takes odometry and sensor data and gives submaps; takes proxy graphs and gives a corrected trajectory. It
/// has no threads, sockets or clocks, and works whether or not a server is ever heard. Not for several threads at a
/// time.
class RobotAgent {
 public:
  /// Throws on an unknown `config.policy.name`, so validate user input first. `session` must be larger than at any
  /// earlier start of this robot, such as the time of the start (ChainId).
  RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config);
  /// With a policy of the caller's own; config.policy is ignored.
  RobotAgent(RobotId robot, std::uint64_t session, const AgentConfig& config,
             std::unique_ptr<const consistency::ConstraintPolicy> policy);
  /// Goes on from a saved state and its session. `config` must be the same as when the state was saved.
  RobotAgent(RobotId robot, const AgentConfig& config, AgentState state);
  ~RobotAgent();
  RobotAgent(RobotAgent&&) noexcept;
  RobotAgent& operator=(RobotAgent&&) noexcept;

  /// Adds an input; a bad one is refused and nothing changes (SubmapBuilder::add()).
  ///
  /// Any later stamp of odometry is believed, so one far ahead shuts out all up to it: have a StampWatch decide before,
  /// as nodes do. Quaternions that are off by rounding (1e-3) are normalised. Covariances may lack a coordinate
  /// (odometry in the plane) or call one unknown; what is used and uploaded has an inverse, and standard deviations of
  /// at most 10 m and 0.3 rad (geometry/covariance.hpp).
  ///
  /// Where odometry jumps (OdometryWatch), the robot is assumed to stay where it is, with the largest covariance that a
  /// step may have. A submap of its own bridges the jump, so that no submap has what sensors saw on both sides.
  Status add(const Input& input);
  /// SubmapBuilder::add_keyframe_time()
  void add_keyframe_time(Timestamp stamp);
  /// SubmapBuilder's functions of these names
  [[nodiscard]] bool wants_scan() const { return submaps_.wants_scan(); }
  [[nodiscard]] bool wants_scan(Timestamp stamp) const { return submaps_.wants_scan(stamp); }
  [[nodiscard]] bool wants_images(Timestamp stamp) const { return submaps_.wants_images(stamp); }
  [[nodiscard]] NextKeyframe next_keyframe() const { return submaps_.next_keyframe(); }
  /// Stamp of the newest keyframe before this time; nothing when there is none.
  [[nodiscard]] std::optional<Timestamp> keyframe_before(Timestamp stamp) const;
  /// Sets SubmapConfig::has_scans and has_images, for a robot of which they become known after its start.
  void expect_sensors(bool scans, bool images);
  /// Stamp of the latest odometry sample.
  [[nodiscard]] std::optional<Timestamp> newest_sample() const { return submaps_.newest_sample(); }
  /// Stamp of the newest images heard; nothing before the first.
  [[nodiscard]] std::optional<Timestamp> heard_images() const { return submaps_.state().heard_images; }
  /// SubmapBuilder::settled()
  [[nodiscard]] std::optional<Timestamp> settled() const { return submaps_.settled(); }
  /// Keyframes since the last one with a scan (with images); nothing when the robot is not known to have that sensor.
  [[nodiscard]] std::optional<std::uint64_t> keyframes_without_scan() const;
  [[nodiscard]] std::optional<std::uint64_t> keyframes_without_images() const;
  /// Ends the run: the last, shorter submap becomes an outgoing message.
  void finish();
  /// The submaps that are ready to be sent, oldest first, each one once. This is where scans are merged, so that
  /// add() returns quickly; until then scans are kept whole, so call it regularly.
  std::vector<SubmapMessage> take_outgoing();
  /// SubmapBuilder::take_image_errors()
  std::vector<Error> take_image_errors() { return submaps_.take_image_errors(); }
  /// The jumps since the last call.
  std::vector<OdometryJump> take_odometry_jumps() { return std::exchange(jumps_, {}); }
  /// In what the scans contradict odometry, as far as it was not said before (FitWatch).
  std::vector<fit::Misfit> take_misfits() { return fit_.take_news(); }
  [[nodiscard]] const FitWatch& fit() const { return fit_; }
  /// SubmapBuilder::take_scan_errors()
  std::vector<Error> take_scan_errors() { return submaps_.take_scan_errors(); }

  /// Compares the server's map with the robot's own, and takes the constraints that the policy chooses. A graph that is
  /// no news changes nothing (synchronised = 0).
  UpdateSummary receive(const ProxyGraphMessage& message, const StageObserver& stage_ended = {});

  /// Makes the next graph news whatever its age is, because it is of another map.
  void forget_map_age() { state_.epoch = state_.revision = 0; }
  /// True if the graph is newer than any that was received.
  [[nodiscard]] bool is_news(const ProxyGraph& graph) const { return graph.age() > map_age(); }

  /// ProxyGraph::age() of the newest graph received; (0, 0) before the first.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> map_age() const { return {state_.epoch, state_.revision}; }

  [[nodiscard]] AgentState state() const;
  // The parts of state(), which as a whole takes time in proportion to the run.
  [[nodiscard]] AgentHead head() const;
  [[nodiscard]] const estimation::SmootherState& smoother() const { return smoother_.state(); }
  [[nodiscard]] const std::vector<std::uint32_t>& submap_of() const { return state_.submap_of; }
  [[nodiscard]] const LongList<RelativePose>& node_odometry() const { return state_.node_odometry; }
  [[nodiscard]] RobotId robot() const { return chain_.robot; }
  [[nodiscard]] const ChainId& chain() const { return chain_; }
  [[nodiscard]] const LongList<Keyframe>& keyframes() const { return state_.keyframes; }
  [[nodiscard]] const consistency::Ledger& ledger() const { return state_.ledger; }
  [[nodiscard]] const consistency::ConstraintPolicy& policy() const { return *policy_; }
  /// Odometry factors of the own chain: one per keyframe but the first.
  [[nodiscard]] std::size_t odometry_factors() const { return smoother_.size() - 1; }
  /// T_map_body at the keyframes; `map` begins where `odom` does.
  [[nodiscard]] Trajectory corrected() const;
  /// Maps odometry into the corrected map. Only receive() changes it; the identity while nothing is corrected.
  [[nodiscard]] const Pose3& T_map_odom() const { return state_.T_map_odom; }
  /// The newest sample in the frame of the first one, whatever has jumped since.
  [[nodiscard]] const Pose3& T_odom_body() const { return state_.T_odom_body; }
  [[nodiscard]] OdometryWatch watch() const { return OdometryWatch(state_.watch); }
  /// The newest sample as it was fed (before jumps are removed).
  [[nodiscard]] const std::optional<StampedPose>& newest_fed() const { return state_.watch.newest; }
  /// Maps the frame of what is fed now, which is another one after each jump, to `odom`; the identity before the first
  /// jump.
  [[nodiscard]] Pose3 T_odom_fed() const { return watch().T_odom_fed(); }
  /// The corrected pose at the newest odometry sample: T_map_odom * T_odom_body. It jumps when receive() corrects.
  [[nodiscard]] Pose3 T_map_body() const { return state_.T_map_odom * state_.T_odom_body; }
  /// Covariance of T_map_body(), right tangent, as seen from the first sample, where `map` begins. It grows with
  /// odometry; receive() sets it to what the map and the ledger allow for (map_covariance.hpp).
  [[nodiscard]] const Matrix6d& covariance() const { return state_.covariance; }
  /// The chain's component in the newest proxy graph; nothing when that does not know the chain, or none was received.
  [[nodiscard]] std::optional<std::uint32_t> component() const { return state_.component; }
  [[nodiscard]] const std::vector<Whereabouts>& whereabouts() const { return state_.whereabouts; }
  /// Ties the map to the world of component(), where this robot is now; nothing before the first proxy graph that knows
  /// it. It may jump with either frame, and is not part of the state.
  [[nodiscard]] const std::optional<Pose3>& T_map_world() const { return T_map_world_; }

 private:
  RobotAgent(RobotId robot, const AgentConfig& config, std::unique_ptr<const consistency::ConstraintPolicy> policy,
             AgentState state);
  Status add_odometry(const OdometrySample& sample);
  void add_keyframes();
  void add_keyframe(const KeyframeStep& step, std::uint32_t submap);
  [[nodiscard]] std::vector<consistency::RobotNode> nodes() const;
  [[nodiscard]] Matrix6d covariance_by(const ProxyGraph& graph) const;
  estimation::Termination optimise();
  void locate_others(const ProxyGraph& graph, std::span<const consistency::RobotNode> own,
                     std::span<const consistency::NodePair> pairs);

  ChainId chain_;
  AgentConfig config_;
  std::unique_ptr<const consistency::ConstraintPolicy> policy_;
  SubmapBuilder submaps_;
  estimation::OnboardSmoother smoother_;
  AgentState state_;  // without the state of submaps_ and smoother_
  std::vector<OdometryJump> jumps_;
  FitWatch fit_;  // of the state only what a start does without
  std::optional<Pose3> T_map_world_;
};

}  // namespace tutti::robot
