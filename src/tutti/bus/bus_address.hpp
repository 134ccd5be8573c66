// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::bus {

/// What a bus asks of those who connect. Never printed.
struct BusCredentials {
  std::string user;    ///< Empty: `secret` is a token.
  std::string secret;  ///< Empty: there are none.
  friend bool operator==(const BusCredentials&, const BusCredentials&) = default;
};
/// "USER:PASSWORD" or "TOKEN", in the first line of a text. Errors do not repeat it.
Result<BusCredentials> parse_credentials(std::string_view text);

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
