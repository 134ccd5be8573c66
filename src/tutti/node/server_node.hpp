// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "tutti/node/step.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::node {

struct ServerNodeConfig {
  server::ServerConfig server;
  std::size_t pairs_per_job = 256;  ///< At most: what one worker does before others can help.
};

/// The mapping server round MapServer: submaps and verdicts in; receipts, jobs and proxy graphs out. Its store is the
/// map (storage::map_schema()): submaps and verdicts as they came, and what became of the other pairs; all else is
/// computed from these. What was sent is never ahead of what is stored, so a server that starts again on its own store
/// keeps its epoch.
class ServerNode {
 public:
  /// On an empty store a new map of this epoch, which is larger than any before (server::MapServer); otherwise the map
  /// that is stored goes on. The store must outlive the node. An error: it holds something else than a map.
  static Result<std::unique_ptr<ServerNode>> open(std::set<RobotId> robots,
                                                  std::shared_ptr<const server::ClosureFinder> finder,
                                                  const ServerNodeConfig& config, std::uint64_t epoch,
                                                  const storage::TableStore& store);

  /// The first step after every start.
  Step resume(Timestamp now);
  /// What has come to the server.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// When on_timer() is to be called next; nothing while there is no news.
  [[nodiscard]] std::optional<Timestamp> next_timer() const { return timer_; }
  /// Optimises the map when it is time; otherwise does nothing.
  Step on_timer(Timestamp now);

  [[nodiscard]] const server::MapServer& map_server() const { return server_; }
  [[nodiscard]] const ProxyGraph& broadcast() const { return broadcast_; }  ///< The last one; empty before.

 private:
  struct Opened;  // what was found in the store
  ServerNode(std::set<RobotId> robots, std::shared_ptr<const server::ClosureFinder> finder,
             const ServerNodeConfig& config, std::uint64_t epoch, std::shared_ptr<SubmapFrames> clouds, Opened opened);

  void receive_submap(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Takes one verdict of these; a refusal that now holds is kept in `refused`.
  Status take(const ClosureVerdict& verdict, Verdicts& refused, Step& step);
  void send_jobs(std::optional<SubmapId> newest, Step& step);
  void send_receipt(RobotId robot, Step& step) const;
  void send_graph(const ProxyGraphMessage& message, Step& step);
  /// Sets the timer when something new has come, and remembers in the store whether it has.
  void note_news(Timestamp now, bool before, Step& step);
  [[nodiscard]] storage::Write meta() const;

  std::set<RobotId> robots_;
  ServerNodeConfig config_;
  server::MapServer server_;
  std::map<RobotId, Receipt> receipts_;
  std::uint64_t start_ = 0;  // of all on this store; names jobs
  std::uint64_t jobs_ = 0;   // sent in this start
  bool had_news_ = false;    // when the store was opened
  std::optional<Timestamp> timer_;
  ProxyGraph broadcast_;
};

}  // namespace tutti::node
