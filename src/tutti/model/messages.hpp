// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/number_set.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/submap.hpp"

namespace tutti {

/// In front of every message; (robot, session, sequence) identifies it. Duplicates are recognised by what is inside:
/// a submap's id, a proxy graph's epoch and revision.
struct MessageHeader {
  RobotId robot;              ///< Sender; of a server's message: unused, 0.
  std::uint64_t session = 0;  ///< Of a robot: of its chain of odometry. Of the server: its epoch.
  std::uint64_t sequence = 0;
  friend bool operator==(const MessageHeader&, const MessageHeader&) = default;
};

struct SubmapMessage {  ///< robot -> server
  MessageHeader header;
  Submap submap;
};

struct ProxyGraphMessage {  ///< server -> every robot
  MessageHeader header;
  ProxyGraph graph;
};

/// server -> one robot: which of its submaps are stored, or refused for good, and need not be sent again.
/// What a server that has started again names no more it has forgotten, as when an older map was put in its place.
struct Receipt {
  /// One of two programs that call themselves the same robot.
  struct Conflict {
    std::uint64_t session = 0;  ///< That is refused, and
    std::uint64_t start = 0;    ///< of it this start (NodeStatus): others need not mind.
    std::string why;
    friend bool operator==(const Conflict&, const Conflict&) = default;
  };
  /// A submap that was refused, with the content_hash() of its bytes: others that come under its id are not.
  struct Refusal {
    std::uint64_t session = 0;
    std::uint32_t index = 0;
    std::uint64_t content = 0;
    friend bool operator==(const Refusal&, const Refusal&) = default;
  };
  RobotId robot;
  std::uint32_t incarnation = 0;               ///< ProxyGraph::incarnation
  std::map<std::uint64_t, NumberSet> stored;   ///< Numbers of submaps, by session.
  std::map<std::uint64_t, NumberSet> refused;  ///< Likewise, apart from those.
  std::string why_refused;                     ///< The last of them.
  /// Likewise: they have come in a version that the server does not read. A newer one will: the robot keeps them, and
  /// sends them again when the server has started again.
  std::map<std::uint64_t, NumberSet> unread;
  std::optional<std::uint64_t> owner_session;  ///< Whose name and number these are, as far as the server was told.
  std::optional<Conflict> conflict;
  std::vector<Refusal> refusals;  ///< Of those refused, the last ones; older servers do not say them.

  [[nodiscard]] bool contains(SubmapId id) const { return has(stored, id); }
  [[nodiscard]] bool refuses(SubmapId id) const { return has(refused, id); }
  [[nodiscard]] bool leaves_unread(SubmapId id) const { return has(unread, id); }
  /// This content under this id; of an older server, which does not say contents, whatever comes under it.
  [[nodiscard]] bool refuses(SubmapId id, std::uint64_t content) const;
  /// One more; false: it was before. Of more than `most` contents the oldest are forgotten, and submaps with their
  /// last.
  bool refuse(SubmapId id, std::uint64_t content, std::size_t most);
  /// As if nothing had ever come under this id that was refused.
  void forget_refusals(SubmapId id);
  friend bool operator==(const Receipt&, const Receipt&) = default;

 private:
  [[nodiscard]] bool has(const std::map<std::uint64_t, NumberSet>& numbers, SubmapId id) const {
    const auto session = numbers.find(id.chain.session);
    return id.chain.robot == robot && session != numbers.end() && session->second.contains(id.index);
  }
  [[nodiscard]] bool has_refusal_of(std::uint64_t session, std::uint32_t index) const;
  void remove_refused(std::uint64_t session, std::uint32_t index);
};

/// server -> one of the workers: pairs of submaps to be verified.
struct Job {
  std::string id;
  std::vector<SubmapPair> pairs;
  MethodId finder{};       ///< By this one and no other; without a name: of an older server, by any.
  std::string settings{};  ///< Which make one (server::ClosureFinder::settings()); empty: only who has it can.
  friend bool operator==(const Job&, const Job&) = default;
};

/// worker -> server: what became of a job's pairs.
struct Verdicts {
  std::string job;
  std::vector<ClosureVerdict> verdicts;
  std::vector<SubmapPair> failed;  ///< Without a verdict, as when a cloud could not be read.
  std::string why;                 ///< The first of them failed.
  bool cannot = false;             ///< All of them failed since this worker has not got the job's finder: another may.
  friend bool operator==(const Verdicts&, const Verdicts&) = default;
};

}  // namespace tutti
