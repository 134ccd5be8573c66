// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "tutti/bus/envelope.hpp"
#include "tutti/node/event.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// Everything that one input causes, in the order in which the host carries it out before it acknowledges the input. A
/// program that is killed anywhere in between loses nothing: the input comes again and does no harm twice, and what was
/// never sent follows from what is stored (resume() of each node). When the writes cannot be committed, the node knows
/// more than its store; it must be destroyed and made again from the store.
struct Step {
  std::vector<storage::Write> writes;   ///< 1. To be committed in one transaction.
  std::vector<bus::Envelope> messages;  ///< 2. To be sent.
  std::vector<Event> events;            ///< 3. To be reported.

  /// Appends what another input causes after this one.
  void add(Step other) {
    std::ranges::move(other.writes, std::back_inserter(writes));
    std::ranges::move(other.messages, std::back_inserter(messages));
    std::ranges::move(other.events, std::back_inserter(events));
  }
  template <class What>
  void emit(Timestamp time, What&& what) {
    events.push_back({time, std::forward<What>(what)});
  }
};

}  // namespace tutti::node
