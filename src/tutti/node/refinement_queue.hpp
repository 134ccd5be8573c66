// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/refinement.hpp"

namespace tutti::node {

/// Refinements of the map that are to be asked for again: later, because a worker has failed, or when a worker comes
/// that can. The map wants one at a time, so there is at most one of each.
class RefinementQueue {
 public:
  /// As for pairs (FailedPairs); without a time for an answer a refinement is given up at once.
  RefinementQueue(double timeout_s, unsigned most_tries) : timeout_s_(timeout_s), most_tries_(most_tries) {}

  /// False: it is to be given up.
  bool note_failed(const RefinementJob& job, Timestamp now);
  /// One has been taken, or given up: the next has all its tries.
  void start_anew() { failures_ = 0; }
  /// What is to be asked for again now.
  std::optional<RefinementJob> take_due(Timestamp now);
  [[nodiscard]] std::optional<Timestamp> next_due() const { return again_ ? std::optional(again_->due) : std::nullopt; }

  /// No worker that is there has the refiner.
  void wait(RefinementJob job) { waiting_ = std::move(job); }
  [[nodiscard]] const std::optional<RefinementJob>& waiting() const { return waiting_; }
  std::optional<RefinementJob> take_waiting() { return std::exchange(waiting_, std::nullopt); }

 private:
  struct Again {
    RefinementJob job;
    Timestamp due;
  };
  double timeout_s_;
  unsigned most_tries_;
  unsigned failures_ = 0;  // since start_anew()
  std::optional<Again> again_;
  std::optional<RefinementJob> waiting_;
};

}  // namespace tutti::node
