// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/drive/replay.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/troubles.hpp"
#include "tutti/storage/memory_store.hpp"

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

/// One robot of a mission in virtual time, which nobody kills: its recording is replayed into a node, which talks to
/// the server. The robot's outcome is collected from its node's events.
class RobotActor {
 public:
  /// `companions` may be null, and `localise` is, unless the robot localises in a map.
  RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
             const evaluation::AssociationConfig& association, std::unique_ptr<Companions> companions,
             std::shared_ptr<const localise::Localiser::Setup> localise = nullptr);

  /// Mission time of the next sample; infinity when none is left.
  [[nodiscard]] double next_time() const { return replay_.next_time(); }
  /// True if the next sample may be more work than a pose.
  [[nodiscard]] bool has_sensors() const { return recording_.recording.scans || recording_.recording.visual; }
  /// Replay::feed_next()
  void replay_next(Timestamp now);
  /// Where somebody says that it is in the map that it localises in.
  void start_at(const StartPose& start, Timestamp now);
  /// Ends the last submap before the recording ends.
  void finish(Timestamp now);
  void receive(const bus::Envelope& envelope, Timestamp now);
  /// The node's messages and events since the last call.
  node::Step take_step() { return std::exchange(step_, {}); }

  [[nodiscard]] const MissionRecording& recording() const { return recording_; }
  [[nodiscard]] const node::RobotNode& node() const { return driver_.node(); }
  [[nodiscard]] RobotId id() const { return recording_.recording.robot; }
  [[nodiscard]] RobotOutcome outcome() const;
  [[nodiscard]] const std::vector<UpdateRecord>& updates() const { return updates_; }
  /// Raw odometry against the map, at the node's last update.
  [[nodiscard]] const std::optional<consistency::Explanation>& explanation() const { return explanation_; }
  /// The node's first.
  [[nodiscard]] std::vector<PolicyTiming> timing() const;
  [[nodiscard]] double cpu_s() const { return driver_.cpu_s(); }  ///< The node's.
  /// The robot's troubles (samples or scans refused, updates without a correction): one line per kind, with a count and
  /// the first case.
  [[nodiscard]] std::vector<std::string> troubles() const;
  /// In what its scans contradict its odometry (note_misfit()).
  [[nodiscard]] const std::vector<fit::Misfit>& misfits() const { return misfits_; }
  /// Fails when scans were asked for and all of them failed.
  [[nodiscard]] Status check_scans() const;
  /// Why images were refused first; empty when none were.
  [[nodiscard]] std::string refused_images() const { return troubles_.of("images_refused").first; }

 private:
  /// Takes what the driver's last call made, and notes what it says.
  void note_step();
  void note(const node::RobotUpdated& update, Timestamp time);

  const MissionRecording& recording_;
  const evaluation::AssociationConfig& association_;
  storage::MemoryStore nothing_{storage::robot_schema()};
  drive::Driver driver_;
  drive::Replay replay_;
  node::Step step_;
  std::unique_ptr<Companions> companions_;
  PolicyTiming timing_;
  std::vector<UpdateRecord> updates_;
  std::optional<consistency::Explanation> explanation_;
  std::vector<fit::Misfit> misfits_;
  Troubles troubles_;
};

}  // namespace tutti::mission
