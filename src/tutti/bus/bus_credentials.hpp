// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::bus {

/// A user's role, which gives it its rights (bus_rights.hpp). An operator sees what a viewer sees, and decides.
enum class BusRole : std::uint8_t { server, robot, worker, operates, views };

/// "server", "robot", "worker", "operator", "viewer"
const char* name(BusRole role);
std::optional<BusRole> role_of(std::string_view name);

/// Whom a credential of `tutti pki` is for.
struct BusUser {
  BusRole role = BusRole::views;
  std::string name;
  std::uint32_t number = 0;  ///< As the bus's subjects have it.
  std::string mission;
  friend bool operator==(const BusUser&, const BusUser&) = default;
};
/// "robot alpha"
std::string to_string(const BusUser& user);

/// The two halves of an Ed25519 key as NATS writes them (nkeys): "U..." and "SU...".
struct NatsKey {
  std::string open;
  std::string seed;
  friend bool operator==(const NatsKey&, const NatsKey&) = default;
};

/// A certificate and its key, PEM.
struct Certificate {
  std::string text;
  std::string key;
  friend bool operator==(const Certificate&, const Certificate&) = default;
};

/// The credentials that a bus asks for from those who connect. Never printed.
struct BusCredentials {
  std::string user;    ///< Empty: `secret` is a token.
  std::string secret;  ///< Empty: there are none.
  /// Instead of these, what `tutti pki` has made.
  std::optional<BusUser> known = {};
  NatsKey key = {};
  Certificate certificate = {};
  std::string authority = {};  ///< The certificate that those of the bus are to be signed by.
  std::string file = {};       ///< From which they were read; empty: from elsewhere.
  friend bool operator==(const BusCredentials&, const BusCredentials&) = default;
};
/// Those in a file, with its name; errors name it, and do not repeat what is in it.
Result<BusCredentials> read_credentials(const std::string& file);
/// The credentials in their file now, if that is still for the same user; otherwise the same again.
BusCredentials read_again(const BusCredentials& credentials);
/// "USER:PASSWORD" or "TOKEN" in the first line of a text, or the text of a file of `tutti pki`. Errors do not repeat
/// it.
Result<BusCredentials> parse_credentials(std::string_view text);
/// Writes the credentials of `tutti pki` as the text that parse_credentials() reads.
std::string credentials_text(const BusCredentials& credentials);

/// The name in the certificate of every bus that `tutti pki` sets up, whatever its address: its authority signs no
/// other bus.
inline constexpr const char* kBusName = "bus.tutti";

/// The operator that `tutti page` is on a bus with rights. It has asked those who decide there who they are, so what it
/// states of them counts (docs/security.md).
inline constexpr const char* kPageUser = "page";

/// "_INBOX.robot.3": where the user is answered, and nobody else listens. Without a user `otherwise` is in it.
std::string inbox_of(const BusCredentials& credentials, const std::string& otherwise);

}  // namespace tutti::bus
