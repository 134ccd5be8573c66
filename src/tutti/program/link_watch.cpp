// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/link_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace tutti::program {
namespace {

constexpr double kWorkerIsThere_s = 30.0;  // fifteen of its statuses, or as many fewer as a mission is played faster

/// ": why", without the bus's address, which most errors of a port begin with and the sentence has already.
std::string why_of(const bus::LinkState& state) {
  const std::string_view error = state.last_error;
  const std::string address = state.url + ": ";
  return error.empty() ? "" : fmt::format(": {}", error.starts_with(address) ? error.substr(address.size()) : error);
}

}  // namespace

std::vector<LinkWatch::Line> LinkWatch::check(const bus::LinkState& state, double wall_s) {
  std::vector<Line> out;
  const auto say = [&](Level level, std::string sentence) { out.push_back({level, std::move(sentence)}); };
  trouble_.clear();
  const std::string why = why_of(state);
  if (!state.connected) {
    if (!gone_since_s_) gone_since_s_ = wall_s;
    const double gone_s = wall_s - *gone_since_s_;
    if (gone_s < kPatience_s) return out;
    trouble_ = fmt::format("no link to the bus {} for {:.0f} s{}", state.url, gone_s, why);
    if (!std::exchange(said_gone_, true))
      say(Level::warning, fmt::format("{} the bus {}{}; goes on without, and tries again and again",
                                      was_there_ ? "lost its link to" : "cannot reach", state.url, why));
    return out;
  }
  if (std::exchange(said_gone_, false))
    say(Level::info,
        fmt::format("the link to the bus {} is there, after {:.0f} s", state.url, wall_s - *gone_since_s_));
  gone_since_s_.reset();
  was_there_ = true;
  if (state.streams_made_anew > made_anew_) say(Level::warning, state.last_error);
  made_anew_ = state.streams_made_anew;
  const bool is_in_vain = state.given_in_vain > 0;
  if (is_in_vain)
    trouble_ = fmt::format("jobs were given to workers {} times since one was last answered, each of them at least {}",
                           state.given_in_vain, bus::LinkState::kGivenInVain);
  if (is_in_vain && !reported_in_vain_) say(Level::error, trouble_);
  if (!is_in_vain && reported_in_vain_) say(Level::info, "jobs are answered again");
  reported_in_vain_ = is_in_vain;
  const bool was_strange = strange_s_ && wall_s - *strange_s_ < kStrange_s;
  if (std::exchange(strange_settlements_, state.strange_settlements) < state.strange_settlements) strange_s_ = wall_s;
  if (strange_s_ && wall_s - *strange_s_ < kStrange_s) {
    trouble_ = fmt::format(
        "worker number {} says of jobs that it was not given that they are done ({} times so far), of which nothing "
        "comes: an intruder has its credential? (tutti pki list, tutti pki revoke)",
        state.strange_settler, state.strange_settlements);
    if (!was_strange) say(Level::warning, trouble_);
  }
  if (!state.denied.empty()) {
    trouble_ = fmt::format("the bus {} does not allow this program what it needs: {}", state.url, state.denied);
    if (std::exchange(reported_denied_, state.denied) != state.denied) say(Level::error, trouble_);
  } else if (state.unconfirmed_s > kStores_s) {
    trouble_ = fmt::format("the bus {} is there and has stored nothing for {:.0f} s: its disk may be full{}", state.url,
                           state.unconfirmed_s, state.last_error.empty() ? "" : " (last error" + why + ")");
    if (!std::exchange(reported_full_, true)) say(Level::error, trouble_);
  } else if (std::exchange(reported_full_, false)) {
    say(Level::info, fmt::format("the bus {} stores again", state.url));
  }
  return out;
}

std::string untaken_trouble(const bus::LinkState& state, const MissionStatus& status) {
  const auto workers = std::ranges::count_if(status.workers, [&](const MissionStatus::Worker& worker) {
    return status.time - worker.last_seen < kWorkerIsThere_s;
  });
  if (workers == 0 || status.pending_jobs == 0 || state.jobs_untaken_s < kUntaken_s) return {};
  return fmt::format(
      "jobs wait ({}), workers are there ({}), and for {:.0f} s none has taken one: start the workers again (tutti "
      "worker; the server's own starts with the server)",
      status.pending_jobs, workers, state.jobs_untaken_s);
}

bool AnewWatch::connects_anew(bool is_in_vain, bool holds_job, double wall_s) {
  if (!is_in_vain || holds_job || (last_s_ && wall_s - *last_s_ < kAgain_s)) return false;
  last_s_ = wall_s;
  return true;
}

}  // namespace tutti::program
