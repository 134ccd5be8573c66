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
#include "tutti/server/closure_finder.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/payload_store.hpp"
#include "tutti/server/refinements.hpp"
#include "tutti/server/refusal_counts.hpp"

namespace tutti::server {

struct ServerConfig {
  MapConfig map;
  consistency::ProxyGraphConfig proxy_graph;
  int refine_every = 5;
  double update_period_s = 10.0;  ///< Mission time between two optimisations when something new has come.
  std::string broadcast = "own";
  std::string change_of_mind = "wait";
  template <class V>
  void describe(V& v) {
    v.field("map", map);
    v.field("proxy_graph", proxy_graph);
    v.field(
        "refine_every", refine_every, at_least(0),
        "Every which bundle adjustment goes over the whole map, where cameras saw it; those between over what is new. "
        "When nothing has come for so many update periods, one of the whole follows. 0: none at all.");
    v.field("update_period_s", update_period_s, greater_than(0.0),
            "Mission time between two optimisations when there is something new.");
    v.field("broadcast", broadcast, one_of({"own", "all"}),
            "What a robot is sent of the map: 'own' = the proxy nodes of its newest session, how sure the map is of "
            "them, and where the others were last seen; 'all' = everybody's (the paper). It does the same with both.");
    v.field("change_of_mind", change_of_mind, one_of({"wait", "follow"}),
            "A map that differs from the one a robot follows by more than three of that map's own standard deviations: "
            "'wait' = the robot is sent it once it has stood for another update, or an operator has spoken since; "
            "'follow' = at once.");
  }
};

/// Heavy work that leaves the server as a message; ClosureFinder::verify(*first, *second, payloads) answers it,
/// anywhere that the payloads can be got at.
struct VerificationJob {
  SubmapPair pair;
  std::shared_ptr<const Submap> first;
  std::shared_ptr<const Submap> second;
};

/// The server's whole state, by value, but for the payloads, which lie in its store: kill it, restore it with the same
/// store, and it goes on with the same map.
struct MapServerState {
  SubmapSet submaps;                              ///< Without their payloads.
  std::map<SubmapId, PayloadSize> payload_sizes;  ///< Of those that carry any.
  /// Those with closures: of `finder`, and of earlier ones where that has not answered. Refusals are only counted: a
  /// pair that is answered and not among these is refused, or not to be asked.
  VerdictSet verdicts;
  MethodId finder;
  WordSet words;           ///< Of operators.
  AnsweredPairs answered;  ///< By `finder`, or not to be asked.
  RefusalCounts refused;   ///< By `finder`.
  Refinements refinements;
  std::uint64_t epoch = 0;  ///< Of the server that this is the state of.
  std::uint64_t revision = 0;
};

/// What the server has done since it started. Deterministic, and so what a test can hold the cost to.
struct ServerWork {
  std::size_t pairs_looked_at = 0;  ///< Of submaps.
  std::size_t pairs_verified = 0;   ///< Verdicts taken.
  std::size_t updates = 0;
  judge::SearchWork search;  ///< Of all updates.
  MonitorWork monitor;
};

/// Submaps in; attach, close loops, optimise; proxy graphs out. No threads, sockets or clocks inside.
class MapServer {
 public:
  /// Whoever starts it gives the epoch: larger than at any start before, as the time of the start is. Robots drop what
  /// an earlier epoch broadcast as late.
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder,
            std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch);
  /// Goes on from a saved state; verifications that had no verdict yet become jobs again. All of them when the finder
  /// is another than the state's: what that found stays in the map until it is answered, for good where the new one has
  /// nothing to compare. The epoch becomes larger
  /// than the saved one if it is not; only the starter's number tells two starts from one saved state apart.
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder,
            std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch,
            MapServerState state);

  /// Asks for refinements that this can make, from now on (ServerConfig::refine_every); not null.
  void refine_with(std::shared_ptr<const MapRefiner> refiner) { refiner_ = std::move(refiner); }

  /// One more that submaps may come from. Each has the less room for sessions, the more there are.
  void add_robot(RobotId robot) { robots_.insert(robot); }
  /// One without submaps in the map.
  void remove_robot(RobotId robot) { robots_.erase(robot); }

  /// Takes a submap of any session of a known robot. Submaps may come in any order and any number of times; a repeated
  /// one only puts its cloud back where the store has lost it. An error, and the map is as it was: the robot is
  /// unknown, the submap is malformed, the robot has no room for another session (ProxyGraph::kMostChains), or the
  /// store cannot keep the cloud, and then the submap may be sent again.
  Status receive(const SubmapMessage& message);
  /// Takes the answer to a job; answers may come in any order and any number of times. Of two verdicts on one pair a
  /// refusal holds, then the closures with the smaller numbers, so that the map is the same whichever came first. A
  /// verdict that comes before its submaps waits for them and is judged then. An error, and nothing changes: the
  /// verdict is of another finder than the server's, a closure joins anything else than a keyframe of pair.first to one
  /// of pair.second, the finder would not ask for the pair, or kMostWaiting verdicts wait already; then the pair is
  /// asked again.
  Status receive(const ClosureVerdict& verdict);
  static constexpr std::size_t kMostWaiting = 1000;
  /// Takes what an operator says of the closures of a pair, any number of times; the map follows at the next
  /// optimise(). Of two words on one pair the later one holds. A verdict whose closures an operator accepts stays as it
  /// is, whatever other finders say. An error, and nothing changes: the pair's submaps are not in the map, or there are
  /// no closures to accept.
  Status receive(const SubmapPair& pair, const ClosureWord& word);
  /// Takes the answer to a refinement job, in any order, any number of times, however late; the map follows at the next
  /// optimise(). Of two refinements of one step that of the newer map holds (Refinements). An error, and the map stays
  /// as it was: the refinement failed, or is of another map.
  Status receive(const Refinement& refinement);
  /// Why verdicts that had waited were no good when their submaps came, since the last call.
  std::vector<Error> take_late_errors() { return std::exchange(late_errors_, {}); }
  /// Verifications to be done; each is handed out once.
  std::vector<VerificationJob> take_jobs();
  /// A job that had an error instead of an answer: the next take_jobs() hands it out again.
  void give_back(VerificationJob job);
  /// The refinement that the last map wants, without a name; handed out once. There is no other before this one is
  /// answered or given up, and none again for a map with nothing new.
  std::optional<RefinementJob> take_refinement_job() { return std::exchange(refinement_job_, std::nullopt); }
  /// True while parts were refined since all was: settle() is to be called when nothing new has come for some time.
  [[nodiscard]] bool is_unsettled() const { return refiner_ != nullptr && state_.refinements.parts() > 0; }
  /// Makes the job of the whole map that is there, unless one is out.
  void settle();
  /// There will be no answer to it.
  void give_up_refinement() { refining_.reset(); }

  /// True when something came since the last optimise().
  [[nodiscard]] bool has_news() const { return news_; }
  /// Optimises the joint map and returns its whole proxy graph.
  ProxyGraphMessage optimise();
  /// The last revision's again: for a server that goes on from a state in which nothing has come since, as it is told
  /// by nothing_is_new().
  ProxyGraphMessage rebuild();
  void nothing_is_new() { news_ = false; }

  [[nodiscard]] const MapEstimate& map() const { return map_; }
  [[nodiscard]] const ServerWork& work() const { return work_; }
  [[nodiscard]] const MapServerState& state() const { return state_; }
  /// Pairs by the reason they were refused for.
  [[nodiscard]] const RefusalCounts& refusals() const { return state_.refused; }
  [[nodiscard]] const ClosureFinder& finder() const { return *finder_; }
  [[nodiscard]] const PayloadStore& payloads() const { return *payloads_; }

 private:
  [[nodiscard]] Status check_room_for(const ChainId& chain) const;
  /// If it is the cloud that was there.
  Status replace_lost_payload(const Submap& duplicate);
  [[nodiscard]] PayloadSize size_of(SubmapId id) const;
  /// Both submaps are there and the finder wants the pair.
  [[nodiscard]] bool is_asked(const SubmapPair& pair) const;
  /// By the server's finder, or by an operator's word.
  [[nodiscard]] bool is_answered(const SubmapPair& pair) const;
  void plan_verification(const SubmapPair& pair);
  [[nodiscard]] bool has_submaps_of(const ClosureVerdict& verdict) const;
  [[nodiscard]] Status check_against_submaps(const ClosureVerdict& verdict) const;
  Status wait_for_submaps(const ClosureVerdict& verdict);
  void judge_waiting();
  /// Something has come that changes the pose graph.
  void note_news();
  /// Makes the job for the map that is there, if there is to be one.
  void plan_refinement(bool settle);
  /// What is good.
  void take(const ClosureVerdict& verdict);

  std::set<RobotId> robots_;
  std::shared_ptr<const ClosureFinder> finder_;
  std::shared_ptr<PayloadStore> payloads_;
  ServerConfig config_;
  MapServerState state_;
  std::vector<VerificationJob> jobs_;
  std::vector<ClosureVerdict> waiting_;  // not in the state: their pairs are asked when the submaps come
  std::vector<Error> late_errors_;
  std::optional<MapEstimate> estimate_;        // the pose graph's map; nothing: to be made
  MapEstimate map_;                            // refined
  std::shared_ptr<const MapRefiner> refiner_;  // null: of none
  std::optional<RefinementJob> refinement_job_;
  std::optional<std::uint64_t> refining_;  // the revision of the job that is out
  struct Asked {
    RefinementScope scope;
    bool whole = false;
  };
  std::optional<Asked> asked_;  // last
  bool news_ = false;
  ServerWork work_;
};

}  // namespace tutti::server
