// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tutti::bus {

/// A bus's refusal, as its nats-server logs it.
struct BusRefusal {
  std::string address;  ///< "10.0.0.7:40123"
  std::string key;      ///< NatsKey::open of the user; empty: nobody has proved to be one.
  std::string what;     ///< "publish mission.tutti.robot.3.submap", or plain words for why nobody was let in.
  friend bool operator==(const BusRefusal&, const BusRefusal&) = default;
};
/// Nothing: the line is of something else.
std::optional<BusRefusal> refusal_of(std::string_view line);
/// It has read its configuration again, or tried to.
bool has_read_configuration(std::string_view line);

}  // namespace tutti::bus
