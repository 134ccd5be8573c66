// SPDX-License-Identifier: BSD-3-Clause
// A bus keeps the leases of servers and the maps that are published to robots, for those who ask.
#include <fmt/format.h>

#include <memory>
#include <utility>

#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

constexpr const char* kBucket = "TUTTI_SERVERS";
constexpr int kMostLeases = 1000;

struct EntryFree {
  void operator()(kvEntry* entry) const { kvEntry_Destroy(entry); }
};

std::optional<LeaseBoard::Value> value_of(kvStore* bucket, const std::string& mission) {
  kvEntry* read = nullptr;
  if (kvStore_Get(&read, bucket, mission.c_str()) != NATS_OK) return std::nullopt;
  const std::unique_ptr<kvEntry, EntryFree> entry(read);
  const auto* text = static_cast<const char*>(kvEntry_Value(read));
  return LeaseBoard::Value{text == nullptr ? "" : std::string(text, static_cast<std::size_t>(kvEntry_ValueLen(read))),
                           kvEntry_Revision(read)};
}

class NatsLeases final : public LeaseBoard {
 public:
  explicit NatsLeases(const BusOptions& where) : link_(where, "lease_" + where.mission) {}

  /// Who has a credential and is no server may read the lease of its mission alone, and without the bucket.
  Result<std::optional<Value>> read(const std::string& mission) override {
    if (is_member()) {
      if (Status done = link_.connect(); !done) return tl::unexpected(done.error());
      auto text = link_.connection().retained(std::string("KV_") + kBucket, fmt::format("$KV.{}.{}", kBucket, mission));
      if (!text) return tl::unexpected(text.error());
      return *text ? std::optional(Value{std::move(**text), 1}) : std::nullopt;
    }
    const auto there = bucket(std::nullopt);
    if (!there) return tl::unexpected(there.error());
    return *there ? value_of(there->get(), mission) : std::nullopt;
  }

  Result<std::map<std::string, Value>> read_all() override {
    std::map<std::string, Value> all;
    if (is_member()) return all;
    const auto there = bucket(std::nullopt);
    if (!there) return tl::unexpected(there.error());
    kvKeysList keys{};
    if (!*there || kvStore_Keys(&keys, there->get(), nullptr) != NATS_OK) return all;  // it is empty, too
    for (int i = 0; i < std::min(keys.Count, kMostLeases); ++i)
      if (auto value = value_of(there->get(), keys.Keys[i])) all.emplace(keys.Keys[i], std::move(*value));
    kvKeysList_Destroy(&keys);
    return all;
  }

  Status write(const std::string& mission, const Value& value, double lasts_s) override {
    const auto there = bucket(lasts_s);
    if (!there) return tl::unexpected(there.error());
    std::uint64_t revision = 0;
    const natsStatus status =
        value.revision == 0
            ? kvStore_CreateString(&revision, there->get(), mission.c_str(), value.text.c_str())
            : kvStore_UpdateString(&revision, there->get(), mission.c_str(), value.text.c_str(), value.revision);
    return status == NATS_OK ? Status()
                             : link_.connection().failure(status, fmt::format("the lease of mission '{}'", mission));
  }

  void remove(const std::string& mission) override {
    if (!link_.connected()) return;
    if (const auto there = bucket(std::nullopt); there && *there) kvStore_Delete(there->get(), mission.c_str());
  }

 private:
  [[nodiscard]] bool is_member() const {
    return link_.where().credentials.known && link_.where().credentials.known->role != BusRole::server;
  }
  Result<NatsOwned<kvStore>> bucket(std::optional<double> lasts_s) {
    if (Status done = link_.connect(); !done) return tl::unexpected(done.error());
    return link_.connection().bucket(kBucket, lasts_s);
  }

  NatsLink link_;
};

class NatsMaps final : public MapBoard {
 public:
  explicit NatsMaps(const BusOptions& where) : link_(where, "maps_" + where.mission) {}

  Result<std::optional<std::string>> read(const std::string& key) override {
    if (Status done = link_.connect(); !done) return tl::unexpected(done.error());
    return link_.connection().retained(map_stream(link_.where().mission), subject(key));
  }
  Status write(const std::string& key, std::string_view bytes) override {
    if (Status done = link_.connect(); !done) return done;
    return link_.connection().store(subject(key), bytes);
  }

 private:
  [[nodiscard]] std::string subject(const std::string& key) const {
    return fmt::format("mission.{}.map.{}", link_.where().mission, key);
  }

  NatsLink link_;
};

}  // namespace

std::unique_ptr<LeaseBoard> open_nats_leases(const BusOptions& options) {
  return std::make_unique<NatsLeases>(options);
}

std::unique_ptr<MapBoard> open_nats_maps(const BusOptions& options) { return std::make_unique<NatsMaps>(options); }

}  // namespace tutti::bus
