// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/bus/bus_credentials.hpp"

namespace tutti::bus {

/// One subject that users of a role may publish or subscribe to, and what for. In it {mission}, {number} and {name} are
/// the user's.
struct BusRight {
  enum class To { publish, subscribe };
  BusRole role = BusRole::views;
  To to = To::publish;
  const char* subject = "";
  const char* purpose = "";
};
/// All rights on a bus of `tutti pki`; what is not among them is denied.
std::span<const BusRight> bus_rights();
/// Those of a user, of one kind.
std::vector<std::string> subjects_of(const BusUser& user, BusRight::To to);

/// A user of nats-server's configuration and the key that proves who it is.
struct KeyedUser {
  BusUser user;
  std::string key;  ///< NatsKey::open
};
/// The blocks `authorization` and `accounts` of nats-server's configuration: these users of one mission with their
/// rights. Streams are in an account that only the server's own user is in. Members have another one, from which what
/// they may publish passes, and nothing else: whoever publishes or asks chooses where the bus answers, the bus does not
/// check that subject against their rights, and an empty answer at `$JS.API.STREAM.DELETE.X` removes a stream.
std::string authorization(const std::string& mission, const std::vector<KeyedUser>& users);

/// How the list of the certificates that are let in begins, in the block `tls` before these.
inline constexpr std::string_view kPinned = "pinned_certs: [";

}  // namespace tutti::bus
