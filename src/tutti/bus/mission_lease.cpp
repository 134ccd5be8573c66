// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/mission_lease.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/nats_names.hpp"

namespace tutti::bus {
namespace {

constexpr const char* kBucket = "TUTTI_SERVERS";
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::size_t kMostMissions = 1000;
constexpr double kTryAgain_s = 0.5;

struct EntryFree {
  void operator()(kvEntry* entry) const { kvEntry_Destroy(entry); }
};

/// A line each.
std::string lease_text(const LeaseHolder& holder) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n", plain_text(holder.host), holder.process, plain_text(holder.state),
                     holder.since_ns, plain_text(holder.seat));
}

/// What somebody else has written there is a holder, too.
LeaseHolder lease_of(std::string_view text) {
  LeaseHolder holder;
  std::istringstream lines{std::string(text.substr(0, 4096))};
  std::string process, since;
  std::getline(lines, holder.host) && std::getline(lines, process) && std::getline(lines, holder.state) &&
      std::getline(lines, since) && std::getline(lines, holder.seat);
  holder.process = std::strtoull(process.c_str(), nullptr, 10);
  holder.since_ns = std::strtoll(since.c_str(), nullptr, 10);
  for (std::string* word : {&holder.host, &holder.state, &holder.seat}) *word = plain_text(*word);
  return holder;
}

struct FoundLease {
  LeaseHolder holder;
  std::uint64_t revision = 0;
};

std::optional<FoundLease> read_lease(kvStore* leases, const std::string& mission) {
  kvEntry* read = nullptr;
  if (kvStore_Get(&read, leases, mission.c_str()) != NATS_OK) return std::nullopt;
  const std::unique_ptr<kvEntry, EntryFree> entry(read);
  const auto* value = static_cast<const char*>(kvEntry_Value(read));
  const std::string_view text(value == nullptr ? "" : value, static_cast<std::size_t>(kvEntry_ValueLen(read)));
  return FoundLease{lease_of(text), kvEntry_Revision(read)};
}

std::map<std::string, LeaseHolder> read_leases(kvStore* leases) {
  std::map<std::string, LeaseHolder> out;
  kvKeysList keys{};
  if (kvStore_Keys(&keys, leases, nullptr) != NATS_OK) return out;  // there is none, too
  for (int i = 0; i < keys.Count && out.size() < kMostMissions; ++i)
    if (auto found = read_lease(leases, keys.Keys[i])) out.emplace(keys.Keys[i], std::move(found->holder));
  kvKeysList_Destroy(&keys);
  return out;
}

}  // namespace

std::string to_string(const LeaseHolder& holder) {
  const std::time_t seconds = holder.since_ns / kSecond_ns;
  std::tm utc{};
  char text[32] = "?";
  if (gmtime_r(&seconds, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc);
  return fmt::format("process {} on {}, state {}, since {}", holder.process, holder.host, holder.state, text);
}

Status check_mission_name(const std::string& name) {
  if (is_mission_name(name)) return {};
  return fail(ErrorCode::configuration, "mission '{}': 1 to 32 letters, digits, '-' and '_' were expected", name);
}

Result<std::unique_ptr<MissionLease>> MissionLease::open(const NatsPortOptions& where, std::optional<LeaseHolder> self,
                                                         double look_s) {
  if (const Status checked = check(where); !checked) return tl::unexpected(checked.error());
  return std::unique_ptr<MissionLease>(new MissionLease(where, std::move(self), look_s));
}

MissionLease::MissionLease(NatsPortOptions where, std::optional<LeaseHolder> self, double look_s)
    : where_(std::move(where)), self_(std::move(self)), look_s_(look_s), thread_([this] { run(); }) {}

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
  changed_.wait_for(guard, std::chrono::duration<double>(wall_s), [&] { return state_.has_looked || stopping_; });
  return state_;
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
    const double served_s = state_.server_of(where_.mission) != nullptr ? kRest_s : look_s_;
    const double pause_s = !done ? kTryAgain_s : self_ ? kRenew_s : served_s;
    changed_.wait_for(guard, std::chrono::duration<double>(pause_s), [&] { return stopping_; });
  }
  const bool held = state_.held;
  guard.unlock();
  if (held && connection && connection->connected()) give_up(*connection);
}

/// Takes or renews the lease, and reads the others'.
Status MissionLease::look(const NatsConnection& connection) {
  auto leases = connection.bucket(kBucket, self_ ? std::optional(kLease_s) : std::nullopt);
  if (!leases) return tl::unexpected(leases.error());
  std::map<std::string, LeaseHolder> missions;
  bool held = false;
  if (*leases) {
    const auto there = read_lease(leases->get(), where_.mission);
    if (self_) {
      const std::string mine = lease_text(*self_);
      std::uint64_t revision = 0;
      const bool is_mine = there && there->holder.seat == lease_of(mine).seat;
      natsStatus status = NATS_OK;
      if (!there)
        status = kvStore_CreateString(&revision, leases->get(), where_.mission.c_str(), mine.c_str());
      else if (is_mine)
        status = kvStore_UpdateString(&revision, leases->get(), where_.mission.c_str(), mine.c_str(), there->revision);
      held = (!there || is_mine) && status == NATS_OK;
      if (status != NATS_OK)
        return fail(ErrorCode::io, "{}: the lease of mission '{}': {}", where_.url, where_.mission,
                    natsStatus_GetText(status));
    }
    if (there && !held)
      missions.emplace(where_.mission, there->holder);
    else if (!self_)
      missions = read_leases(leases->get());
  }
  const std::scoped_lock guard(mutex_);
  state_.has_looked = true;
  state_.held = held;
  state_.missions = std::move(missions);
  return {};
}

void MissionLease::give_up(const NatsConnection& connection) const {
  const auto leases = connection.bucket(kBucket, std::nullopt);
  if (!leases || !*leases) return;
  const auto there = read_lease(leases->get(), where_.mission);
  if (there && there->holder == lease_of(lease_text(*self_))) kvStore_Delete(leases->get(), where_.mission.c_str());
}

Result<std::string> served_mission(const NatsPortOptions& where, double wall_s) {
  auto lease = MissionLease::open(where, std::nullopt, kTryAgain_s);
  if (!lease) return tl::unexpected(lease.error());
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(wall_s);
  MissionLease::State seen = (*lease)->wait(wall_s);
  while (seen.missions.empty() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    seen = (*lease)->state();
  }
  if (seen.missions.empty() || seen.server_of(where.mission) != nullptr) return where.mission;
  if (seen.missions.size() == 1) return seen.missions.begin()->first;
  std::vector<std::string> names;
  for (const auto& [mission, holder] : seen.missions) names.push_back(mission);
  return fail(ErrorCode::configuration, "{}: several missions are served there ({}): --mission NAME chooses one",
              where.url, fmt::join(names, ", "));
}

}  // namespace tutti::bus
