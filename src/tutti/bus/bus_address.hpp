// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"

namespace tutti::bus {

struct HostPort {
  std::string host;  ///< Without brackets.
  int port = 0;      ///< 0: none is named.
  friend bool operator==(const HostPort&, const HostPort&) = default;
};
/// "HOST", "HOST:PORT", "::1", "[::1]", "[::1]:PORT".
Result<HostPort> parse_host_port(std::string_view text);
/// As parse_host_port() reads it; without a port only the host.
std::string to_string(const HostPort& at);

/// "nats://HOST:PORT", maybe with "USER:PASSWORD@" or "TOKEN@" before the host, maybe with another scheme; without a
/// scheme that of NATS.
struct BusUrl {
  std::string scheme;
  std::string plain;  ///< Without credentials: for libnats, and for people.
  HostPort at;
  BusCredentials credentials;
};
/// Errors do not repeat credentials.
Result<BusUrl> parse_bus_url(std::string_view url);
/// Any text that may be a URL, without what may be credentials in it.
std::string without_credentials(std::string_view url);

/// True when the host is an address that only this machine can reach (127.0.0.0/8, ::1), or a name all of whose
/// addresses are. Asks the system's resolver about names.
bool is_loopback(const std::string& host);

}  // namespace tutti::bus
