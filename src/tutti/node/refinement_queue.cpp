// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/refinement_queue.hpp"

#include "tutti/node/job_book.hpp"

namespace tutti::node {

bool RefinementQueue::note_failed(const RefinementJob& job, Timestamp now) {
  if (++failures_ >= most_tries_ || timeout_s_ <= 0.0) return false;
  again_ = Again{job, now + try_again_after_s(timeout_s_, failures_)};
  return true;
}

std::optional<RefinementJob> RefinementQueue::take_due(Timestamp now) {
  if (!again_ || again_->due > now) return std::nullopt;
  return std::exchange(again_, std::nullopt)->job;
}

}  // namespace tutti::node
