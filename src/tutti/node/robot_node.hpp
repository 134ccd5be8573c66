// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tutti/localise/localiser.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/status.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/node/odometry_gate.hpp"
#include "tutti/node/place_record.hpp"
#include "tutti/node/robot_alert.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/uplink.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node {

/// How a robot's node stores and sends.
struct RobotNodeConfig {
  robot::AgentConfig agent;
  /// Store everything that the robot needs after a restart. Without this a robot that starts again is a new one.
  bool keeps_state = true;
  std::string name;               ///< Empty: default_name(), such as "robot_7".
  std::uint32_t incarnation = 0;  ///< A random number of every start of the program; 0: none.
  UplinkConfig uplink;
  /// Size of the archive: the newest submaps that the server has named as stored or refused, kept in case its map loses
  /// them. 0: none are kept.
  std::uint64_t max_archive_bytes = std::uint64_t{1} << 30U;
  /// Odometry and sensor data are written together, at most this much mission time after the first of them. A kill
  /// loses no more than that, and the disk is not used at every sample.
  double journal_period_s = 0.5;
  /// Keyframes without a scan (or images) after which SensorMissing is reported.
  std::uint64_t most_keyframes_without = 20;
  std::shared_ptr<const localise::Localiser::Setup> localise;  ///< Null: it does not localise in a map.
  /// How long a jump of odometry, or why a session has begun, is an alert; of the robot's own time.
  double alert_s = 600.0;
};

/// A robot as a node: RobotAgent with its store and messages. It takes odometry, sensor data and proxy graphs, and
/// gives submaps. A submap is kept until the server has stored it, and longer in the archive: if the server has started
/// again with a map that lacks it, the submap is sent again.
///
/// The store (storage::robot_schema()) has the agent's state when the last submap ended, what the agent has heard
/// since, and the submaps. After a start, a source that can repeat its data (such as a replay) should repeat it from
/// agent().newest_sample() on, including the scan of that very sample; then nothing is lost.
class RobotNode {
 public:
  /// On an empty store, begins a new chain with this session, or a later one than the store knows. Otherwise the robot
  /// goes on as if it had never stopped; `config` must be as before. A state that cannot be read (for example because
  /// another version wrote it) is set aside in the store: the robot then begins a session after all earlier ones, keeps
  /// its outbox, and reports StateLost. So it does without a state where the row robot_tables::kLost has a reason.
  /// Fails when the store cannot be read or is another robot's. The store must outlive the node.
  static Result<std::unique_ptr<RobotNode>> open(RobotId robot, std::uint64_t session, const RobotNodeConfig& config,
                                                 const storage::TableStore& store);

  /// The first step after every start.
  Step resume(Timestamp now);
  /// RobotAgent::expect_sensors(); not stored, so call it after every start.
  void expect_sensors(bool scans, bool images);
  /// RobotAgent::add(); what the agent refuses is reported as an event. Data that come again, as after a restart, are
  /// refused or change nothing. Odometry passes an OdometryGate: where its clock begins anew, so does the robot
  /// (begin_session()).
  Step add(const Input& input, Timestamp now);
  Step finish(Timestamp now);
  /// Ends the last submap, and begins a session after all earlier ones, in a chain of its own. The outbox is kept.
  /// `why` is for people.
  Step begin_session(const std::string& why, Timestamp now);
  /// Writes everything that waits to be written, for a planned end.
  Step store_all();
  /// True when everything that the robot heard is in the store, once the steps so far are carried out.
  [[nodiscard]] bool is_stored() const { return unwritten_.empty() && !gate_.holds_one(); }
  /// Takes a message that was sent to the robot.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// The newest graph that came since the start, whether or not the robot followed it, and another one whenever one
  /// comes; null when none has come.
  [[nodiscard]] const std::shared_ptr<const ProxyGraphMessage>& newest_graph() const { return newest_; }
  /// When on_timer() is to be called next, to write or send what waits.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  /// Does what is due, if anything.
  Step on_timer(Timestamp now);
  /// `observer` is called when each stage of an update ends, so that a host with a clock can time them.
  void observe(robot::StageObserver observer) { observer_ = std::move(observer); }

  /// Everything that is wrong with the robot and its odometry, the worst last: the status and /diagnostics say that
  /// one. Where odometry and map differ, and which sensor is missing, are events.
  [[nodiscard]] std::vector<RobotAlert> alerts() const;
  /// The robot's status, without what only the host knows: version, trouble.
  [[nodiscard]] NodeStatus status(Timestamp now) const;
  /// Why, by the server, another program owns this robot's name or number; nothing when it does not report so of this
  /// session and start.
  [[nodiscard]] const std::optional<std::string>& conflict() const { return conflict_; }
  /// The same, or that the map has somebody else's submaps in the place of this robot's; empty when neither.
  [[nodiscard]] std::string dispute() const { return conflict_ ? *conflict_ : foreign_; }
  /// The session that owns them, by the last receipt.
  [[nodiscard]] std::optional<std::uint64_t> owner_session() const { return owner_session_; }

  [[nodiscard]] const robot::RobotAgent& agent() const { return agent_; }
  /// Finds the robot in a map; null when it does not localise. Its last place alone is stored: after a start it is
  /// tried first, and then the whole map is searched.
  [[nodiscard]] const localise::Localiser* localiser() const { return localiser_ ? &*localiser_ : nullptr; }
  /// True if a scan of this stamp would be used, by the agent or to localise.
  [[nodiscard]] bool wants_scan(Timestamp stamp) const;
  /// True when the newest graph since the start has the robot's last representative keyframe, so that the map has
  /// nothing more about itself for it.
  [[nodiscard]] bool is_whole_in_map() const;
  /// Submaps that the server has named as stored or refused, as far as the archive keeps them, with their size in
  /// bytes.
  [[nodiscard]] const std::map<SubmapId, std::size_t>& archive() const { return archive_; }
  /// Submaps that the server has not named as stored or refused, with their size in bytes.
  [[nodiscard]] const std::map<SubmapId, std::size_t>& backlog() const { return uplink_.submaps(); }

 private:
  RobotNode(RobotId robot, const RobotNodeConfig& config, robot::AgentState state, const storage::TableStore& store)
      : config_(config), store_(store), agent_(robot, config.agent, std::move(state)), gate_(robot) {
    begin_localising();
  }

  /// Moves the checkpoint and the journal to where nothing reads them, with the next checkpoint.
  Status set_aside(const wire::StateRows& checkpoint, std::uint64_t session);
  Status hear_again(const JournalEntry& entry);
  Status read_outbox();
  /// Takes an input that has passed the gate, or need not.
  void hear(const Input& input, Timestamp now, Step& step);
  /// Tells the localiser, if there is one, and reports when it knows more or less than before.
  void locate(const Input& input, Timestamp now, Step& step);
  void hear(const StartPose& start, Timestamp now, Step& step);
  void tell_place(Timestamp now, Step& step);
  [[nodiscard]] InMap in_map() const;
  void change_floor(std::uint32_t floor, Timestamp now, Step& step);
  void follow(const ProxyGraphMessage& graph, Timestamp now, Step& step);
  void begin_localising();
  Status begin_at_stored_place();
  void remember(const JournalEntry& entry, Timestamp now, Step& step);
  void write_journal(Step& step);
  /// Takes the submaps that have ended, after which the journal can be dropped.
  void take_outgoing(Timestamp now, Step& step);
  void save_checkpoint(Step& step);
  using Frames = std::map<SubmapId, std::shared_ptr<const std::string>>;
  /// Sends the submaps that may go now; `fresh` has frames that are not in the store yet.
  void send_submaps(Timestamp now, const Frames& fresh, Step& step);
  Result<std::shared_ptr<const ProxyGraphMessage>> read_graph(const bus::Envelope& envelope);
  void receive_graph(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// To be called after each input: reports what became of earlier inputs.
  void settle(Timestamp now, Step& step);
  [[nodiscard]] bool is_refused_as_it_is(SubmapId id, const Receipt& receipt) const;
  /// Reports that another program owns what this robot does in this session.
  void refuse(std::uint64_t session, const std::string& why, Timestamp now, Step& step);
  void note_conflict(const Receipt& receipt, Timestamp now, Step& step);
  /// Under these sessions the map has submaps of somebody else, in the place of this robot's.
  void note_foreign(const std::set<std::uint64_t>& sessions, Timestamp now, Step& step);
  /// The session is of another body, too: nothing more is sent of it, and if it is the present one, another begins.
  void leave(std::uint64_t session, const std::string& why, Timestamp now, Step& step);
  void hold_foreign();
  void change_session(const std::string& why, Timestamp now, Step& step);
  /// NodeStatus::start: the number of starts, and in the upper half the program's random number.
  [[nodiscard]] std::uint64_t start() const { return std::uint64_t{config_.incarnation} << 32U | starts_; }
  void note(const robot::UpdateSummary& summary);
  void receive_receipt(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Whether graphs go on and on behind a newer one of the same incarnation, which cannot be: it was nobody's.
  bool goes_on_behind(const ProxyGraph& heard);
  /// The server has started again.
  void note_start(std::uint32_t incarnation, Step& step);
  /// Submaps of the archive that the server does not have after all are to be sent again.
  void take_back(const Receipt& receipt, bool has_started, Timestamp now, Step& step);
  void archive(SubmapId id, bool is_refused, Step& step);
  void remember_incarnations(Step& step) const;
  /// Reports a refused message, and keeps it for status() if this program cannot read its version.
  void refuse(const bus::Envelope& envelope, const Error& error, Timestamp now, Step& step);
  [[nodiscard]] bus::Envelope submap_envelope(SubmapId id, std::shared_ptr<const std::string> frame) const;

  RobotNodeConfig config_;
  const storage::TableStore& store_;
  robot::RobotAgent agent_;
  OdometryGate gate_;  // for what agent_ takes
  std::optional<localise::Localiser> localiser_;
  PlaceRecord places_;
  robot::StageObserver observer_;
  Uplink uplink_{config_.uplink};            // of the submaps in the outbox
  std::map<SubmapId, std::size_t> archive_;  // with their sizes
  std::set<SubmapId> refused_;               // among these
  std::uint64_t archive_bytes_ = 0;
  std::uint32_t graph_incarnation_ = 0;    // in the last graph
  std::uint32_t receipt_incarnation_ = 0;  // in the last receipt
  struct Unread {
    std::uint64_t count = 0;
    std::string why;
  };
  std::map<bus::MessageKind, Unread> unread_;               // since the last one of the kind that could be read
  std::shared_ptr<const ProxyGraphMessage> base_, newest_;  // the last graph that came in full, and the last of any
  std::shared_ptr<const std::string> delta_;                // the last message that gave differences from base_
  struct Jumps {
    std::uint64_t count = 0;                    // since the start
    std::optional<robot::OdometryJump> newest;  // of the session
  };
  Jumps jumps_;
  bool tells_no_scan_ = false, tells_no_images_ = false;
  std::uint64_t journal_ = 0;           // number of entries since the checkpoint that are written
  std::vector<std::string> unwritten_;  // and the entries that are not
  Timestamp unwritten_since_;
  wire::StoredState stored_;           // of the agent, in the checkpoint
  std::set<std::string> rows_;         // keys of the checkpoint
  std::vector<std::string> obsolete_;  // rows of the checkpoint, until the next one
  std::vector<storage::Write> aside_;  // what could not be read, likewise
  std::optional<std::string> why_lost_;
  std::string why_begun_;     // of the session; empty: it is the first
  bool is_new_ = false;       // there is no checkpoint yet
  std::uint64_t starts_ = 1;  // number of starts on this store
  bool finished_ = false;
  std::optional<Timestamp> updated_;
  std::pair<std::uint64_t, std::uint64_t> mapped_age_;  // ProxyGraph::age() of the newest graph since the start,
  std::pair<std::uint64_t, std::uint64_t> older_age_;   // of the newest of those that came behind a newer one,
  unsigned older_ = 0;                                  // and how many these are, each newer than the one before
  Timestamp mapped_until_ = kFirstTimestamp;            // and the stamp of the last own node in it
  std::uint64_t alerts_ = 0;                            // of the last update
  std::optional<std::string> conflict_;
  Timestamp disputed_;                        // the newest sample when it was said last that it is refused
  std::set<std::uint64_t> foreign_sessions_;  // that are of another body, too
  std::string foreign_;                       // that submaps of these wait for ever; else empty
  std::optional<std::uint64_t> owner_session_;
};

}  // namespace tutti::node
