// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/transport.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/internal/transports.hpp"

namespace tutti::bus {
namespace {

/// The server has a worker of its own, number 0.
bool is_for(const BusUser& user, Endpoint end) {
  switch (end.role) {
    case Endpoint::Role::server:
      return user.role == BusRole::server;
    case Endpoint::Role::robot:
      return user.role == BusRole::robot && user.number == end.number;
    case Endpoint::Role::worker:
      return end.number == 0 ? user.role == BusRole::server : user.role == BusRole::worker && user.number == end.number;
    case Endpoint::Role::viewer:
      return user.role == BusRole::views || user.role == BusRole::operates;
  }
  return false;
}

}  // namespace

const std::vector<Transport>& transports() {
  static const std::vector<Transport> rows{
      {"nats", "nats://HOST:PORT", "a nats-server", &check_nats, &open_nats_port, &open_nats_leases, &open_nats_maps},
      {"tls", "tls://HOST:PORT", "a nats-server that asks for TLS", &check_nats, &open_nats_port, &open_nats_leases,
       &open_nats_maps},
      {"memory", "memory://NAME", "within one process", nullptr, &open_memory_port, &open_memory_leases,
       &open_memory_maps},
  };
  return rows;
}

std::string transports_help() {
  std::vector<std::string> each;
  for (const Transport& row : transports()) each.push_back(fmt::format("{} ({})", row.example, row.help));
  return fmt::format("{}", fmt::join(each, ", "));
}

Status check_mission_name(const std::string& name) {
  if (is_mission_name(name)) return {};
  return fail(ErrorCode::configuration, "mission '{}': 1 to 32 letters, digits, '-' and '_' were expected", name);
}

Result<const Transport*> transport_of(const BusOptions& options) {
  if (const Status named = check_mission_name(options.mission); !named) return tl::unexpected(named.error());
  const auto url = parse_bus_url(options.url);
  if (!url) return tl::unexpected(url.error());
  const auto found = std::ranges::find(transports(), url->scheme, &Transport::scheme);
  if (found == transports().end())
    return fail(ErrorCode::configuration, "bus {}: no transport is called '{}', expected {}", url->plain, url->scheme,
                transports_help());
  if (const auto& known = options.credentials.known; known && known->mission != options.mission)
    return fail(ErrorCode::configuration, "the credential of {} is for mission '{}', expected one for '{}'",
                to_string(*known), known->mission, options.mission);
  if (found->check != nullptr)
    if (const Status checked = found->check(options, *url); !checked) return tl::unexpected(checked.error());
  return &*found;
}

Result<std::unique_ptr<Port>> open_port(Endpoint endpoint, const BusOptions& options) {
  const auto transport = transport_of(options);
  if (!transport) return tl::unexpected(transport.error());
  if (const auto& known = options.credentials.known; known && !is_for(*known, endpoint))
    return fail(ErrorCode::configuration, "the credential of {} (number {}) does not let this program be {} {}",
                to_string(*known), known->number, name(endpoint.role), endpoint.number);
  return (*transport)->open_port(endpoint, options);
}

Result<std::unique_ptr<MapBoard>> open_maps(const BusOptions& options) {
  return transport_of(options).map([&](const Transport* transport) { return transport->open_maps(options); });
}

}  // namespace tutti::bus
