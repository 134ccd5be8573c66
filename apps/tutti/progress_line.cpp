// SPDX-License-Identifier: BSD-3-Clause
#include "progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>
#include <utility>

#include "tutti/program/stop.hpp"

namespace tutti::app {

void ProgressLine::show(double share, const std::string& text) {
  constexpr std::chrono::seconds kSilence{30};
  const std::string line = text + rest(share);
  if (isatty(STDERR_FILENO) != 0) {
    std::cerr << "\r\033[K" << line << std::flush;
    is_open_ = true;
  } else if (share >= next_ || Clock::now() - printed_ > kSilence) {
    std::cerr << line << '\n';
    printed_ = Clock::now();
    while (next_ <= share) next_ += 0.1;
  }
}

void ProgressLine::close() {
  if (std::exchange(is_open_, false)) std::cerr << '\n';
}

std::string ProgressLine::rest(double share) const {
  constexpr double kLeastShare = 0.02, kMinute_s = 60.0;
  const double spent_s = std::chrono::duration<double>(Clock::now() - begun_).count();
  if (share < kLeastShare || share >= 1.0 || spent_s < 1.0) return "";
  const double rest_s = spent_s * (1.0 - share) / share;
  return rest_s < 2.0 * kMinute_s ? fmt::format(", about {:.0f} s yet", rest_s)
                                  : fmt::format(", about {:.0f} min yet", rest_s / kMinute_s);
}

std::function<bool()> announced_stop(const std::string& what_follows) {
  program::stop_on_signals(fmt::format("\ntutti: stopping: {}; once more ends at once\n", what_follows));
  return [] { return program::stop_asked().load(); };
}

std::function<bool()> counted_stop(std::string what_is_asked) {
  struct Count {
    ProgressLine line;
    std::size_t asked = 0;
    std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
    ~Count() { line.close(); }
  };
  return [what = std::move(what_is_asked), count = std::make_shared<Count>()] {
    constexpr double kSilence_s = 2.0;
    const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - count->begun).count();
    ++count->asked;
    if (spent_s > kSilence_s)
      count->line.show(0.0, fmt::format("{} {}, {:.0f} s; ends when nothing changes any more, or with Ctrl-C", what,
                                        count->asked, spent_s));
    return program::stop_asked().load();
  };
}

}  // namespace tutti::app
