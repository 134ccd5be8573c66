// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/server/answered_pairs.hpp"
#include "tutti/server/candidate_pairs.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/map_job.hpp"
#include "tutti/server/payload_store.hpp"
#include "tutti/server/refinements.hpp"
#include "tutti/server/refusal_counts.hpp"

namespace tutti::server {

/// Settings of a server; `describe` explains each.
struct ServerConfig {
  MapConfig map;
  consistency::ProxyGraphConfig proxy_graph;
  int refine_every = 5;
  double refine_pause_s = 10.0;
  double update_least_s = 0.5;
  double update_share = 0.25;
  std::string broadcast = "own";
  double unchanged_every_s = 20.0;
  int candidates_per_submap = 100;
  template <class V>
  void describe(V& v) {
    v.field("map", map);
    v.field("proxy_graph", proxy_graph);
    v.field(
        "refine_every", refine_every, at_least(0),
        "Every which bundle adjustment goes over the whole map, where cameras saw it; those between over what is new. "
        "When nothing has come for so many of its pauses, one of the whole follows. 0: none at all.");
    v.field("refine_pause_s", refine_pause_s, greater_than(0.0),
            "Mission time between two bundle adjustments, at the least.");
    v.field("update_least_s", update_least_s, formerly("update_period_s", greater_than(0.0)),
            "Mission time between the beginnings of two updates, at the least. An update, which optimises the map and "
            "sends it, begins as soon as something new has come and the last one is sent.");
    v.field("update_share", update_share, above_zero_to(1.0),
            "The share of one core that updates may take: one that costs c seconds of CPU keeps the next back until "
            "c / share after it began, unless an operator has spoken. In virtual time the cost is counted "
            "(server/update_cost.hpp).");
    v.field("broadcast", broadcast, one_of({"own", "all"}),
            "What a robot is sent of the map: 'own' = the proxy nodes of its newest session, how sure the map is of "
            "them, and where the others were last seen; 'all' = everybody's (the paper). It does the same with both.");
    v.field(
        "unchanged_every_s", unchanged_every_s, at_least(0.0),
        "A map that has nothing to correct for a robot (none of its closures changed, and it lies within one standard "
        "deviation of what the robot was sent) is sent to it so long after the last one; 0: at once, as all others.");
    v.field("candidates_per_submap", candidates_per_submap, at_least(0),
            "LiDAR: a pair of submaps is verified when either is among so many that look most alike to the other from "
            "above, robots taking turns. With no more submaps than that, these are all pairs. 0: all pairs always.");
  }
};

/// Verification of one pair, heavy work that leaves the server as a message: the answer is
/// ClosureVerifier::verify(*first, *second, payloads), computed anywhere that has the payloads.
struct VerificationJob {
  SubmapPair pair;
  std::shared_ptr<const Submap> first;
  std::shared_ptr<const Submap> second;
};

/// The server's whole state by value, except payloads, which are in its store. A server that is killed and restored
/// from this with the same store goes on with the same map.
struct MapServerState {
  SubmapSet submaps;                              ///< Without payloads.
  std::map<SubmapId, PayloadSize> payload_sizes;  ///< Only submaps that carry any.
  /// The verdicts with closures: those of `verifier`, and those of earlier verifiers on pairs that `verifier` has not
  /// answered. Refusals are only counted: a pair that is in `answered` and not here was refused, or is not to be
  /// verified.
  VerdictSet verdicts;
  MethodId verifier;
  DecisionSet decisions;   ///< Words of operators.
  AnsweredPairs answered;  ///< Pairs that `verifier` has answered, or that are not to be verified.
  PlaceSet places;         ///< Each tells which candidates its submap has.
  RefusalCounts refused;   ///< Refusals by `verifier`.
  Refinements refinements;
  std::shared_ptr<const HeldPoses> held;  ///< The poses of a map that does not move; null: every pose may.
  /// Submaps that show known ground (known_ground.hpp): without payloads, and of their verdicts only what ties them.
  std::set<SubmapId> retired;
  std::uint64_t epoch = 0;  ///< Epoch of the server whose state this is.
  std::uint64_t revision = 0;
};

/// Submaps that were retired, and the pairs whose verdicts were dropped.
struct Retired {
  std::vector<SubmapId> submaps;
  std::vector<SubmapPair> dropped;
};

/// Work done since the server started. The figures are deterministic, so that tests can bound the cost.
struct ServerWork {
  std::size_t pairs_looked_at = 0;  ///< Pairs of submaps.
  std::size_t places_compared = 0;  ///< Pairs of places.
  std::size_t pairs_verified = 0;   ///< Verdicts taken.
  std::size_t updates = 0;
  judge::SearchWork search;  ///< Over all updates.
  MonitorWork monitor;
};

/// The map server: takes submaps, attaches them, closes loops, optimises, and gives proxy graphs. It has no threads,
/// sockets or clocks, and is not for several threads at a time.
class MapServer {
 public:
  /// The starter gives the epoch, which must be larger than at any earlier start (such as the time of the start):
  /// robots ignore late broadcasts of earlier epochs. `verifier` and `payloads` must not be null.
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureVerifier> verifier,
            std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch);
  /// Goes on from a saved state. Verifications without a verdict become jobs again; all of them do when the verifier is
  /// another than the state's. The former verifier's closures stay in the map until the new one has answered, for good
  /// on pairs that the new one cannot compare. The epoch is raised above the saved one if it is not larger; when two
  /// servers start from one saved state, only the epochs that they are given tell them apart.
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureVerifier> verifier,
            std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch,
            MapServerState state);

  /// Asks for refinements by this refiner from now on (ServerConfig::refine_every); must not be null.
  void refine_with(std::shared_ptr<const MapRefiner> refiner) { refiner_ = std::move(refiner); }

  /// Accepts submaps of one more robot. Robots share the room for sessions equally.
  void add_robot(RobotId robot) { robots_.insert(robot); }
  /// Removes a robot that has no submaps in the map.
  void remove_robot(RobotId robot) { robots_.erase(robot); }

  /// Takes a submap of any session of a known robot. Submaps may come in any order and any number of times; a repeated
  /// one only restores a payload that the store has lost. On an error the map is as it was: the robot is unknown or not
  /// the sender; the submap is malformed, or differs from the one with its id in the map; the robot has no room for
  /// another session (ProxyGraph::kMostChains); or the store cannot keep the payload, and the submap may be sent again.
  Status receive(const SubmapMessage& message);
  /// Takes the answer to a job; answers may come in any order and any number of times. If two verdicts on one pair
  /// differ, a refusal wins, then more closures, then those with the smaller numbers, so that the order does not
  /// matter. A verdict that comes before its submaps waits for them. On an error nothing changes: the verdict is of
  /// another verifier than the server's; a closure joins anything else than a keyframe of pair.first to one of
  /// pair.second; the verifier would not verify the pair; or kMostWaiting verdicts wait already, and the pair is
  /// verified again.
  Status receive(const ClosureVerdict& verdict);
  static constexpr std::size_t kMostWaiting = 1000;
  /// Takes an operator's decision on the closures of a pair, any number of times; the next optimise() follows it. The
  /// later of two words on one pair counts. When an operator accepts closures, their verdict stays, whatever other
  /// verifiers say. On an error nothing changes: the map lacks one of the submaps, or there are no closures to accept.
  Status receive(const SubmapPair& pair, const ClosureDecision& decision);
  /// Takes the answer to a refinement job, in any order, any number of times, however late; the next optimise() follows
  /// it. Where two refinements have one step, the one of the newer map counts (Refinements). On an error the map stays
  /// as it was: the refinement failed, is of a later revision than the server's, or has invalid poses.
  Status receive(const Refinement& refinement);
  /// The errors since the last call, of verdicts that had waited for submaps and proved invalid when these came.
  std::vector<Error> take_late_errors() { return std::exchange(late_errors_, {}); }
  /// The submaps whose places were described, compared or dropped since the last call; MapServerState::places has those
  /// that were not dropped.
  std::vector<SubmapId> take_places() { return std::exchange(new_places_, {}); }
  /// All that was retired since the last call; the submaps' payloads and places go with it.
  Retired take_retired() { return std::exchange(new_retired_, {}); }
  /// The verifications to be done; each is handed out once.
  std::vector<VerificationJob> take_jobs();
  /// Returns a job that failed; the next take_jobs() hands it out again if it is still needed.
  void give_back(VerificationJob job);
  /// The refinement that the latest map wants, handed out once and without a name. There is no further one until this
  /// one is answered or given up, and none for a map with nothing new.
  std::optional<RefinementJob> take_refinement_job() { return std::exchange(refinement_job_, std::nullopt); }
  /// True while parts were refined since the whole map was: call settle() when nothing new has come for some time.
  [[nodiscard]] bool is_unsettled() const { return refiner_ != nullptr && state_.refinements.parts() > 0; }
  /// Makes a job for the whole present map, unless a job is out.
  void settle() { refine(true); }
  /// Makes the job that finish() was not to make, if it is still due. A map with news gets none: the next one does.
  void refine() { refine(false); }
  /// The job that is out will never be answered.
  void give_up_refinement() { refining_.reset(); }

  /// How many pairs have the closures of an earlier verifier, until this one has answered.
  [[nodiscard]] std::size_t former_pairs() const { return former_pairs_; }
  /// True when something has come that map() was made without.
  [[nodiscard]] bool has_news() const { return news_ || makes_news_; }
  /// The job that makes the map of the next revision. The server takes whatever comes until finish(), which is to be
  /// called with this job's map before another job is begun; only then is there a new revision.
  [[nodiscard]] MapJob begin_update();
  /// The same for the last revision again, for a server that goes on from a state to which nothing was added;
  /// nothing_is_new() then tells the server so.
  [[nodiscard]] MapJob begin_rebuild();
  /// Takes the map that was begun. All input since is news. With `refines` it makes a refinement job if one is due.
  void finish(MadeMap made, bool refines = true);
  void nothing_is_new() { news_ = false; }
  /// Begins, makes and finishes a map, and returns its whole proxy graph, as a new revision.
  ProxyGraphMessage optimise();
  /// The same for the last revision again.
  ProxyGraphMessage rebuild();

  [[nodiscard]] const MapEstimate& map() const { return map_; }
  [[nodiscard]] const ServerWork& work() const { return work_; }
  [[nodiscard]] const MapServerState& state() const { return state_; }
  /// Refused pairs, counted by reason.
  [[nodiscard]] const RefusalCounts& refusals() const { return state_.refused; }
  [[nodiscard]] const ClosureVerifier& verifier() const { return *verifier_; }
  [[nodiscard]] const PayloadStore& payloads() const { return *payloads_; }

 private:
  [[nodiscard]] Status check_room_for(const ChainId& chain) const;
  /// Restores the payload from a repeated submap, if the store has lost it and the sizes agree.
  Status replace_lost_payload(const Submap& duplicate);
  [[nodiscard]] PayloadSize size_of(SubmapId id) const;
  /// True if both submaps are there and the verifier wants the pair.
  [[nodiscard]] bool is_asked(const SubmapPair& pair) const;
  /// True if the server's verifier has answered the pair, or an operator's decision stands instead.
  [[nodiscard]] bool is_answered(const SubmapPair& pair) const;
  void plan_verification(const SubmapPair& pair);
  /// Asks for all pairs that are not answered, in order.
  void plan_open_verifications();
  /// Plans the pairs of a new submap with those that are there.
  void plan_verifications(SubmapId id);
  /// Goes on from the places of the state.
  void restore_candidates();
  /// Compares the place of this submap with all that were compared before.
  void compare_place(SubmapId id);
  [[nodiscard]] bool has_submaps_of(const ClosureVerdict& verdict) const;
  [[nodiscard]] Status check_against_submaps(const ClosureVerdict& verdict) const;
  Status wait_for_submaps(const ClosureVerdict& verdict);
  void judge_waiting();
  /// Notes that something has come that changes the pose graph.
  void note_news();
  [[nodiscard]] MapJob begin(std::uint64_t revision);
  /// Retires the submaps that show known ground, on the map that was made of this.
  void retire(const MapEstimate& map, const MapJob& job);
  void refine(bool settle);
  /// Makes a refinement job for the present map, which was made of this, if one is due.
  void plan_refinement(const MapEstimate& estimate, const SubmapSet& submaps,
                       const std::map<SubmapId, PayloadSize>& sizes, const VerdictSet& verdicts, bool settle);
  /// Takes a verdict that was checked.
  void take(const ClosureVerdict& verdict);

  std::set<RobotId> robots_;
  std::shared_ptr<const ClosureVerifier> verifier_;
  std::shared_ptr<PayloadStore> payloads_;
  ServerConfig config_;
  MapServerState state_;
  CandidatePairs candidates_;
  std::vector<SubmapId> new_places_;
  Retired new_retired_;
  std::vector<VerificationJob> jobs_;
  std::vector<ClosureVerdict> waiting_;  // not in the state: their pairs are verified again when the submaps come
  std::vector<Error> late_errors_;
  std::size_t former_pairs_ = 0;
  std::shared_ptr<const MapEstimate> estimate_;  // of the pose graph alone; null when it must be made, or not kept
  MapEstimate map_;                              // with refinements
  std::shared_ptr<const MapRefiner> refiner_;    // null: nothing is refined
  std::optional<RefinementJob> refinement_job_;
  std::optional<std::uint64_t> refining_;  // revision of the job that is out
  struct Asked {
    RefinementScope scope;
    bool whole = false;
  };
  std::optional<Asked> asked_;  // the last refinement asked for
  bool news_ = false;           // since the map was begun that is made, or was made last
  bool makes_news_ = false;     // the map that is made has news
  bool graph_is_new_ = false;   // something has come since then that changes the pose graph
  ServerWork work_;
};

}  // namespace tutti::server
