// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"

namespace tutti::pki {

/// Somebody whom the bus of a mission knows, or knew.
struct Member {
  bus::BusUser user;
  std::string key;               ///< bus::NatsKey::open
  std::string certificate = {};  ///< key_hash_of() it.
  bool is_revoked = false;
  std::string until = {};  ///< valid_until() of the certificate.
  /// At this time (utc_text()) its certificate has expired. The server's own never does in this sense: cut off from
  /// its own bus it would end the mission, and nobody else comes in with an expired one either.
  [[nodiscard]] bool has_expired(const std::string& now) const {
    return user.role != bus::BusRole::server && until < now;
  }
};

/// How long certificates are valid.
inline constexpr int kAuthorityDays = 3650;
inline constexpr int kDays = 397;

/// A folder with who may use the bus of one mission: an authority and the bus's certificate, a credential for each
/// member, and the configuration of nats-server with everyone's rights (bus/bus_rights.hpp). All files are this user's
/// alone. Whatever changes it writes the configuration anew; a server that runs with the folder follows within two
/// seconds (program::BusGuard). Processes change it one after the other.
class Pki {
 public:
  /// Makes the folder, which must not be one already, and the server's own credential.
  /// The bus's certificate also has `names`, of machines or addresses, under which browsers open its page.
  static Result<Pki> make(const std::filesystem::path& folder, const std::string& mission, int days = kDays,
                          const std::vector<std::string>& names = {});
  static Result<Pki> open(const std::filesystem::path& folder);

  /// Makes a member, and returns the file with its credential. `number` is a robot's; others are counted. Fails when
  /// there is a member of that name or, among robots, number.
  Result<std::filesystem::path> add(bus::BusRole role, const std::string& name, std::optional<std::uint32_t> number,
                                    int days = kDays);
  /// Neither its key nor its certificate opens anything any more; the credential is removed.
  Status revoke(const std::string& name);
  /// A new certificate for a member, with the keys that it has, so that the one before stays good until it expires;
  /// with no name for the bus, whose certificate keeps its names and gets `more_names`. Whoever is connected stays so.
  Status renew(const std::string& name, int days = kDays, const std::vector<std::string>& more_names = {});

  /// The blocks `tls`, `authorization` and `accounts` of nats-server's configuration, with the certificates and the
  /// rights of all who are not revoked and, at this time (utc_text()), have a certificate that has not expired.
  [[nodiscard]] Result<std::string> bus_configuration(const std::string& now) const;
  [[nodiscard]] const std::string& mission() const { return mission_; }
  [[nodiscard]] const std::vector<Member>& members() const { return members_; }
  /// Until when the bus's certificate is valid.
  [[nodiscard]] Result<std::string> bus_until() const;
  /// Its names and addresses, bus::kBusName first.
  [[nodiscard]] Result<std::vector<std::string>> bus_names() const;
  [[nodiscard]] std::filesystem::path credential(const std::string& name) const;

 private:
  explicit Pki(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Holds the folder's lock, and has read what others have written.
  class Turn;
  Status read();
  [[nodiscard]] Status write() const;
  [[nodiscard]] Status make_bus_certificate(int days, const std::vector<std::string>& names) const;
  /// With another certificate, of this key (empty: a new one); what the member has of it follows.
  [[nodiscard]] Status write_credential(Member& member, const bus::NatsKey& key, const std::string& certificate_key,
                                        int days) const;
  [[nodiscard]] Member* find(const std::string& name);

  std::filesystem::path folder_;
  std::string mission_;
  std::vector<Member> members_;
};

/// In the folder: the authority's certificate, the file to be included in a nats-server's configuration, the bus's
/// certificate and its key, and the name of the server's own credential.
inline constexpr const char* kAuthority = "authority.pem";
inline constexpr const char* kBusConfiguration = "bus.conf";
inline constexpr const char* kBusCertificate = "bus.pem";
inline constexpr const char* kBusKey = "bus.key";
inline constexpr const char* kServer = "server";

}  // namespace tutti::pki
