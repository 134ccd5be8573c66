// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/complaints.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/program/clock.hpp"

namespace tutti::ros {

void Complaints::add(const std::string& what, const Status& status) {
  constexpr std::size_t kMost = 5;
  constexpr double kQuiet_s = 5.0;
  if (status) return;
  std::string text = fmt::format("{}: {}", what, status.error().message);
  if (std::ranges::find(newest_, text) != newest_.end()) return;
  newest_.push_back(std::move(text));
  if (newest_.size() > kMost) newest_.pop_front();
  const double now_s = program::Clock::steady_s();
  if (now_s - said_s_ < kQuiet_s && newest_.size() > 1) return;
  said_s_ = now_s;
  say_(program::Level::warning, newest_.back());
}

std::vector<std::string> Complaints::take() {
  const std::deque<std::string> out = std::exchange(newest_, {});
  return {out.begin(), out.end()};
}

}  // namespace tutti::ros
