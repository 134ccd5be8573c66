// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/node/answered_words.hpp"
#include "tutti/node/broadcast.hpp"
#include "tutti/node/job_book.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/receipts.hpp"
#include "tutti/node/refinement_queue.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/stored_rows.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/node/worker_roster.hpp"
#include "tutti/server/closure_names.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::node {

struct OpenedMap;

struct ServerNodeConfig {
  server::ServerConfig server;
  std::size_t pairs_per_job = 256;  ///< At most: what one worker does before others can help.
  /// When no answer has come for so long, in mission seconds, the pairs of a job are asked again, as a new job; every
  /// further time the wait is twice as long. A job that waits behind others begins to count when the last of those
  /// was answered. 0: pairs are never asked again.
  double job_timeout_s = 600.0;
  /// A pair that no worker can verify is refused after so many tries. The second try comes after a tenth of
  /// job_timeout_s, every further one after twice as long; without a timeout it comes with the next submap.
  unsigned most_tries = 4;
  std::shared_ptr<const server::MapRefiner> refiner;  ///< Null: the map is its pose graph's.
  /// A random number of this start (ProxyGraph::incarnation), by which robots see that the map may be another one: they
  /// send again what it lacks.
  std::uint32_t incarnation = 0;
  /// Robots that the server was not told of become the mission's with their first submap, up to
  /// ProxyGraph::kMostChains.
  bool accepts_others = false;
};

/// The mapping server round MapServer: submaps, verdicts and operators' words in; receipts, jobs and proxy graphs out.
/// Its store is the map (storage::map_schema()): submaps, verdicts and words as they came, and what became of the other
/// pairs; all else is computed from these. What was sent is never ahead of what is stored, so a server that starts
/// again on its own store keeps its epoch.
class ServerNode {
 public:
  /// On an empty store a new map of this epoch, which is larger than any before (server::MapServer); otherwise the map
  /// that is stored goes on. The store must outlive the node. An error: it holds something else than a map.
  static Result<std::unique_ptr<ServerNode>> open(std::set<RobotId> robots,
                                                  std::shared_ptr<const server::ClosureFinder> finder,
                                                  const ServerNodeConfig& config, std::uint64_t epoch,
                                                  const storage::TableStore& store);

  /// The first step after every start: receipts, and what is to be verified. The map is not computed yet; next_timer()
  /// says when on_timer() does, which may be at once, and what comes before is taken.
  Step resume(Timestamp now);
  /// What has come to the server. A submap that it will never take is in the robot's receipt as refused, one of a
  /// version that it does not read as unread. A second robot with a name or number that is in use (RobotRegistry) is
  /// told so by the receipt, and its submaps are taken, but what is sent to that number is the owner's.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// In place of receive(), for what the host does not hand in (program/host.hpp): told, and counted as refused.
  Step put_aside(const bus::Envelope& envelope, const std::string& why, Timestamp now);
  /// When on_timer() is to be called next; nothing while there is no news and every job is answered.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  /// Optimises the map and asks again when it is time; otherwise does nothing.
  Step on_timer(Timestamp now);

  /// All that is known of the mission, but for what the host knows: version, wall_ns, trouble.
  [[nodiscard]] MissionStatus mission_status(Timestamp now) const;
  /// Grows when it should be sent before its time.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  [[nodiscard]] const server::MapServer& map_server() const { return server_; }
  /// False after a start, until the first update: mission_status() says what the last one before it made.
  [[nodiscard]] bool has_map() const { return has_map_; }
  [[nodiscard]] const ProxyGraph& broadcast() const { return broadcast_.last(); }  ///< The last one; empty before.

 private:
  ServerNode(std::set<RobotId> robots, std::shared_ptr<const server::ClosureFinder> finder,
             const ServerNodeConfig& config, std::uint64_t epoch, std::shared_ptr<SubmapFrames> frames,
             OpenedMap opened);

  /// Told, and counted.
  void refuse(const bus::Envelope& envelope, const std::string& why, Timestamp now, Step& step);
  void note_refusal(bus::Endpoint::Role from, bus::MessageKind kind, const std::string& why);
  /// It is one of the mission's robots from now on. False: it was before.
  bool admit(RobotId robot);
  /// admit() back: its first submap was none.
  void dismiss(RobotId robot, Timestamp now);
  /// Why it cannot become one of the mission's robots; empty: it is one, or can.
  [[nodiscard]] std::string objection_to(RobotId robot) const;
  void receive_status(const bus::Envelope& envelope, Timestamp now, Step& step);
  void refuse_robot(const bus::Envelope& envelope, const NodeStatus& status, const std::string& why, Timestamp now,
                    Step& step);
  [[nodiscard]] std::set<RobotId> strangers_there(Timestamp now) const;
  void receive_status_of_robot(RobotId robot, const NodeStatus& status, Timestamp now, Step& step);
  Status take_submap(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// For good: the robot need not send it again.
  void note_refused(SubmapId id, const bus::Envelope& envelope, const std::string& why, Timestamp now, Step& step);
  /// Receipts::of_anybody()
  [[nodiscard]] Receipt* receipt_of(RobotId robot, Timestamp now);
  void send_receipt(Receipt receipt, Step& step) const;
  /// The robot need not send it again before the next start, which may be of a newer version.
  void note_unread(SubmapId id, Timestamp now, Step& step);
  /// Says which rows of the map are left alone.
  void tell_unread_rows(Timestamp now, Step& step);
  void receive_submap(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_returned_job(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_refinement(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_returned_refinement(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_word(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// True: another word on this pair, given later, holds over it.
  Result<bool> take_word(const bus::Envelope& envelope, const ClosureWord& word, Timestamp now, Step& step);
  void note_word(const std::string& frame, const std::string& why);
  /// Those that are stored are answered.
  void recall_words();
  [[nodiscard]] server::ClosureNames closure_names() const;
  void send_copies(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Takes one verdict of these; a refusal that now holds is kept in `refused`.
  Status take(const ClosureVerdict& verdict, Verdicts& refused, Step& step);
  void send_jobs(std::optional<SubmapId> newest, Timestamp now, unsigned asked, std::size_t most_pairs, Step& step);
  /// What the last map wants, if anything.
  void send_refinement_job(Timestamp now, Step& step);
  void ask_for_refinement(RefinementJob job, Timestamp now, unsigned asked, Step& step);
  /// It is asked again later, or given up.
  void note_failed_refinement(const RefinementJob& job, const std::string& why, Timestamp now, Step& step);
  void give_up_refinement(std::uint64_t revision, const std::string& why, Timestamp now, Step& step);
  /// The map has been updated: when all of it is to be refined, if nothing more comes.
  void note_settling(Timestamp now);
  void settle(Timestamp now, Step& step);
  void set_aside(const bus::Envelope& envelope, const std::vector<ClosureVerdict>& verdicts, bool was_open,
                 Timestamp now, Step& step);
  /// The worker that had them has not got the finder: they are asked again when there is one that has.
  void note_waiting(const std::vector<SubmapPair>& pairs, const std::string& why, Timestamp now, Step& step);
  void ask_waiting(Timestamp now, Step& step);
  /// A worker says what it can.
  void receive_status_of_worker(std::uint32_t number, const NodeStatus& status, Timestamp now, Step& step);
  /// No worker could verify it this time: it is asked again later, or refused.
  void note_failed(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step);
  void give_up(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step);
  static void keep(const Verdicts& refused, Step& step);
  void ask_again(Timestamp now, Step& step);
  /// False: a submap of it is not there.
  bool give_back(const SubmapPair& pair);
  void send_receipt(RobotId robot, Step& step) const;
  [[nodiscard]] MapCounts counts() const;
  /// The map has been computed.
  void send_map(ProxyGraphMessage message, Timestamp now, Step& step);
  /// Sets the timer when something new has come, and remembers in the store whether it has.
  void note_news(Timestamp now, bool before, Step& step);
  [[nodiscard]] storage::Write meta() const;

  std::set<RobotId> robots_;
  ServerNodeConfig config_;
  std::shared_ptr<const SubmapFrames> frames_;
  server::MapServer server_;
  Receipts receipts_;
  AnsweredWords words_;
  RobotRegistry registry_;
  std::map<std::string, UnreadRows> unread_rows_;  // by table, until they are told
  WorkerRoster workers_;
  std::map<std::pair<bus::Endpoint::Role, bus::MessageKind>, MissionStatus::Refusals> refusals_;
  std::uint64_t start_ = 0;  // of all on this store; names jobs
  JobBook jobs_;             // of this start
  FailedPairs failed_;
  std::set<SubmapPair> waiting_;  // for a worker that has the finder
  std::string why_waiting_;
  RefinementQueue refinements_;
  std::optional<Timestamp> settle_at_;
  std::uint64_t changes_ = 0;
  bool had_news_ = false;  // when the store was opened
  std::optional<Timestamp> timer_;
  std::optional<Timestamp> compute_at_;  // the map that was there when the store was opened
  std::optional<MapCounts> stored_counts_;
  bool has_map_ = false;
  Broadcast broadcast_{config_.server.broadcast == "all"};
  bool operator_spoke_ = false;  // since the last map
};

}  // namespace tutti::node
