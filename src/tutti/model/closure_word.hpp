// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "tutti/model/loop_closure.hpp"

namespace tutti {

/// What an operator says of the closures between two submaps. It stands above what the server finds. The numbers travel
/// and are stored.
enum class Wish : std::uint8_t {
  accept = 1,   ///< They are right: they are in the map, with their covariance, whatever contradicts them.
  reject = 2,   ///< They are wrong: they never enter the map.
  withdraw = 3  ///< Nothing is said any more: the server judges.
};

constexpr const char* to_string(Wish wish) {
  return wish == Wish::accept ? "accept" : wish == Wish::reject ? "reject" : "withdraw";
}

struct ClosureWord {
  std::string closure;  ///< The pair, by its name (server/closure_names.hpp) when it was said.
  Wish wish = Wish::withdraw;
  std::string by;             ///< Who said it, for people; may be empty.
  std::int64_t given_ns = 0;  ///< When, since the Unix epoch.
  friend bool operator==(const ClosureWord&, const ClosureWord&) = default;
};

/// Of two words on one pair that which was given later holds; in doubt, one of the two, whichever came first.
inline bool holds_over(const ClosureWord& a, const ClosureWord& b) {
  return std::tie(a.given_ns, a.wish, a.by, a.closure) > std::tie(b.given_ns, b.wish, b.by, b.closure);
}

/// The word that holds on each pair, withdrawn ones too: an older one that comes late must not hold again.
using WordSet = std::map<SubmapPair, ClosureWord>;

/// True if the word on this pair is this one.
inline bool says(const WordSet& words, const SubmapPair& pair, Wish wish) {
  const auto found = words.find(pair);
  return found != words.end() && found->second.wish == wish;
}

}  // namespace tutti
