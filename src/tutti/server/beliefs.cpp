// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/beliefs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace tutti::server {
namespace {

bool touches(const Beliefs::Ends& closure, const ChainId& chain) {
  return closure.first.chain == chain || closure.second.chain == chain;
}

bool overlap(const FailedOdometry& a, const FailedOdometry& b) {
  return a.chain == b.chain && a.from < b.to && b.from < a.to;
}

/// Segments of the chain in `these` with which none of `others` overlaps.
std::size_t only_in(const std::vector<FailedOdometry>& these, const std::vector<FailedOdometry>& others,
                    const ChainId& chain) {
  return static_cast<std::size_t>(std::ranges::count_if(these, [&](const FailedOdometry& failed) {
    return failed.chain == chain &&
           std::ranges::none_of(others, [&](const FailedOdometry& other) { return overlap(failed, other); });
  }));
}

}  // namespace

Beliefs beliefs_of(const MapEstimate& map) {
  Beliefs out;
  for (const JudgedClosure& judged : map.closures)
    (judged.accepted ? out.accepted : out.refused).insert({judged.closure.from, judged.closure.to});
  out.failed_odometry = map.failed_odometry;
  return out;
}

ChangeReason reason_of_change(const Beliefs& older, const Beliefs& newer, const ChainId& chain) {
  ChangeReason out;
  const auto count = [&](const Beliefs::Ends& closure, std::size_t& own) {
    ++(touches(closure, chain) ? own : out.elsewhere);
  };
  for (const Beliefs::Ends& closure : newer.accepted)
    if (!older.accepted.contains(closure)) count(closure, older.refused.contains(closure) ? out.taken_up : out.found);
  for (const Beliefs::Ends& closure : older.accepted)
    if (!newer.accepted.contains(closure)) count(closure, out.dropped);
  out.failed = only_in(newer.failed_odometry, older.failed_odometry, chain);
  out.recovered = only_in(older.failed_odometry, newer.failed_odometry, chain);
  return out;
}

std::string to_string(const ChangeReason& reason) {
  std::vector<std::string> parts;
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) parts.push_back(fmt::format("{} {}", count, what));
  };
  add(reason.found, "of its closures are new");
  add(reason.taken_up, "of its closures that were refused are accepted");
  add(reason.dropped, "of its closures that were accepted are refused");
  add(reason.failed, "segments of its odometry are taken to have failed");
  add(reason.recovered, "segments of its odometry are believed again");
  if (parts.empty()) add(reason.elsewhere, "closures of other robots changed");
  if (parts.empty()) parts.emplace_back("what its odometry and closures are worth was judged anew");
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace tutti::server
