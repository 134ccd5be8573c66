// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::ros {

/// Problems with the messages of others: the newest of each kind for /diagnostics, one every 5 s for the log, so that
/// strangers cannot fill it.
class Complaints {
 public:
  explicit Complaints(std::function<void(program::Level, const std::string&)> say) : say_(std::move(say)) {}
  /// Notes an error; `what` is where it was, such as a topic. Nothing when `status` is none.
  void add(const std::string& what, const Status& status);
  /// Those since the last call, at most five, the newest last.
  std::vector<std::string> take();

 private:
  std::function<void(program::Level, const std::string&)> say_;
  std::deque<std::string> newest_;
  double said_s_ = 0.0;  ///< By the steady clock.
};

}  // namespace tutti::ros
