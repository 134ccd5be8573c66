// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "tutti/base/ids.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::bus {

using wire::MessageKind;

/// Who sends or receives: the server; a robot; a worker, which verifies loop closures and refines maps for the server;
/// or a viewer, which shows the mission and passes on an operator's decisions.
struct Endpoint {
  enum class Role : std::uint8_t { server, robot, worker, viewer };
  Role role = Role::server;
  std::uint32_t number = 0;  ///< Number of the robot, the worker or the viewer.

  static Endpoint server() { return {}; }
  static Endpoint of(RobotId id) { return {Role::robot, id.value}; }
  static Endpoint worker(std::uint32_t number) { return {Role::worker, number}; }
  /// Any worker that is free: as the receiver of a job, and as the sender of a job that comes back because it ended
  /// every worker that had it.
  static Endpoint any_worker() { return worker(std::numeric_limits<std::uint32_t>::max()); }

  static Endpoint viewer(std::uint32_t number) { return {Role::viewer, number}; }
  /// All viewers, as a receiver.
  static Endpoint all_viewers() { return viewer(std::numeric_limits<std::uint32_t>::max()); }

  [[nodiscard]] std::optional<RobotId> robot() const {
    return role == Role::robot ? std::optional(RobotId{number}) : std::nullopt;
  }
  friend auto operator<=>(const Endpoint&, const Endpoint&) = default;
};

/// A message in transit. Robots never write to robots.
struct Envelope {
  Endpoint from;
  Endpoint to;
  MessageKind kind = MessageKind::submap;
  /// Names the content: the same whenever it is sent again, as a port may store only one message of a kind and id. At
  /// most 200 letters, digits and any of "./:-_". Empty for retained messages.
  std::string id;
  std::shared_ptr<const std::string> bytes;  ///< Never null. Shared by all receivers of a broadcast.
  /// The operator who has sent it, as a bus with rights has proved; empty: nobody has proved anything.
  std::string user = {};
};

/// "server", "robot", "worker", "viewer"
constexpr const char* name(Endpoint::Role role) {
  constexpr const char* kNames[] = {"server", "robot", "worker", "viewer"};
  return kNames[static_cast<int>(role)];
}

}  // namespace tutti::bus
