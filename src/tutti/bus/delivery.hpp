// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/wire/message_kind.hpp"

namespace tutti::bus {

/// The guarantee that a port (port.hpp) gives for a message, by the message's kind.
enum class Delivery {
  durable,     ///< Comes until it is acknowledged, also to a receiver that has restarted; in any order, maybe twice.
  retained,    ///< Only the newest value counts: it comes last, and at once to a receiver that comes later.
  work_queue,  ///< As durable, to any one worker at a time.
  best_effort  ///< Comes at most once, to receivers that are connected.
};

constexpr Delivery delivery_of(wire::MessageKind kind) {
  switch (kind) {
    case wire::MessageKind::proxy_graph:  // server -> one robot
    case wire::MessageKind::proxy_graph_delta:
    case wire::MessageKind::receipt:         // server -> one robot
    case wire::MessageKind::mission_status:  // server -> all viewers
      return Delivery::retained;
    case wire::MessageKind::job:             // server -> any worker
    case wire::MessageKind::refinement_job:  // server -> any worker
      return Delivery::work_queue;
    case wire::MessageKind::status:          // robot, worker -> server
    case wire::MessageKind::submap_request:  // worker -> server
    case wire::MessageKind::submap_copy:     // server -> one worker
      return Delivery::best_effort;
    case wire::MessageKind::submap:      // robot -> server
    case wire::MessageKind::verdicts:    // worker -> server
    case wire::MessageKind::refinement:  // worker -> server
    case wire::MessageKind::decision:    // viewer -> server
    case wire::MessageKind::mark:        // as a decision
    case wire::MessageKind::verdict:     // these five are stored, not sent
    case wire::MessageKind::cloud:
    case wire::MessageKind::agent_state:
    case wire::MessageKind::tracked_images:
    case wire::MessageKind::estimate:
      return Delivery::durable;
  }
  return Delivery::durable;
}

}  // namespace tutti::bus
