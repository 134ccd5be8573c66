// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "tutti/node/journal.hpp"
#include "tutti/node/step.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::node {

struct RobotNodeConfig {
  robot::AgentConfig agent;
  /// Remember everything in the store, at the price of writing it. Without, a robot that starts again is a new one.
  bool keeps_state = true;
};

/// A robot round RobotAgent: odometry, scans and proxy graphs in; submaps out, and kept until the server has stored
/// them. Its store (storage::robot_schema()) holds the agent's state when the last submap ended, what it has heard
/// since, and the submaps that are not known to be stored.
class RobotNode {
 public:
  /// On an empty store a new chain of this session, which is larger than any before (ChainId); otherwise the robot goes
  /// on as if nothing had happened, with the same configuration and randomness as then. An error: what is stored is no
  /// state, or another robot's.
  static Result<std::unique_ptr<RobotNode>> open(RobotId robot, std::uint64_t session, const RobotNodeConfig& config,
                                                 Rng rng, const storage::TableStore& store);

  /// The first step after every start.
  Step resume(Timestamp now);
  /// RobotAgent::add_odometry(), add_scan(), finish(); what it refuses is told as an event. One that comes again, as
  /// after a restart, is refused or changes nothing.
  Step add_odometry(const OdometrySample& sample, Timestamp now);
  Step add_scan(const Scan& scan, Timestamp now);
  Step finish(Timestamp now);
  /// What has come to the robot. `budget`: for policies that need one.
  Step receive(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget = std::nullopt);
  /// Told when each stage of an update ends, for whoever has a clock.
  void observe(robot::StageObserver observer) { observer_ = std::move(observer); }

  [[nodiscard]] const robot::RobotAgent& agent() const { return agent_; }
  /// Submaps that the server is not known to have stored.
  [[nodiscard]] const std::set<SubmapId>& backlog() const { return outbox_; }

 private:
  RobotNode(RobotId robot, const RobotNodeConfig& config, Rng rng, robot::AgentState state)
      : config_(config), agent_(robot, config.agent, std::move(rng), std::move(state)) {}

  Status hear_again(const JournalEntry& entry);
  Status read_outbox(const storage::TableStore& store);
  void remember(const JournalEntry& entry, Step& step);
  /// Takes submaps that have ended; then the journal may go.
  void take_outgoing(Timestamp now, Step& step);
  void save_checkpoint(Step& step);
  void receive_graph(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget, Step& step);
  void receive_receipt(const bus::Envelope& envelope, Timestamp now, Step& step);
  [[nodiscard]] bus::Envelope submap_envelope(SubmapId id, std::shared_ptr<const std::string> frame) const;

  RobotNodeConfig config_;
  robot::RobotAgent agent_;
  robot::StageObserver observer_;
  std::set<SubmapId> outbox_;
  std::map<SubmapId, std::string> unsent_;  // found in the store; sent by resume()
  std::optional<Timestamp> last_scan_;      // since the checkpoint
  std::uint64_t journal_ = 0;               // entries since the checkpoint
  bool is_new_ = false;                     // there is no checkpoint yet
};

}  // namespace tutti::node
