// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <thread>

#include "tutti/history/history.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/page/live_board.hpp"

namespace tutti::page {

/// One who watches the board and remembers what he is sent, on a thread of his own: a slow disk makes nobody wait.
class Recorder {
 public:
  using Say = std::function<void(program::Level, const std::string&)>;
  /// Puts what the history has on the board, and stores what is put after that until the board is closed. Message
  /// "history" says what is known of the past. All must outlive this.
  Recorder(LiveBoard& board, history::History& history, Say say);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

 private:
  void run();
  void store(const std::vector<history::Message>& messages);
  [[nodiscard]] Message known(double time_s) const;

  LiveBoard& board_;
  history::History& history_;
  Say say_;
  std::string trouble_;
  std::uint64_t sequence_ = 0;
  std::thread thread_;
};

}  // namespace tutti::page
