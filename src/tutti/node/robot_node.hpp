// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/model/status.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/uplink.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node {

struct RobotNodeConfig {
  robot::AgentConfig agent;
  /// Remember everything in the store, at the price of writing it. Without, a robot that starts again is a new one.
  bool keeps_state = true;
  std::string name;  ///< Empty: "robot_7".
  UplinkConfig uplink;
  /// Of submaps that the server has named as stored or refused: kept in case its map loses them, the newest. 0: none.
  std::uint64_t max_archive_bytes = std::uint64_t{1} << 30U;
  /// Odometry and scans are written together, at most this much mission time after the first of them: a kill loses no
  /// more, and the disk is not asked at every sample.
  double journal_period_s = 0.5;
  std::uint64_t most_keyframes_without = 20;  ///< Scan or images; then SensorMissing is told.
  std::uint64_t most_refused_samples = 20;    ///< In a row; then status() says so.
  double jump_told_s = 600.0;                 ///< So long status() says that odometry has jumped.
};

/// A robot round RobotAgent: odometry, scans and proxy graphs in; submaps out, and kept until the server has stored
/// them, and longer, in case its map loses them: what a server names no more when it has started again is sent again.
/// Its store (storage::robot_schema()) holds the agent's state when the last submap ended, what it has heard since, and
/// the submaps. Whoever can feed odometry and scans again, as a replay can,
/// does so after a start from agent().newest_sample() on, of that one the scan too: then nothing is lost.
class RobotNode {
 public:
  /// On an empty store a new chain of this session, which is larger than any before (ChainId); otherwise the robot goes
  /// on as if nothing had happened, with the same configuration and randomness as then. A state that cannot be read, of
  /// another version for one, is deleted: the robot begins a session after all before, keeps its outbox, and says so
  /// (StateLost). An error: the store cannot be read, or is another robot's. The store must outlive the node.
  static Result<std::unique_ptr<RobotNode>> open(RobotId robot, std::uint64_t session, const RobotNodeConfig& config,
                                                 Rng rng, const storage::TableStore& store);

  /// The first step after every start.
  Step resume(Timestamp now);
  /// RobotAgent::expect_sensors(); it is not stored, and is to be said again after every start.
  void expect_sensors(bool scans, bool images) { agent_.expect_sensors(scans, images); }
  /// RobotAgent::add_odometry(), add_scan(), add_images(), finish(); what it refuses is told as an event. One that
  /// comes again, as after a restart, is refused or changes nothing.
  Step add_odometry(const OdometrySample& sample, Timestamp now);
  Step add_scan(const Scan& scan, Timestamp now);
  Step add_images(const TrackedImages& images, Timestamp now);
  Step finish(Timestamp now);
  /// Writes what waits to be written, as before a planned end.
  Step store_all();
  /// What it has been told is in the store, once its steps are carried out.
  [[nodiscard]] bool is_stored() const { return unwritten_.empty(); }
  /// What has come to the robot. `budget`: for policies that need one.
  Step receive(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget = std::nullopt);
  /// The newest graph that the robot would know with this message; nothing: none, or one in terms of a graph that has
  /// not come. An error: garbage.
  [[nodiscard]] Result<std::optional<ProxyGraphMessage>> graph_in(const bus::Envelope& envelope) const;
  /// When on_timer() is to be called next: for what waits to be written or sent.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  /// Does what is due; otherwise nothing.
  Step on_timer(Timestamp now);
  /// Told when each stage of an update ends, for whoever has a clock.
  void observe(robot::StageObserver observer) { observer_ = std::move(observer); }

  /// How it is, but for what the host knows: version, trouble.
  [[nodiscard]] NodeStatus status(Timestamp now) const;
  /// Why the server says that another program owns this robot's name or number; nothing: it does not say so of this
  /// session and start.
  [[nodiscard]] const std::optional<std::string>& conflict() const { return conflict_; }
  /// What the server was last heard to say of whose they are.
  [[nodiscard]] std::optional<std::uint64_t> owner_session() const { return owner_session_; }

  [[nodiscard]] const robot::RobotAgent& agent() const { return agent_; }
  /// The newest graph that has come since the start speaks of all that the robot can be told of: of its last
  /// representative keyframe.
  [[nodiscard]] bool is_whole_in_map() const;
  /// Submaps that the server is known to have stored or refused, as many as may be kept, with the bytes of each.
  [[nodiscard]] const std::map<SubmapId, std::size_t>& archive() const { return archive_; }
  /// Submaps that the server is not known to have stored, with the bytes of each.
  [[nodiscard]] const std::map<SubmapId, std::size_t>& backlog() const { return uplink_.submaps(); }

 private:
  RobotNode(RobotId robot, const RobotNodeConfig& config, Rng rng, robot::AgentState state,
            const storage::TableStore& store)
      : config_(config), store_(store), agent_(robot, config.agent, std::move(rng), std::move(state)) {}

  static Result<std::uint64_t> newest_session(const storage::TableStore& store);
  Status hear_again(const JournalEntry& entry);
  Status read_outbox();
  void remember(const JournalEntry& entry, Timestamp now, Step& step);
  void write_journal(Step& step);
  /// Takes submaps that have ended; then the journal may go.
  void take_outgoing(Timestamp now, Step& step);
  void save_checkpoint(Step& step);
  using Frames = std::map<SubmapId, std::shared_ptr<const std::string>>;
  /// What may go now; `fresh`: what is not in the store yet.
  void send_submaps(Timestamp now, const Frames& fresh, Step& step);
  void receive_graph(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget, Step& step);
  /// After each input: what became of it that was not told at once.
  void settle(Timestamp now, Step& step);
  [[nodiscard]] bool is_refused_as_it_is(SubmapId id, const Receipt& receipt) const;
  [[nodiscard]] std::string odometry_trouble(Timestamp now) const;
  void note_conflict(const Receipt& receipt, Timestamp now, Step& step);
  void note(const robot::UpdateSummary& summary);
  void receive_receipt(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// What the server of another start does not name goes again.
  void note_start(const Receipt& receipt, Timestamp now, Step& step);
  void archive(SubmapId id, Step& step);
  void remember_incarnations(Step& step) const;
  /// Told, and, where it is of a version that this program does not read, kept for status().
  void refuse(const bus::Envelope& envelope, const Error& error, Timestamp now, Step& step);
  [[nodiscard]] bus::Envelope submap_envelope(SubmapId id, std::shared_ptr<const std::string> frame) const;

  RobotNodeConfig config_;
  const storage::TableStore& store_;
  robot::RobotAgent agent_;
  robot::StageObserver observer_;
  Uplink uplink_{config_.uplink};            // of what is in the outbox
  std::map<SubmapId, std::size_t> archive_;  // with the bytes of each
  std::uint64_t archive_bytes_ = 0;
  std::uint32_t graph_incarnation_ = 0;    // of the last graph
  std::uint32_t receipt_incarnation_ = 0;  // of the last receipt
  struct Unread {
    std::uint64_t count = 0;
    std::string why;
  };
  std::map<bus::MessageKind, Unread> unread_;  // since the last of the kind that could be read
  std::optional<ProxyGraph> base_;             // the last that came in full
  std::shared_ptr<const std::string> delta_;   // the last that came in terms of one
  std::uint64_t refused_samples_ = 0;          // since the last that was taken
  std::string why_refused_;
  std::uint64_t jumps_ = 0;                                               // since the start
  std::optional<std::pair<Timestamp, robot::OdometryJump>> newest_jump_;  // when it was told
  bool tells_no_scan_ = false, tells_no_images_ = false;
  std::uint64_t journal_ = 0;           // entries since the checkpoint that are written
  std::vector<std::string> unwritten_;  // and those that are not
  Timestamp unwritten_since_;
  wire::StoredState stored_;           // of the agent, in the checkpoint
  std::vector<std::string> obsolete_;  // rows of the checkpoint, until the next one
  std::optional<std::string> why_lost_;
  bool is_new_ = false;      // there is no checkpoint yet
  std::uint64_t start_ = 1;  // of all on this store
  bool finished_ = false;
  std::optional<Timestamp> updated_;
  std::pair<std::uint64_t, std::uint64_t> mapped_age_;  // of the newest graph since the start,
  Timestamp mapped_until_ = kFirstTimestamp;            // and the last own node in it
  std::uint64_t alerts_ = 0;                            // after the last update
  std::optional<std::string> conflict_;
  std::optional<std::uint64_t> owner_session_;
};

}  // namespace tutti::node
