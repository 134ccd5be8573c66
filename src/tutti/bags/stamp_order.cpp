// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/stamp_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

namespace tutti::bags {
namespace {

constexpr double kFarAhead_s = 10.0;
constexpr double kClockSet_s = 86'400.0;  // no robot rests that long within a recording: its clock was set
constexpr std::size_t kLeastConfirmed = 3, kConfirmed = 5;  // messages that must be of the same clock

/// True if the messages from `at` on, a few, are all before `limit`.
bool stays_before(std::span<const Arrival> arrivals, std::size_t at, Timestamp limit) {
  const auto next = arrivals.subspan(at, std::min(kConfirmed, arrivals.size() - at));
  return next.size() >= kLeastConfirmed &&
         std::ranges::all_of(next, [&](const Arrival& arrival) { return arrival.stamp < limit; });
}

/// The same behind it.
bool stays_behind(std::span<const Arrival> arrivals, std::size_t at, Timestamp limit) {
  const auto next = arrivals.subspan(at, std::min(kConfirmed, arrivals.size() - at));
  return next.size() >= kLeastConfirmed &&
         std::ranges::all_of(next, [&](const Arrival& arrival) { return arrival.stamp > limit; });
}

using Refused = std::vector<std::pair<std::size_t, std::string>>;

/// Runs, and the positions of what is in none.
std::pair<std::vector<StampOrder::Run>, Refused> runs_of(std::span<const Arrival> arrivals) {
  std::vector<StampOrder::Run> runs;
  Refused refused;
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const Timestamp stamp = arrivals[i].stamp;
    if (runs.empty()) {
      runs.push_back({i, i + 1, stamp, stamp});
      continue;
    }
    StampOrder::Run& run = runs.back();
    const Timestamp oldest = run.last - kSortWithin_s;
    const Timestamp set = run.last + kClockSet_s;
    if ((stamp < oldest && stays_before(arrivals, i, oldest)) || (stamp > set && stays_behind(arrivals, i, set))) {
      runs.push_back({i, i + 1, stamp, stamp});
      continue;
    }
    run.end = i + 1;
    const bool is_alone = stamp - run.last > kFarAhead_s && stays_before(arrivals, i + 1, stamp - kSortWithin_s);
    if (stamp < oldest || is_alone) {
      refused.emplace_back(
          i, fmt::format("stamp {} ns is {:.1f} s {} {} ns, expected within {} s", stamp.ns, std::abs(stamp - run.last),
                         is_alone ? "ahead of" : "behind", run.last.ns, is_alone ? kFarAhead_s : kSortWithin_s));
      continue;
    }
    run.first = std::min(run.first, stamp);
    run.last = std::max(run.last, stamp);
  }
  return {std::move(runs), std::move(refused)};
}

}  // namespace

std::vector<std::size_t> log_order(std::span<const Arrival> arrivals) {
  constexpr std::size_t kLong = 10;        // messages
  constexpr std::size_t kPerExchange = 4;  // runs; stretches that change places make two or three each
  std::vector<std::size_t> stored(arrivals.size());
  std::iota(stored.begin(), stored.end(), std::size_t{0});
  std::vector<std::size_t> logged = stored;
  std::ranges::stable_sort(logged, {}, [&](std::size_t i) { return arrivals[i].logged; });
  std::size_t stretches = 1, runs = 1;  // of increasing times as stored; of stored order as sorted
  for (std::size_t i = 1; i < arrivals.size(); ++i) {
    stretches += arrivals[i].logged < arrivals[i - 1].logged ? 1 : 0;
    runs += logged[i] != logged[i - 1] + 1 ? 1 : 0;
  }
  const bool alternate =
      arrivals.size() < kLong * runs && arrivals.size() >= kLong * stretches && runs > kPerExchange * stretches;
  return alternate ? stored : logged;
}

StampOrder order_by_stamp(std::span<const Arrival> arrivals) {
  StampOrder out;
  auto [runs, refused] = runs_of(arrivals);
  out.runs = std::move(runs);
  if (out.runs.empty()) return out;
  const auto longest = std::ranges::max_element(out.runs, {}, &StampOrder::Run::duration_s);
  out.run = static_cast<std::size_t>(longest - out.runs.begin());
  const auto is_in = [&](std::size_t at) { return longest->begin <= at && at < longest->end; };
  std::ranges::copy_if(refused, std::back_inserter(out.refused), [&](const auto& one) { return is_in(one.first); });

  std::vector<std::size_t> order;
  std::optional<Timestamp> newest;
  auto next_refused = out.refused.begin();
  for (std::size_t i = longest->begin; i < longest->end; ++i) {
    if (next_refused != out.refused.end() && next_refused->first == i) {
      ++next_refused;
      continue;
    }
    order.push_back(i);
    out.late += newest && arrivals[i].stamp < *newest ? 1 : 0;
    newest = newest ? std::max(*newest, arrivals[i].stamp) : arrivals[i].stamp;
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return arrivals[i].stamp; });
  for (const std::size_t i : order) {
    const Timestamp stamp = arrivals[i].stamp;
    if (out.used.empty() || arrivals[out.used.back()].stamp < stamp)
      out.used.push_back(i);
    else
      out.refused.emplace_back(i, fmt::format("stamp {} ns, which another message has, too{}", stamp.ns,
                                              stamp.ns == 0 ? ": its publisher does not fill header.stamp" : ""));
  }
  std::ranges::sort(out.refused);
  return out;
}

std::string StampOrder::in_words() const {
  if (runs.size() < 2) return {};
  std::string out = fmt::format("its clock starts again {} times:", runs.size() - 1);
  for (std::size_t i = 0; i < runs.size(); ++i)
    out += fmt::format("{} messages {} to {} last {:.1f} s from {} ns on ({})", i == 0 ? "" : ",", runs[i].begin + 1,
                       runs[i].end, runs[i].duration_s(), runs[i].first.ns, i == run ? "used" : "left out");
  return out;
}

}  // namespace tutti::bags
