// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/bus/broker.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

using Clock = std::chrono::steady_clock;

struct Lease {
  LeaseBoard::Value value;
  Clock::time_point until;
};

struct MemoryBus {
  std::mutex mutex;                                                ///< Guards what follows.
  std::map<std::string, Broker> missions;                          ///< By name.
  std::map<std::string, Lease> leases;                             ///< By mission.
  std::map<std::string, std::map<std::string, std::string>> maps;  ///< Published ones, by mission.
  std::uint64_t revision = 0;                                      ///< The last one.
};

/// A bus outlives the ports, as its messages do.
std::shared_ptr<MemoryBus> bus_at(const std::string& url) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<MemoryBus>> buses;
  const std::scoped_lock guard(mutex);
  std::shared_ptr<MemoryBus>& bus = buses[parse_bus_url(url).value().plain];
  if (!bus) bus = std::make_shared<MemoryBus>();
  return bus;
}

class MemoryPort final : public Port {
 public:
  MemoryPort(Endpoint self, BusOptions options)
      : self_(self), options_(std::move(options)), bus_(bus_at(options_.url)), broker_([&]() -> Broker& {
          const std::scoped_lock guard(bus_->mutex);
          return bus_->missions[options_.mission];
        }()) {
    static_cast<void>(connect());
  }
  ~MemoryPort() override {
    const std::scoped_lock guard(bus_->mutex);
    if (connected_) broker_.disconnect(self_);
  }
  MemoryPort(const MemoryPort&) = delete;
  MemoryPort& operator=(const MemoryPort&) = delete;

  Status send(Envelope envelope) override {
    TUTTI_CHECK(envelope.from == self_ && envelope.bytes != nullptr, "a message of somebody else, or without bytes");
    if (Status connected = connect(); !connected) return connected;
    const std::scoped_lock guard(bus_->mutex);
    if (broker_.is_waiting(envelope)) return {};
    const Delivery delivery = delivery_of(envelope.kind);
    const std::uint64_t waiting = delivery == Delivery::retained ? 0 : broker_.bytes_of(self_);
    if (waiting + envelope.bytes->size() > options_.max_waiting_bytes && delivery != Delivery::retained) {
      if (delivery == Delivery::best_effort) return {};
      return fail(ErrorCode::io, "{} {}: {} bytes wait to be acknowledged already, {} may", wire::name(envelope.kind),
                  envelope.id, waiting, options_.max_waiting_bytes);
    }
    broker_.retain(envelope);
    broker_.arrive(std::move(envelope));
    return {};
  }
  std::vector<Received> receive() override {
    if (!connect()) return {};
    const std::scoped_lock guard(bus_->mutex);
    return broker_.receive(self_);
  }
  void acknowledge(std::uint64_t ticket) override {
    const std::scoped_lock guard(bus_->mutex);
    broker_.acknowledge(ticket);
  }
  void still_busy(std::uint64_t /*ticket*/) override {}  // a job stays with its worker's port
  [[nodiscard]] LinkState state() const override {
    return {.url = without_credentials(options_.url), .connected = connected_, .last_error = last_error_};
  }

 private:
  Status connect() {
    if (connected_) return {};
    Status may = options_.may_connect ? options_.may_connect() : Status();
    const std::scoped_lock guard(bus_->mutex);
    if (may && broker_.has_port(self_))
      may = fail(ErrorCode::io, "{}: {} {} is there already", options_.url, name(self_.role), self_.number);
    connected_ = may.has_value();
    last_error_ = may ? "" : may.error().message;
    if (!may) return may;
    for (Envelope& envelope : broker_.connect(self_)) broker_.arrive(std::move(envelope));
    return {};
  }

  const Endpoint self_;
  const BusOptions options_;
  const std::shared_ptr<MemoryBus> bus_;
  Broker& broker_;  // of bus_
  bool connected_ = false;
  std::string last_error_;
};

class MemoryLeases final : public LeaseBoard {
 public:
  explicit MemoryLeases(std::shared_ptr<MemoryBus> bus) : bus_(std::move(bus)) {}

  Result<std::optional<Value>> read(const std::string& mission) override {
    const std::scoped_lock guard(bus_->mutex);
    const auto found = find(mission);
    return found == bus_->leases.end() ? std::nullopt : std::optional(found->second.value);
  }
  Result<std::map<std::string, Value>> read_all() override {
    const std::scoped_lock guard(bus_->mutex);
    std::map<std::string, Value> all;
    for (const auto& [mission, lease] : bus_->leases)
      if (lease.until > Clock::now()) all.emplace(mission, lease.value);
    return all;
  }
  Status write(const std::string& mission, const Value& value, double lasts_s) override {
    const std::scoped_lock guard(bus_->mutex);
    const auto found = find(mission);
    const std::uint64_t there = found == bus_->leases.end() ? 0 : found->second.value.revision;
    if (there != value.revision)
      return fail(ErrorCode::io, "the lease of mission '{}' has revision {}, expected {}", mission, there,
                  value.revision);
    const auto lasts = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(lasts_s));
    bus_->leases.insert_or_assign(mission, Lease{{value.text, ++bus_->revision}, Clock::now() + lasts});
    return {};
  }
  void remove(const std::string& mission) override {
    const std::scoped_lock guard(bus_->mutex);
    bus_->leases.erase(mission);
  }

 private:
  /// One that has not expired.
  [[nodiscard]] std::map<std::string, Lease>::const_iterator find(const std::string& mission) const {
    const auto found = bus_->leases.find(mission);
    return found == bus_->leases.end() || found->second.until > Clock::now() ? found : bus_->leases.end();
  }

  const std::shared_ptr<MemoryBus> bus_;
};

class MemoryMaps final : public MapBoard {
 public:
  MemoryMaps(std::shared_ptr<MemoryBus> bus, std::string mission)
      : bus_(std::move(bus)), mission_(std::move(mission)) {}

  Result<std::optional<std::string>> read(const std::string& key) override {
    const std::scoped_lock guard(bus_->mutex);
    const auto& values = bus_->maps[mission_];
    const auto found = values.find(key);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  }
  Status write(const std::string& key, std::string_view bytes) override {
    const std::scoped_lock guard(bus_->mutex);
    bus_->maps[mission_].insert_or_assign(key, std::string(bytes));
    return {};
  }

 private:
  const std::shared_ptr<MemoryBus> bus_;
  const std::string mission_;
};

}  // namespace

std::unique_ptr<Port> open_memory_port(Endpoint endpoint, const BusOptions& options) {
  return std::make_unique<MemoryPort>(endpoint, options);
}

std::unique_ptr<LeaseBoard> open_memory_leases(const BusOptions& options) {
  return std::make_unique<MemoryLeases>(bus_at(options.url));
}

std::unique_ptr<MapBoard> open_memory_maps(const BusOptions& options) {
  return std::make_unique<MemoryMaps>(bus_at(options.url), options.mission);
}

}  // namespace tutti::bus
