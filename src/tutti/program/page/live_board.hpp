// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "tutti/program/page/board.hpp"

namespace tutti::page {

/// A board for several threads: the server's and the viewer's put, everybody who watches waits.
class LiveBoard {
 public:
  template <class Put>
  void put(Put&& with_board) {
    {
      const std::scoped_lock lock(mutex_);
      std::forward<Put>(with_board)(board_);
    }
    changed_.notify_all();
  }
  /// The messages put after `sequence`, which then counts them; waits for one at most so long. Empty after close().
  std::vector<std::shared_ptr<const Posted>> wait_after(std::uint64_t& sequence, std::chrono::milliseconds at_most) {
    return posted_after(sequence, at_most, false);
  }
  /// The same, but for what was put before close(), which it still gives.
  std::vector<std::shared_ptr<const Posted>> recorded_after(std::uint64_t& sequence,
                                                            std::chrono::milliseconds at_most) {
    return posted_after(sequence, at_most, true);
  }
  /// wait_after() without waiting.
  std::vector<std::shared_ptr<const Posted>> after(std::uint64_t& sequence) {
    return wait_after(sequence, std::chrono::milliseconds(0));
  }
  void close() {
    {
      const std::scoped_lock lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }
  [[nodiscard]] bool is_closed() const {
    const std::scoped_lock lock(mutex_);
    return closed_;
  }

 private:
  std::vector<std::shared_ptr<const Posted>> posted_after(std::uint64_t& sequence, std::chrono::milliseconds at_most,
                                                          bool also_closed) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, at_most, [&] { return closed_ || board_.sequence() > sequence; });
    auto out = closed_ && !also_closed ? std::vector<std::shared_ptr<const Posted>>() : board_.after(sequence);
    sequence = board_.sequence();
    return out;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Board board_;
  bool closed_ = false;
};

}  // namespace tutti::page
