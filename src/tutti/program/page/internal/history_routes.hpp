// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "tutti/program/page/internal/answers.hpp"
#include "tutti/program/page/internal/routes.hpp"
#include "tutti/program/page/internal/shared_answer.hpp"

namespace tutti::page {

/// The page's requests about the past (docs/page.md).
class HistoryRoutes {
 public:
  explicit HistoryRoutes(Site& site) : site_(site) {}
  /// All of it, or what was between `from` and `until`. One answer is made at a time; all of it is the same text for
  /// everybody who asks within ten seconds.
  void past(const Request& request, Response& response);
  void acknowledge(const Visitor& visitor, const Json& body, Response& response);

 private:
  [[nodiscard]] std::string text(double from_s, double until_s) const;
  Site& site_;
  std::mutex mutex_;  // of what follows
  std::optional<SharedAnswer> all_;
  double all_until_s_ = 0.0;  // of a steady clock
};

}  // namespace tutti::page
