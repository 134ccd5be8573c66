// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/mission_lease.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/nats_names.hpp"

namespace tutti::bus {
namespace {

constexpr const char* kBucket = "TUTTI_SERVERS";
constexpr std::size_t kMostMissions = 1000;
constexpr double kTryAgain_s = 0.5;
constexpr double kSaySoon_s = 1.5;

struct EntryFree {
  void operator()(kvEntry* entry) const { kvEntry_Destroy(entry); }
};

struct Value {
  std::optional<LeaseHolder> holder;  ///< Nothing: it is no lease.
  std::uint64_t revision = 0;
};

std::optional<Value> read_value(kvStore* leases, const std::string& mission) {
  kvEntry* read = nullptr;
  if (kvStore_Get(&read, leases, mission.c_str()) != NATS_OK) return std::nullopt;
  const std::unique_ptr<kvEntry, EntryFree> entry(read);
  const auto* value = static_cast<const char*>(kvEntry_Value(read));
  const std::string_view text(value == nullptr ? "" : value, static_cast<std::size_t>(kvEntry_ValueLen(read)));
  return Value{lease_of(text), kvEntry_Revision(read)};
}

std::map<std::string, LeaseHolder> read_leases(kvStore* leases) {
  std::map<std::string, LeaseHolder> out;
  kvKeysList keys{};
  if (kvStore_Keys(&keys, leases, nullptr) != NATS_OK) return out;  // there is none, too
  for (int i = 0; i < keys.Count && out.size() < kMostMissions; ++i)
    if (auto found = read_value(leases, keys.Keys[i]); found && found->holder && is_mission_name(keys.Keys[i]))
      out.emplace(keys.Keys[i], std::move(*found->holder));
  kvKeysList_Destroy(&keys);
  return out;
}

}  // namespace

Status check_mission_name(const std::string& name) {
  if (is_mission_name(name)) return {};
  return fail(ErrorCode::configuration, "mission '{}': 1 to 32 letters, digits, '-' and '_' were expected", name);
}

Result<std::unique_ptr<MissionLease>> MissionLease::open(const NatsPortOptions& where, std::optional<LeaseHolder> self,
                                                         const LeaseTimes& times) {
  if (const Status checked = check(where); !checked) return tl::unexpected(checked.error());
  if (self) self = lease_of(lease_text(*self));
  return std::unique_ptr<MissionLease>(new MissionLease(where, std::move(self), times));
}

MissionLease::MissionLease(NatsPortOptions where, std::optional<LeaseHolder> self, const LeaseTimes& times)
    : where_(std::move(where)), self_(std::move(self)), times_(times), thread_([this] { run(); }) {}

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
  std::shared_ptr<NatsConnection> connection;
  std::unique_lock guard(mutex_);
  while (!stopping_) {
    guard.unlock();
    Status done;
    if (!connection || connection->closed()) {
      auto opened = NatsConnection::open(where_, fmt::format("lease_{}", where_.mission));
      if (opened)
        connection = std::move(*opened);
      else
        done = tl::unexpected(opened.error());
    }
    if (done) done = look(*connection);
    if (done && !self_) connection.reset();  // a radio has better things to carry
    guard.lock();
    state_.last_error = done ? "" : done.error().message;
    changed_.notify_all();
    const double served_s = state_.server_of(where_.mission) != nullptr ? times_.rest_s : times_.look_s;
    const double pause_s = !done ? kTryAgain_s : self_ ? times_.renew_s : served_s;
    changed_.wait_for(guard, std::chrono::duration<double>(pause_s), [&] { return stopping_; });
  }
  const bool held = state_.held;
  guard.unlock();
  if (held && connection && connection->connected()) give_up(*connection);
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

/// Takes or renews the lease, or reads the others'.
Status MissionLease::look(const NatsConnection& connection) {
  auto leases = connection.bucket(kBucket, self_ ? std::optional(times_.lease_s) : std::nullopt);
  if (!leases) return tl::unexpected(leases.error());
  State seen{.has_looked = true};
  if (*leases) {
    const auto there = read_value(leases->get(), where_.mission);
    if (self_) {
      const std::string mine = lease_text(*self_);
      std::uint64_t revision = 0;
      if (there && !may_take(there->holder, there->revision)) {
        const std::scoped_lock guard(mutex_);
        state_.has_looked = true;
        return {};
      }
      const natsStatus status =
          there ? kvStore_UpdateString(&revision, leases->get(), where_.mission.c_str(), mine.c_str(), there->revision)
                : kvStore_CreateString(&revision, leases->get(), where_.mission.c_str(), mine.c_str());
      if (status != NATS_OK)
        return connection.failure(status, fmt::format("the lease of mission '{}'", where_.mission));
      written_ = Clock::now();
      other_.reset();
      seen.held = true;
    } else if (there && there->holder) {
      seen.missions.emplace(where_.mission, *there->holder);
    } else {
      seen.missions = read_leases(leases->get());
    }
  }
  const std::scoped_lock guard(mutex_);
  state_ = std::move(seen);
  return {};
}

void MissionLease::give_up(const NatsConnection& connection) const {
  const auto leases = connection.bucket(kBucket, std::nullopt);
  if (!leases || !*leases) return;
  const auto there = read_value(leases->get(), where_.mission);
  if (there && there->holder == self_) kvStore_Delete(leases->get(), where_.mission.c_str());
}

Result<std::string> served_mission(const NatsPortOptions& where, double wall_s,
                                   const std::function<void(const std::string&)>& say) {
  auto lease = MissionLease::open(where, std::nullopt, {.look_s = kTryAgain_s});
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
  if (seen.missions.empty() || seen.server_of(where.mission) != nullptr) return where.mission;
  if (seen.missions.size() == 1) return seen.missions.begin()->first;
  std::vector<std::string> names;
  for (const auto& [mission, holder] : seen.missions) names.push_back(mission);
  return fail(ErrorCode::configuration, "{}: several missions are served there ({}): --mission NAME chooses one",
              without_credentials(where.url), fmt::join(names, ", "));
}

}  // namespace tutti::bus
