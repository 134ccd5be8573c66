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

/// All that one input makes, in the order in which the host does it; then it acknowledges the input. A program that is
/// killed anywhere in between has lost nothing: the input comes again, does no harm twice, and what was never sent
/// follows from what is stored (resume() of each node). When the writes cannot be committed the node must go, and be
/// made again from its store: it is ahead of it.
struct Step {
  std::vector<storage::Write> writes;   ///< 1. Committed, in one transaction.
  std::vector<bus::Envelope> messages;  ///< 2. Sent.
  std::vector<Event> events;            ///< 3. Told.

  /// What another input makes, after this.
  void add(Step other) {
    std::ranges::move(other.writes, std::back_inserter(writes));
    std::ranges::move(other.messages, std::back_inserter(messages));
    std::ranges::move(other.events, std::back_inserter(events));
  }
  template <class What>
  void tell(Timestamp time, What&& what) {
    events.push_back({time, std::forward<What>(what)});
  }
};

}  // namespace tutti::node
