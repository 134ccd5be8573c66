// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
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
/// The block `authorization` of nats-server's configuration: these users with their rights.
std::string authorization(const std::vector<KeyedUser>& users);

}  // namespace tutti::bus
