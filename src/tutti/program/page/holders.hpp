// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/program/page/board.hpp"

namespace tutti::page {

/// Who is looking at what right now, so that two people do not decide the same without knowing of each other. It stops
/// nobody from anything, is stored nowhere, and ends by itself.
class Holders {
 public:
  static constexpr double kHold_s = 30.0;       ///< Pages send it again every 10 s.
  static constexpr std::size_t kMost = 100;     ///< People at a time.
  static constexpr std::size_t kLongest = 200;  ///< Bytes of a key.

  /// `what`: the key of what somebody inspects, "closure/NAME" or "robot/NUMBER", instead of what it was before; empty:
  /// nothing any more. Errors: it is none of these, or too many hold something.
  Status hold(const std::string& by, const std::string& what, double now_s);
  /// "held": who holds what, and for how long, as a list.
  Message message(double now_s, double time_s);

 private:
  struct Held {
    std::string what;
    double until_s = 0.0;
  };
  void expire(double now_s);
  std::map<std::string, Held> by_name_;
};

}  // namespace tutti::page
