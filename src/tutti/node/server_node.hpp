// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/model/map_mark.hpp"
#include "tutti/node/answered_decisions.hpp"
#include "tutti/node/broadcast.hpp"
#include "tutti/node/job_book.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/map_task.hpp"
#include "tutti/node/place_book.hpp"
#include "tutti/node/receipts.hpp"
#include "tutti/node/refinement_queue.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/stored_rows.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/node/update_pacer.hpp"
#include "tutti/node/worker_roster.hpp"
#include "tutti/server/closure_names.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::node {

struct OpenedMap;

/// How a server's node asks workers, and which robots it accepts.
struct ServerNodeConfig {
  server::ServerConfig server;
  std::size_t pairs_per_job = 256;  ///< At most this many, so that a queue can be shared between workers.
  /// After so long without an answer, in mission seconds, the pairs of a job are asked again as a new job; each further
  /// time after twice as long. A job's time begins when the last job before it was answered. 0: pairs are never asked
  /// again.
  double job_timeout_s = 600.0;
  /// A pair that no worker can verify is refused after so many tries. The second try comes after a tenth of
  /// job_timeout_s, each further one after twice as long; without a timeout it comes with the next submap.
  unsigned most_tries = 4;
  std::shared_ptr<const server::MapRefiner> refiner;  ///< Null: the map is not refined.
  /// A random number of this start (ProxyGraph::incarnation). By it robots notice that the map may be another one, and
  /// send again what the map lacks.
  std::uint32_t incarnation = 0;
  /// Robots that the server does not know join the mission with their first submap, up to ProxyGraph::kMostChains
  /// robots.
  bool accepts_others = false;
  /// Why the robot of this number cannot be called so, by what the bus proves; empty text: it can. Empty: nothing is
  /// proved.
  std::function<std::string(RobotId, const std::string&)> name_objection = {};
  /// The server's clock, since the Unix epoch: no decision counts as later than it came. Empty: decisions count from
  /// when their operators say.
  std::function<std::int64_t()> wall_ns = {};
  std::vector<std::string> names =
      {};  ///< The names of the mission's robots, by number: so one is called until it is heard.
};

/// The server as a node: MapServer with its store and messages. It takes submaps, verdicts and operators' decisions,
/// and gives receipts, jobs and proxy graphs. The store is the map (storage::map_schema()): submaps, verdicts and
/// decisions as they came, and the outcome for all other pairs; everything else is computed from these. It sends
/// nothing newer than what is stored, so a server that starts again on its own store keeps its epoch.
class ServerNode {
 public:
  /// On an empty store, begins a new map of this epoch, which must be larger than any before (server::MapServer);
  /// otherwise goes on with the stored map, whose robots are of the mission, too. Fails when the store has something
  /// other than a map. The store must outlive the node.
  static Result<std::unique_ptr<ServerNode>> open(std::set<RobotId> robots,
                                                  std::shared_ptr<const server::ClosureVerifier> verifier,
                                                  const ServerNodeConfig& config, std::uint64_t epoch,
                                                  const storage::TableStore& store);

  /// The first step after every start: receipts, and the pairs that are to be verified. The map is not computed in it,
  /// but by on_timer() at next_timer(), which may be at once; messages are accepted before.
  Step resume(Timestamp now);
  /// Takes a message that was sent to the server. The receipt then lists a submap that is refused for good as refused,
  /// and one of a version that cannot be read as unread. A second program with a name or number in use (RobotRegistry)
  /// learns so from the receipt; its submaps are taken, but what is sent to the number is for the owner.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// Instead of receive(), for messages that the host does not pass on (program/host.hpp): reports and counts them as
  /// refused.
  Step put_aside(const bus::Envelope& envelope, const std::string& why, Timestamp now);
  /// When on_timer() is to be called next; nothing while there is no news and every job is answered. While a map is
  /// made, no other one is due.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  /// Makes the map and asks workers again, when it is time for either: tend(), begin_map(), make_map() and end_map().
  Step on_timer(Timestamp now);
  /// Does what is due except making a map.
  Step tend(Timestamp now);
  /// The map that is due, if no other one is being made. The node takes all that comes until its end_map(), on which no
  /// receipt waits; what comes is in the next map. A node that ends before has news when it starts again.
  std::optional<MapTask> begin_map(Timestamp now);
  /// Takes what make_map() has made of the task that was begun.
  Step end_map(MapOfTask made, Timestamp now);
  [[nodiscard]] bool is_making_map() const { return is_making_map_; }

  /// Everything known of the mission, without what only the host knows: version, wall_ns, trouble.
  [[nodiscard]] MissionStatus mission_status(Timestamp now) const;
  /// A counter that grows when mission_status() should be sent before its time.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  [[nodiscard]] const server::MapServer& map_server() const { return server_; }
  /// Those that robots have reported.
  [[nodiscard]] std::map<RobotId, std::string> robot_names() const;
  /// False after a start until the first update; mission_status() then has the figures of the last update before the
  /// start.
  [[nodiscard]] bool has_map() const { return has_map_; }
  [[nodiscard]] const ProxyGraph& broadcast() const { return *last_broadcast_; }

 private:
  ServerNode(std::set<RobotId> robots, std::shared_ptr<const server::ClosureVerifier> verifier,
             const ServerNodeConfig& config, std::uint64_t epoch, std::shared_ptr<SubmapFrames> frames,
             OpenedMap opened);

  /// Reports and counts a refused message.
  void refuse(const bus::Envelope& envelope, const std::string& why, Timestamp now, Step& step);
  void note_refusal(bus::Endpoint::Role from, bus::MessageKind kind, const std::string& why);
  /// The robot joins the mission; false if it is in it already.
  bool admit(RobotId robot);
  /// Undoes admit(), because the robot's first submap was invalid.
  void dismiss(RobotId robot, Timestamp now);
  /// Why the robot cannot join the mission; empty when it can, or has.
  [[nodiscard]] std::string objection_to(RobotId robot) const;
  void receive_status(const bus::Envelope& envelope, Timestamp now, Step& step);
  void refuse_robot(const bus::Envelope& envelope, const NodeStatus& status, const std::string& why, Timestamp now,
                    Step& step);
  [[nodiscard]] std::set<RobotId> strangers_there(Timestamp now) const;
  /// False when it is not that robot's.
  bool receive_status_of_robot(RobotId robot, const NodeStatus& status, Timestamp now, Step& step);
  /// Takes what a robot has found of the map that it localises in, if it has submaps in this one: others may be
  /// anybody.
  void note_returns(RobotId robot, const InMap& in_map, Timestamp now);
  /// Why it cannot be of this map; empty: it can.
  [[nodiscard]] std::string objection_to(const SubmapReturn& one) const;
  /// Sets map_id_.
  void note_first_submap();
  /// By a clock that goes on over restarts, if the host has one.
  [[nodiscard]] std::int64_t clock_s(Timestamp now) const;
  Status take_submap(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Stores what is new of submaps' places.
  void keep_places(Step& step);
  /// Stores which submaps were retired, without their payloads.
  void keep_retired(Timestamp now, Step& step);
  /// Refuses a submap for good: the robot need not send it again.
  void note_refused(SubmapId id, const bus::Envelope& envelope, const std::string& why, Timestamp now, Step& step);
  /// Receipts::of_anybody()
  [[nodiscard]] Receipt* receipt_of(RobotId robot, Timestamp now);
  void send_receipt(Receipt receipt, Step& step) const;
  /// The robot need not send the submap again before the server's next start, which may be of a newer version.
  void note_unread(SubmapId id, Timestamp now, Step& step);
  /// Reports which rows of the store were left as they are.
  void emit_unread_rows(Timestamp now, Step& step);
  void receive_submap(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_returned_job(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_refinement(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_returned_refinement(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_order(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_decision(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_mark(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// True when a decision on this pair that was given later counts instead.
  Result<bool> take_decision(const ClosureDecision& decision, Timestamp now, Step& step);
  void note_decision(const std::string& frame, const std::string& why);
  /// Answers the decisions that are stored.
  void recall_decisions();
  [[nodiscard]] server::ClosureNames closure_names() const;
  void send_copies(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Takes one verdict; a refusal that counts now is added to `refused`.
  Status take(const ClosureVerdict& verdict, Verdicts& refused, Step& step);
  void send_jobs(std::optional<SubmapId> newest, Timestamp now, unsigned asked, std::size_t most_pairs, Step& step);
  /// Sends the refinement job that the last map wants, if any.
  void send_refinement_job(Timestamp now, Step& step);
  void ask_for_refinement(RefinementJob job, Timestamp now, unsigned asked, Step& step);
  /// The refinement is asked for again later, or given up.
  void note_failed_refinement(const RefinementJob& job, const std::string& why, Timestamp now, Step& step);
  void give_up_refinement(std::uint64_t revision, const std::string& why, Timestamp now, Step& step);
  /// After an update: sets when the map is to be refined that was not yet, and the whole map if nothing more comes.
  void note_settling(Timestamp now);
  void settle(Timestamp now, Step& step);
  [[nodiscard]] bool may_refine(Timestamp now) const { return !refine_from_ || *refine_from_ <= now; }
  void set_aside(const bus::Envelope& envelope, const std::vector<ClosureVerdict>& verdicts, Timestamp now, Step& step);
  /// An answer to a job that is not open.
  void refuse_unasked(const bus::Envelope& envelope, const std::string& job, Timestamp now, Step& step);
  /// A worker did not have the verifier for these pairs: they are asked again when a worker has it.
  void note_waiting(const std::vector<SubmapPair>& pairs, const std::string& why, Timestamp now, Step& step);
  void ask_waiting(Timestamp now, Step& step);
  /// A worker reports which methods it has.
  void receive_status_of_worker(std::uint32_t number, const NodeStatus& status, Timestamp now, Step& step);
  /// No worker could verify the pair this time: it is asked again later, or refused.
  void note_failed(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step);
  void give_up(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step);
  static void keep(const Verdicts& refused, Step& step);
  void ask_again(Timestamp now, Step& step);
  /// False when one of the submaps is not in the map.
  bool give_back(const SubmapPair& pair);
  void send_receipt(RobotId robot, Step& step) const;
  [[nodiscard]] bool is_due(const std::optional<Timestamp>& timer, Timestamp now) const;
  /// Sets the timer when something new has come, and stores whether it has.
  void note_news(Timestamp now, bool before, Step& step);
  [[nodiscard]] storage::Write meta() const;

  std::set<RobotId> robots_;
  ServerNodeConfig config_;
  std::shared_ptr<const SubmapFrames> frames_;
  server::MapServer server_;
  Receipts receipts_;
  AnsweredDecisions decisions_;
  MarkSet marks_;
  RobotRegistry registry_;
  std::map<std::string, UnreadRows> unread_rows_;  // by table, until they are reported
  PlaceBook place_book_;
  std::optional<SubmapId> first_submap_;
  std::string map_id_;  // localise::KnownMap::id of this map: it follows from the first submap
  WorkerRoster workers_;
  std::map<std::pair<bus::Endpoint::Role, bus::MessageKind>, MissionStatus::Refusals> refusals_;
  std::uint64_t start_ = 0;  // number of starts on this store; part of jobs' names
  JobBook jobs_;             // of this start
  FailedPairs failed_;
  std::set<SubmapPair> waiting_;  // for a worker that has the verifier
  std::string why_waiting_;
  RefinementQueue refinements_;
  std::optional<Timestamp> settle_at_;
  std::optional<Timestamp> refine_from_;  // ServerConfig::refine_pause_s after the last job
  std::optional<Timestamp> refine_at_;    // the last update was too soon for one
  std::uint64_t changes_ = 0;
  bool had_news_ = false;  // when the store was opened
  std::optional<Timestamp> timer_;
  UpdatePacer pacer_;
  std::optional<Timestamp> review_at_;   // when robots are sent the last map that they were not sent at once
  std::optional<Timestamp> compute_at_;  // when to compute the map that the store had when it was opened
  std::optional<MapCounts> stored_counts_;
  bool has_map_ = false;
  bool is_making_map_ = false;
  // the task has it while a map is made
  Broadcast broadcast_{config_.server.broadcast == "all", config_.server.unchanged_every_s};
  std::shared_ptr<const ProxyGraph> last_broadcast_ = broadcast_.last();
  bool operator_decided_ = false;  // since the last map
};

}  // namespace tutti::node
