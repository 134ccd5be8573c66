// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/image_tally.hpp"
#include "tutti/mission/load_meter.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mission {

/// Time zero of virtual time, which is never compared with robots' own stamps.
inline constexpr Timestamp kMissionStart{0};

/// Agents that hear what a robot's node hears and are never heard: they show what other policies make of the same
/// broadcasts.
class Companions {
 public:
  virtual ~Companions() = default;
  virtual void add(const OdometrySample& sample) = 0;
  /// The robot's node has made a keyframe at a time between two samples.
  virtual void add_keyframe_time(Timestamp stamp) = 0;
  /// Called after the node has received the graph; `own` is the node's agent.
  virtual void receive(const ProxyGraphMessage& message, const robot::RobotAgent& own) = 0;
  /// The agents (timings), by policy.
  [[nodiscard]] virtual std::vector<std::pair<std::string, const robot::RobotAgent*>> agents() const = 0;
  [[nodiscard]] virtual std::vector<PolicyTiming> timing() const = 0;
};

/// The settings of an agent that replays a recording: `config`, with the sensors that the recording has.
robot::AgentConfig with_sensors(robot::AgentConfig config, const Recording& recording);

/// Measures how long the stages of an update take.
class UpdateStopwatch {
 public:
  explicit UpdateStopwatch(PolicyTiming& timing) : timing_(timing) {}
  void stage_ended(robot::UpdateStage stage);
  void update_ended() { timing_.update_ms.push_back(whole_.lap_ms()); }

 private:
  PolicyTiming& timing_;
  Stopwatch whole_, stage_;
};

/// One robot of a mission: replays its recording into a node, which talks to the server. What becomes of the robot is
/// collected from its node's events.
class RobotActor {
 public:
  /// `companions` may be null, and `localise` is, unless the robot localises in a map.
  RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
             const evaluation::AssociationConfig& association, std::unique_ptr<Companions> companions,
             std::shared_ptr<const localise::Localiser::Setup> localise = nullptr);
  /// A robot that may be killed: its node keeps its state in `store`, which must outlive the actor, and goes on where
  /// the recording stopped. It has no companions.
  static Result<std::unique_ptr<RobotActor>> open(const MissionRecording& recording,
                                                  const node::RobotNodeConfig& config,
                                                  const evaluation::AssociationConfig& association,
                                                  std::uint64_t session, const storage::TableStore& store);
  /// To be called first on an actor made by open(): takes the node's first step.
  void resume(Timestamp now);
  /// RobotNode::on_timer()
  void on_timer(Timestamp now) { take(node_->on_timer(now)); }

  /// Mission time of the next sample; infinity when none is left.
  [[nodiscard]] double next_time() const;
  /// True if the next sample may be more work than a pose.
  [[nodiscard]] bool has_sensors() const { return recording_.recording.scans || recording_.recording.visual; }
  /// Replays one odometry sample with the sensor data up to it; after the last one the node ends its last submap.
  void replay_next(Timestamp now);
  /// Where somebody says that it is in the map that it localises in.
  void start_at(const StartPose& start, Timestamp now) { take(node_->add(start, now)); }
  void store_all() { take(node_->store_all()); }
  /// Ends the last submap before the recording ends.
  void finish(Timestamp now) { take(node_->finish(now)); }
  void receive(const bus::Envelope& envelope, Timestamp now);
  /// What the node has to send and report since the last call.
  node::Step take_step() { return std::exchange(step_, {}); }

  [[nodiscard]] const MissionRecording& recording() const { return recording_; }
  [[nodiscard]] const node::RobotNode& node() const { return *node_; }
  [[nodiscard]] RobotId id() const { return recording_.recording.robot; }
  [[nodiscard]] RobotOutcome outcome() const;
  [[nodiscard]] const std::vector<UpdateRecord>& updates() const { return updates_; }
  /// Raw odometry against the map, at the node's last update.
  [[nodiscard]] const std::optional<consistency::Explanation>& explanation() const { return explanation_; }
  [[nodiscard]] std::vector<PolicyTiming> timing() const;
  [[nodiscard]] const PolicyTiming& own_timing() const { return timing_; }  ///< The node's, the first of timing().
  [[nodiscard]] double cpu_s() const { return cpu_s_; }                     ///< The node's.
  /// What went wrong (samples or scans refused, updates without a correction): one line per kind, with a count and the
  /// first case.
  [[nodiscard]] std::vector<std::string> troubles() const;
  /// In what its scans contradict its odometry (note_misfit()).
  [[nodiscard]] const std::vector<fit::Misfit>& misfits() const { return misfits_; }
  /// Fails when scans were asked for and all of them failed.
  [[nodiscard]] Status check_scans() const;
  /// Why images were refused first; empty when none were.
  [[nodiscard]] const std::string& refused_images() const { return refused_images_.first; }

 private:
  struct Trouble {
    std::size_t count = 0;
    std::string first;
  };

  RobotActor(const MissionRecording& recording, const evaluation::AssociationConfig& association, std::string policy)
      : recording_(recording),
        association_(association),
        policy_(std::move(policy)),
        timing_{.robot = recording.recording.name, .policy = policy_} {}

  /// By policy, the node's own first.
  [[nodiscard]] std::vector<std::pair<std::string, const robot::RobotAgent*>> agents() const;
  void take(node::Step step);
  void note_event(const node::Event& event);
  void note_update(const node::RobotUpdated& update, Timestamp time);
  /// Measures the stages of an update, and the whole if there is anything to compare.
  void update(const bus::Envelope& envelope, Timestamp now);
  /// Scores every estimate against the reference at the nodes of the broadcast.
  void score(const Trajectory& map, UpdateRecord& update) const;
  /// Feeds sensor data up to the last odometry sample.
  void feed_sensors(Timestamp now);
  void feed_at(Timestamp stamp, bool has_scan, bool has_images, Timestamp now);
  void feed_scan(Timestamp now);
  void feed_images(Timestamp stamp, bool keyframe, Timestamp now);
  void refuse_images(const std::vector<Error>& errors, Timestamp now);
  void report_refused(const std::string& why, Timestamp now);
  [[nodiscard]] std::vector<ImuSample> imu_since_keyframe(Timestamp stamp) const;
  static void note(Trouble& trouble, const std::string& message);

  const MissionRecording& recording_;
  const evaluation::AssociationConfig& association_;
  std::unique_ptr<const storage::TableStore> nothing_;  // for a robot that nobody kills
  std::unique_ptr<node::RobotNode> node_;
  node::Step step_;
  std::unique_ptr<Companions> companions_;
  std::string policy_;  // the node's
  PolicyTiming timing_;
  std::size_t next_ = 0;  // odometry sample
  std::size_t next_scan_ = 0, next_images_ = 0, next_measured_ = 0;
  std::vector<UpdateRecord> updates_;
  std::optional<consistency::Explanation> explanation_;
  double cpu_s_ = 0.0;
  Trouble refused_samples_;
  Trouble jumps_;
  std::vector<fit::Misfit> misfits_;
  Trouble refused_scans_;
  std::size_t taken_scans_ = 0;
  Trouble refused_images_;
  Trouble missing_sensors_;
  Trouble refused_fixes_;
  bool images_fail_ = false;  // at the last sample
  ImageTally sight_;
  Trouble failed_updates_;
};

}  // namespace tutti::mission
