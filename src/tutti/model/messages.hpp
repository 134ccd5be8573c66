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

/// Precedes every message; (robot, session, sequence) identifies the message. Duplicates are detected by the content
/// instead: a submap's id, a proxy graph's epoch and revision.
struct MessageHeader {
  RobotId robot;              ///< The sender; 0 when the server is.
  std::uint64_t session = 0;  ///< From a robot: the session of its chain. From the server: its epoch.
  std::uint64_t sequence = 0;
  friend bool operator==(const MessageHeader&, const MessageHeader&) = default;
};

struct SubmapMessage {  ///< From a robot to the server.
  MessageHeader header;
  Submap submap;
};

struct ProxyGraphMessage {  ///< From the server to every robot.
  MessageHeader header;
  ProxyGraph graph;
};

/// From the server to one robot: which of its submaps are stored or refused for good, and therefore need not be sent
/// again. Submaps that a restarted server no longer names are lost to it (say, when an older map was restored), and the
/// robot sends them again.
struct Receipt {
  /// Two programs claim to be the same robot, and this one is refused.
  struct Conflict {
    std::uint64_t session = 0;  ///< The session that is refused,
    std::uint64_t start = 0;    ///< and its start (NodeStatus::start): other programs are not meant.
    std::string why;
    template <class V>
    void describe(V& v) {
      v.field(1, "session", session);
      v.field(2, "start", start);
      v.field(3, "why", why);
    }
    friend bool operator==(const Conflict&, const Conflict&) = default;
  };
  /// A submap that was refused, identified by the content_hash() of its bytes: other content under the same id is not.
  struct Refusal {
    std::uint64_t session = 0;
    std::uint32_t index = 0;
    std::uint64_t content = 0;
    template <class V>
    void describe(V& v) {
      v.field(1, "session", session);
      v.field(2, "index", index);
      v.field(3, "content", content, {.fixed = true});
    }
    friend bool operator==(const Refusal&, const Refusal&) = default;
  };
  static constexpr std::size_t kMostRefusals = 1'000;
  RobotId robot;
  std::uint32_t incarnation = 0;               ///< ProxyGraph::incarnation
  std::map<std::uint64_t, NumberSet> stored;   ///< Indices of submaps, by session.
  std::map<std::uint64_t, NumberSet> refused;  ///< Indices of refused submaps, by session; disjoint from `stored`.
  std::string why_refused;                     ///< Reason for the latest refusal.
  /// Submaps in a version of the format that this server cannot read. A newer server can, so the robot keeps them and
  /// sends them again when the server has restarted.
  std::map<std::uint64_t, NumberSet> unread;
  /// The session that owns this robot's name and number, as far as the server knows.
  std::optional<std::uint64_t> owner_session;
  std::optional<Conflict> conflict;
  std::vector<Refusal> refusals;  ///< The latest refusals by content.
  template <class V>
  void describe(V& v) {
    v.field(1, "robot", robot);
    v.field(2, "stored", stored, {.at_most = ProxyGraph::kMostChains});
    v.field(3, "refused", refused, {.at_most = ProxyGraph::kMostChains});
    v.field(4, "why_refused", why_refused);
    v.field(5, "owner_session", owner_session);
    v.field(6, "conflict", conflict);
    v.field(7, "incarnation", incarnation, {.fixed = true});
    v.field(8, "unread", unread, {.at_most = ProxyGraph::kMostChains});
    v.field(9, "refusals", refusals, {.at_most = kMostRefusals});
  }

  [[nodiscard]] bool contains(SubmapId id) const { return has(stored, id); }
  [[nodiscard]] bool refuses(SubmapId id) const { return has(refused, id); }
  [[nodiscard]] bool leaves_unread(SubmapId id) const { return has(unread, id); }
  /// True if this content was refused under this id.
  [[nodiscard]] bool refuses(SubmapId id, std::uint64_t content) const;
  /// Adds a refusal; false if it is known already. Keeps at most `most` contents: the oldest go first, and an id stops
  /// being refused when its last content goes.
  bool refuse(SubmapId id, std::uint64_t content, std::size_t most);
  /// Forgets everything that was refused under this id.
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

/// From the server to one worker: pairs of submaps to verify.
struct Job {
  std::string id;
  std::vector<SubmapPair> pairs;
  MethodId verifier{};     ///< Only this verifier may verify them.
  std::string settings{};  ///< Settings to make the verifier with (server::ClosureVerifier::settings()); empty: only a
                           ///< worker that has the verifier can.
  template <class V>
  void describe(V& v) {
    v.field(1, "id", id, kJobId);
    v.field(2, "pairs", pairs, {.at_most = SubmapPair::kMost, .always = true});
    v.field(3, "verifier", verifier);
    v.field(4, "settings", settings, kMethodSettings);
  }
  friend bool operator==(const Job&, const Job&) = default;
};

/// From a worker to the server: the outcome of a job's pairs.
struct Verdicts {
  std::string job;
  std::vector<ClosureVerdict> verdicts;
  std::vector<SubmapPair> failed;  ///< Pairs without a verdict, say because a cloud could not be read.
  std::string why;                 ///< Why the first of `failed` has no verdict.
  bool cannot = false;  ///< Every pair failed because this worker does not have the job's verifier; another worker may.
  template <class V>
  void describe(V& v) {
    v.field(1, "job", job, kJobId);
    v.field(2, "verdict", verdicts, {.at_most = SubmapPair::kMost});
    v.field(3, "failed", failed, {.at_most = SubmapPair::kMost, .always = true});
    v.field(4, "why", why, {.text = FieldRule::Text::any});
    v.field(5, "cannot", cannot);
  }
  friend bool operator==(const Verdicts&, const Verdicts&) = default;
};

}  // namespace tutti
