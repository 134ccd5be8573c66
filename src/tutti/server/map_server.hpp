// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/server/closure_finder.hpp"
#include "tutti/server/cloud_store.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

struct ServerConfig {
  MapConfig map;
  consistency::ProxyGraphConfig proxy_graph;
  double update_period_s = 10.0;  ///< Mission time between two optimisations when something new has come.
  template <class V>
  void describe(V& v) {
    v.field("map", map);
    v.field("proxy_graph", proxy_graph);
    v.field("update_period_s", update_period_s, greater_than(0.0),
            "Mission time between two optimisations when there is something new.");
  }
};

/// Heavy work that leaves the server as a message; ClosureFinder::verify(*first, *second, clouds) answers it, anywhere
/// that the clouds can be got at.
struct VerificationJob {
  SubmapPair pair;
  std::shared_ptr<const Submap> first;
  std::shared_ptr<const Submap> second;
};

/// The server's whole state, by value, but for the clouds, which lie in its store: kill it, restore it with the same
/// store, and it goes on with the same map.
struct MapServerState {
  SubmapSet submaps;                            ///< Without their clouds.
  std::map<SubmapId, std::size_t> cloud_sizes;  ///< Points of each submap's cloud; of those that have one.
  VerdictSet verdicts;
  std::uint64_t revision = 0;
};

/// Submaps in; attach, close loops, optimise; proxy graphs out. No threads, sockets or clocks inside.
class MapServer {
 public:
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder, std::shared_ptr<CloudStore> clouds,
            const ServerConfig& config);
  /// Goes on from a saved state; verifications that had no verdict yet become jobs again.
  MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder, std::shared_ptr<CloudStore> clouds,
            const ServerConfig& config, MapServerState state);

  /// A submap, in any order, any number of times. Unknown robots and malformed submaps are refused; what is already
  /// mapped stays. So is one whose cloud the store cannot keep; it may be sent again. One that comes again puts its
  /// cloud back if the store has lost it.
  Status receive(const SubmapMessage& message);
  /// The answer to a job, in any order, any number of times.
  Status receive(const ClosureVerdict& verdict);
  /// Verifications to be done; each is handed out once.
  std::vector<VerificationJob> take_jobs();
  /// A job that had an error instead of an answer: the next take_jobs() hands it out again.
  void give_back(VerificationJob job);

  /// True when something came since the last optimise().
  [[nodiscard]] bool has_news() const { return news_; }
  /// Optimises the joint map and returns the proxy graph to broadcast.
  ProxyGraphMessage optimise();

  [[nodiscard]] const MapEstimate& map() const { return map_; }
  [[nodiscard]] const MapServerState& state() const { return state_; }
  [[nodiscard]] const CloudStore& clouds() const { return *clouds_; }

 private:
  /// If it is the cloud that was there.
  Status replace_lost_cloud(const Submap& duplicate);
  [[nodiscard]] bool may_be_verified(SubmapId id) const;
  void plan_verifications(const std::shared_ptr<const Submap>& submap);

  std::set<RobotId> robots_;
  std::shared_ptr<const ClosureFinder> finder_;
  std::shared_ptr<CloudStore> clouds_;
  ServerConfig config_;
  MapServerState state_;
  std::set<SubmapPair> asked_;
  std::vector<VerificationJob> jobs_;
  MapEstimate map_;
  bool news_ = false;
};

}  // namespace tutti::server
