// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::mission {

/// One robot of a mission: replays its recording into an agent with the default policy, which talks to the server, and
/// into shadow agents with the policies that the mission compares, which hear the same broadcasts but are never heard.
class RobotActor {
 public:
  /// `policies`: all that run, the default one (config.policy.name) among them.
  RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
             const std::vector<std::string>& policies, const evaluation::AssociationConfig& association, Rng rng);

  /// Mission time of the next sample; infinity when there is none left.
  [[nodiscard]] double next_time() const;
  [[nodiscard]] bool has_scans() const { return recording_.recording.scans != nullptr; }
  /// Replays one odometry sample and its scan; after the last one the default agent closes its last submap.
  void replay_next();
  /// Closes the last submap before the recording ends.
  void finish() { default_agent().finish(); }
  /// Submaps of the default agent that are ready to be sent.
  std::vector<SubmapMessage> take_outgoing();
  /// The budget of policies that need one is what the policy `spectral` holds after the same broadcast.
  void receive(const ProxyGraphMessage& message, double time_s);

  [[nodiscard]] const MissionRecording& recording() const { return recording_; }
  [[nodiscard]] RobotId id() const { return recording_.recording.robot; }
  [[nodiscard]] RobotOutcome outcome() const;
  [[nodiscard]] const std::vector<UpdateRecord>& updates() const { return updates_; }
  /// Of the default agent's last update: its raw odometry against the map.
  [[nodiscard]] const std::optional<consistency::Explanation>& explanation() const { return explanation_; }
  [[nodiscard]] std::vector<PolicyTiming> timing() const;
  [[nodiscard]] double cpu_s() const { return cpu_s_; }  ///< Of the default agent.
  /// What went wrong (bad samples or scans refused, updates without a correction): one line per kind with a count and
  /// the first case.
  [[nodiscard]] std::vector<std::string> troubles() const;
  /// Fails when scans were asked for and all of them failed.
  [[nodiscard]] Status check_scans() const;

 private:
  struct Member {
    std::string policy;
    robot::RobotAgent agent;
    PolicyTiming timing;
  };
  struct Trouble {
    std::size_t count = 0;
    std::string first;
  };

  robot::RobotAgent& default_agent() { return members_[default_].agent; }
  void update(Member& member, const ProxyGraphMessage& message, std::optional<std::size_t> budget, double time_s);
  /// How far every estimate is from the reference at the nodes of the broadcast.
  void score(const Trajectory& map, UpdateRecord& update) const;
  void feed_scan(std::size_t sample);
  static void note(Trouble& trouble, const std::string& message);

  const MissionRecording& recording_;
  const evaluation::AssociationConfig& association_;
  std::vector<Member> members_;  // `spectral` first, if it is there: it sets the budget
  std::size_t default_ = 0;
  std::size_t next_ = 0;
  std::vector<UpdateRecord> updates_;
  std::optional<consistency::Explanation> explanation_;
  double cpu_s_ = 0.0;
  Trouble refused_odometry_;
  Trouble refused_scans_;
  std::size_t taken_scans_ = 0;
  Trouble failed_updates_;
};

}  // namespace tutti::mission
