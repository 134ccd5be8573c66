// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <functional>
#include <string>

/// How a command that takes long shows its progress, and how it is stopped.
namespace tutti::app {

/// One line on stderr that is rewritten on a terminal, and elsewhere a line every ten per cent or half a minute.
class ProgressLine {
 public:
  /// `share`: how much is done, of 1. How long it takes yet is added to the text.
  void show(double share, const std::string& text);
  void close();

 private:
  using Clock = std::chrono::steady_clock;
  /// ", about 3 min yet"; empty until it can be estimated.
  [[nodiscard]] std::string rest(double share) const;

  bool is_open_ = false;
  double next_ = 0.1;
  Clock::time_point begun_ = Clock::now(), printed_ = begun_;
};

/// From now on the first Ctrl-C or SIGTERM says on stderr what follows ("the report is made") and makes the returned
/// function true; the second one ends the program at once.
std::function<bool()> announced_stop(const std::string& what_follows);
/// The same, once that is announced, for what nobody knows the end of: after two seconds the progress line has how
/// often it was asked ("step").
std::function<bool()> counted_stop(std::string what_is_asked);

}  // namespace tutti::app
