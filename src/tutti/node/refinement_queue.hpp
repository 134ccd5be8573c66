// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/refinement.hpp"

namespace tutti::node {

/// The refinement that is to be asked for again later because a worker has failed, and the one that waits for a worker
/// that can make it. The map wants one at a time, so there is at most one of each.
class RefinementQueue {
 public:
  /// Timing and tries are as in FailedPairs, except that with `timeout_s` = 0 a refinement is given up at once.
  RefinementQueue(double timeout_s, unsigned most_tries) : timeout_s_(timeout_s), most_tries_(most_tries) {}

  /// Notes a failure; false when the refinement is to be given up.
  bool note_failed(const RefinementJob& job, Timestamp now);
  /// The next refinement has all its tries, because this one was taken or given up.
  void start_anew() { failures_ = 0; }
  /// Takes the refinement that is to be asked for again now; nothing when none is due.
  std::optional<RefinementJob> take_due(Timestamp now);
  [[nodiscard]] std::optional<Timestamp> next_due() const { return again_ ? std::optional(again_->due) : std::nullopt; }

  /// No present worker has the refiner of this job.
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
