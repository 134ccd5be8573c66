// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {

/// Which alerts somebody has acknowledged, for all who watch: messages "acknowledged/ID@SINCE". An alert that ends and
/// comes again is another one.
class Acknowledged {
 public:
  static constexpr std::size_t kMost = 2000;       ///< The oldest are forgotten.
  static constexpr std::size_t kMostAtOnce = 500;  ///< Alerts in one request.

  /// As a message of an earlier program has it.
  void resume(const Message& message);
  /// The alerts that there are now.
  void show(const std::vector<Alert>& alerts);
  /// Returns the messages for the board. `undo`: they are new again. Errors of code `invalid`: none of these ids is an
  /// alert now, or there are too many.
  Result<std::vector<Message>> acknowledge(const std::vector<std::string>& ids, bool undo, const std::string& by,
                                           double time_s);

 private:
  std::map<std::string, double> since_s_;  // of the alerts that there are, by id
  std::deque<std::string> order_;          // keys, the oldest first
  std::set<std::string> keys_;
};

}  // namespace tutti::page
