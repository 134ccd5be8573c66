// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/messages.hpp"

namespace tutti::node {

/// The answers of a worker whose verifier knows closures one after the other (server::ClosureVerifier::known_at()). A
/// pair is answered anew, with all closures known so far, whenever there is one more; a job is answered with its last
/// closure.
///
/// Robots' clocks begin elsewhere than a program's. A submap comes no earlier than its newest keyframe was taken; the
/// least time between the two measures how far this clock is ahead, so no closure is sent before it is known.
class LaterAnswers {
 public:
  /// A pair was asked whose newest keyframe is of this stamp.
  void note_newest(Timestamp newest, Timestamp now);
  /// Keeps a verdict of this job; `known_at` has one stamp for each of its closures, not decreasing. After
  /// note_newest().
  void add(const std::string& job, ClosureVerdict verdict, std::vector<Timestamp> known_at);
  [[nodiscard]] bool has(const std::string& job) const { return awaited_.contains(job); }
  /// The answers to be sent now. Only the last answer to a job carries its name; the others have names of their own, so
  /// the server goes on waiting.
  [[nodiscard]] std::vector<Verdicts> take_due(Timestamp now);
  /// When take_due() has something to return; nothing: never.
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  /// A name under which a part of the job's answer is sent.
  [[nodiscard]] std::string part_of(const std::string& job);

 private:
  struct Awaited {
    ClosureVerdict verdict;
    std::vector<Timestamp> known_at;
    std::size_t answered = 0;  ///< Number of closures.
  };
  [[nodiscard]] Timestamp here(Timestamp robots) const { return {robots.ns + ahead_ns_}; }

  std::map<std::string, std::vector<Awaited>> awaited_;  // by job
  std::int64_t ahead_ns_ = 0;
  bool knows_ahead_ = false;
  std::uint64_t parts_ = 0;
};

}  // namespace tutti::node
