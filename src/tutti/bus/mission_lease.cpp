// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/mission_lease.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>
#include <vector>

namespace tutti::bus {
namespace {

constexpr double kTryAgain_s = 0.5;
constexpr double kSaySoon_s = 1.5;

}  // namespace

Result<std::unique_ptr<MissionLease>> MissionLease::open(const BusOptions& where, std::optional<LeaseHolder> self,
                                                         const LeaseTimes& times) {
  const auto transport = transport_of(where);
  if (!transport) return tl::unexpected(transport.error());
  if (self) self = lease_of(lease_text(*self));
  return std::unique_ptr<MissionLease>(new MissionLease(**transport, where, std::move(self), times));
}

MissionLease::MissionLease(const Transport& transport, BusOptions where, std::optional<LeaseHolder> self,
                           const LeaseTimes& times)
    : transport_(transport), where_(std::move(where)), self_(std::move(self)), times_(times), thread_([this] {
        run();
      }) {}

MissionLease::~MissionLease() {
  {
    const std::scoped_lock guard(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

MissionLease::State MissionLease::state() const {
  const std::scoped_lock guard(mutex_);
  return state_;
}

MissionLease::State MissionLease::wait(double wall_s) const {
  std::unique_lock guard(mutex_);
  changed_.wait_for(guard, std::chrono::duration<double>(wall_s),
                    [&] { return (state_.has_looked && state_.waits.empty()) || stopping_; });
  return state_;
}

Status MissionLease::check_held() const {
  const State seen = state();
  if (seen.held) return {};
  if (!seen.last_error.empty()) return fail(ErrorCode::io, "{}", seen.last_error);
  if (!seen.waits.empty()) return fail(ErrorCode::io, "{}", seen.waits);
  const LeaseHolder* other = seen.server_of(where_.mission);
  return fail(ErrorCode::io, "{}: the lease of mission '{}' is {}, expected this program's",
              without_credentials(where_.url), where_.mission,
              other == nullptr ? "not taken yet" : "that of " + to_string(*other));
}

std::string MissionLease::why_alone() const {
  const State seen = state();
  if (!seen.has_looked || seen.held || seen.missions.empty() || seen.server_of(where_.mission) != nullptr) return {};
  std::string others;
  for (const auto& [mission, holder] : seen.missions)
    others += fmt::format("{}'{}' ({})", others.empty() ? "" : ", ", mission, to_string(holder));
  return fmt::format("no server of mission '{}' is on this bus, but of {}: --mission NAME chooses", where_.mission,
                     others);
}

void MissionLease::run() {
  std::unique_ptr<LeaseBoard> board;
  std::unique_lock guard(mutex_);
  while (!stopping_) {
    guard.unlock();
    if (!board) board = transport_.open_leases(where_);
    const Status done = check_board(*board);
    if (done && !self_) board.reset();  // a radio has better things to carry
    guard.lock();
    state_.last_error = done ? "" : done.error().message;
    changed_.notify_all();
    const double served_s = state_.server_of(where_.mission) != nullptr ? times_.rest_s : times_.look_s;
    const double pause_s = !done ? kTryAgain_s : self_ ? times_.renew_s : served_s;
    changed_.wait_for(guard, std::chrono::duration<double>(pause_s), [&] { return stopping_; });
  }
  const bool held = state_.held;
  guard.unlock();
  if (held && board) give_up(*board);
}

bool MissionLease::may_take(const std::optional<LeaseHolder>& there, std::uint64_t revision) {
  const auto now = Clock::now();
  const auto seconds_since = [&](Clock::time_point then) { return std::chrono::duration<double>(now - then).count(); };
  if (!there || *there == *self_) {
    other_.reset();
    return true;
  }
  if (!other_ || other_->holder != *there) {
    other_ = Other{*there, revision, now, false};
  } else if (other_->revision != revision) {
    other_->revision = revision;
    other_->since = now;
    other_->is_renewed = true;
  }
  const bool is_holder = written_ && seconds_since(*written_) < times_.lease_s;
  const bool may_be_over = is_holder || there->seat == self_->seat;
  const bool is_over = has_ended(*there, *self_) || seconds_since(other_->since) > times_.unrenewed_s;
  if (may_be_over && is_over) return true;
  const std::scoped_lock guard(mutex_);
  const bool is_open = may_be_over && !other_->is_renewed;
  state_.held = is_open && is_holder;
  state_.waits = !is_open ? ""
                          : fmt::format("the lease of mission '{}' is that of {}: waits {:g} s whether it is renewed",
                                        where_.mission, to_string(*there), times_.unrenewed_s);
  state_.missions.clear();
  if (!is_open) state_.missions.emplace(where_.mission, *there);
  if (!is_open) written_.reset();
  return false;
}

Status MissionLease::check_board(LeaseBoard& board) {
  const auto read = board.read(where_.mission);
  if (!read) return tl::unexpected(read.error());
  const auto there = read->has_value() ? lease_of((*read)->text) : std::nullopt;
  const std::uint64_t revision = read->has_value() ? (*read)->revision : 0;
  State seen{.has_looked = true};
  if (self_) {
    if (revision != 0 && !may_take(there, revision)) {
      const std::scoped_lock guard(mutex_);
      state_.has_looked = true;
      return {};
    }
    if (Status done = board.write(where_.mission, {lease_text(*self_), revision}, times_.lease_s); !done) return done;
    written_ = Clock::now();
    other_.reset();
    seen.held = true;
  } else if (there) {
    seen.missions.emplace(where_.mission, *there);
  } else {
    const auto all = board.read_all();
    if (!all) return tl::unexpected(all.error());
    for (const auto& [mission, value] : *all)
      if (auto holder = lease_of(value.text); holder && check_mission_name(mission))
        seen.missions.emplace(mission, std::move(*holder));
  }
  const std::scoped_lock guard(mutex_);
  state_ = std::move(seen);
  return {};
}

void MissionLease::give_up(LeaseBoard& board) const {
  const auto there = board.read(where_.mission);
  if (there && *there && lease_of((*there)->text) == self_) board.remove(where_.mission);
}

Result<std::string> served_mission(const BusOptions& where, double wall_s,
                                   const std::function<void(const std::string&)>& say) {
  if (!where.mission.empty()) return where.mission;
  if (where.credentials.known) return where.credentials.known->mission;
  BusOptions any = where;
  any.mission = kDefaultMission;
  auto lease = MissionLease::open(any, std::nullopt, {.look_s = kTryAgain_s});
  if (!lease) return tl::unexpected(lease.error());
  const auto begin = std::chrono::steady_clock::now();
  const auto since_s = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  MissionLease::State seen = (*lease)->state();
  for (bool has_said = !say; seen.missions.empty() && since_s() < wall_s; seen = (*lease)->state()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (has_said || since_s() < kSaySoon_s) continue;
    say(fmt::format("waits for the server of a mission on {}, at most {:g} s{}", without_credentials(where.url), wall_s,
                    seen.last_error.empty() ? "" : ": " + seen.last_error));
    has_said = true;
  }
  if (seen.missions.empty() || seen.server_of(any.mission) != nullptr) return any.mission;
  if (seen.missions.size() == 1) return seen.missions.begin()->first;
  std::vector<std::string> names;
  for (const auto& [mission, holder] : seen.missions) names.push_back(mission);
  return fail(ErrorCode::configuration, "{}: several missions are served there ({}): --mission NAME chooses one",
              without_credentials(where.url), fmt::join(names, ", "));
}

}  // namespace tutti::bus
