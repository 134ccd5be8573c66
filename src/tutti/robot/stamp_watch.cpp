// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/stamp_watch.hpp"

namespace tutti::robot {

StampWatch::Verdict StampWatch::take(Timestamp stamp) {
  const bool is_ahead = newest_ && stamp > *newest_;
  if (!newest_ || (is_ahead && stamp - *newest_ <= kFar_s)) {
    row_.reset();
    newest_ = stamp;
    return Verdict::follows;
  }
  const bool goes_on = row_ && row_->is_ahead == is_ahead && stamp > row_->last && stamp - row_->last <= kFar_s;
  if (!goes_on) row_ = Row{is_ahead, stamp, stamp, 0};
  row_->last = stamp;
  ++row_->count;
  const bool is_sure = is_ahead ? row_->count > 1 : row_->count >= kLeastAnew && stamp - row_->first > kAnew_s;
  if (!is_sure) return is_ahead ? Verdict::waits : Verdict::is_before;
  row_.reset();
  newest_ = stamp;
  return is_ahead ? Verdict::confirms : Verdict::begins_anew;
}

}  // namespace tutti::robot
