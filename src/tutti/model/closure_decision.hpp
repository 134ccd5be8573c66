// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti {

/// An operator's wish for the closures between two submaps, which outranks the server's own judgement. The numbers are
/// sent and stored, so they never change.
enum class Wish : std::uint8_t {
  accept = 1,   ///< The closures are right: they are in the map, with their covariance, whatever contradicts them.
  reject = 2,   ///< The closures are wrong: they never enter the map.
  withdraw = 3  ///< The operator takes an earlier decision back: the server judges.
};

constexpr const char* to_string(Wish wish) {
  return wish == Wish::accept ? "accept" : wish == Wish::reject ? "reject" : "withdraw";
}

/// An operator's decision on the closures between two submaps.
struct ClosureDecision {
  std::string closure;
  Wish wish = Wish::withdraw;
  std::string by;
  std::int64_t given_ns = 0;
  std::vector<LoopClosure> by_hand = {};
  std::int64_t taken_ns = 0;
  /// From when on it counts: a clock that is ahead makes no decision later than the server took it.
  [[nodiscard]] std::int64_t counts_from_ns() const { return taken_ns > 0 ? std::min(given_ns, taken_ns) : given_ns; }
  template <class V>
  void describe(V& v) {
    constexpr std::size_t kMostBytes = 200;
    v.field(1, "closure", closure, {.text = FieldRule::Text::any, .at_least = 1, .at_most = kMostBytes},
            "The pair's name at the time of the decision.");
    v.field(2, "wish", wish, {.low = 1, .high = 3}, "1: accept, 2: reject, 3: withdraw.");
    v.field(3, "by", by, {.text = FieldRule::Text::any, .at_most = kMostBytes},
            "Who decided, for people; may be empty.");
    v.field(4, "given_ns", given_ns, {}, "Since the Unix epoch, by the operator's clock.");
    v.field(5, "by_hand", by_hand, {.at_most = 1},
            "With accept: a closure that the operator has added, beside those that were found; at most one.");
    v.field(6, "taken_ns", taken_ns, {},
            "When the server took it, by its clock, which it writes itself: given_ns counts up to that. 0: it did not "
            "say.");
  }
  friend bool operator==(const ClosureDecision&, const ClosureDecision&) = default;
};

/// Its closure's sessions, which are not sent, are those of the pair.
inline ClosureDecision with_sessions(ClosureDecision decision, const SubmapPair& pair) {
  for (LoopClosure& closure : decision.by_hand) {
    closure.from.chain = pair.first.chain;
    closure.to.chain = pair.second.chain;
  }
  return decision;
}

/// True if decision `a` counts and not `b`, both being on one pair: the later one counts. Decisions of the same time
/// are ordered by their other fields, so that the outcome does not depend on the order of arrival.
inline bool holds_over(const ClosureDecision& a, const ClosureDecision& b) {
  const std::int64_t a_ns = a.counts_from_ns(), b_ns = b.counts_from_ns();
  return std::tie(a_ns, a.wish, a.by, a.closure) > std::tie(b_ns, b.wish, b.by, b.closure);
}

/// The decision that counts for each pair. Withdrawals are kept too, so that an older decision which arrives late
/// cannot come into force again.
using DecisionSet = std::map<SubmapPair, ClosureDecision>;

/// True if the decision that counts for `pair` is `wish`.
inline bool says(const DecisionSet& decisions, const SubmapPair& pair, Wish wish) {
  const auto found = decisions.find(pair);
  return found != decisions.end() && found->second.wish == wish;
}

}  // namespace tutti
