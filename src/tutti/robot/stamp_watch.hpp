// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "tutti/model/input.hpp"

namespace tutti::robot {

/// Decides which stamps of a robot's odometry to believe. One wrong stamp must not shut out all that come after it, and
/// a clock that was set back or began anew must not either. The verdicts are a function of the stamps so far.
class StampWatch {
 public:
  /// A step of more than this needs a second stamp that confirms it.
  static constexpr double kFar_s = kInputKinds[index_of<OdometrySample>()].ahead_s;
  static constexpr double kAnew_s = 2.0;  ///< Stamps before the newest, in order for longer than this, are of a clock
  static constexpr std::size_t kLeastAnew = 3;  ///< that began anew; so many are needed at least.

  enum class Verdict {
    follows,      ///< After the newest, by at most kFar_s; or the very first.
    waits,        ///< Far ahead of the newest. It counts only if the next stamp confirms it.
    confirms,     ///< Follows the one that waits: both count.
    is_before,    ///< Not after the newest.
    begins_anew,  ///< Not after the newest, nor were those right before it: from this one on another time counts.
  };
  explicit StampWatch(std::optional<Timestamp> newest = {}) : newest_(newest) {}

  Verdict take(Timestamp stamp);
  /// The newest stamp that counts.
  [[nodiscard]] const std::optional<Timestamp>& newest() const { return newest_; }

 private:
  /// Stamps that came in a row, in order among themselves, and did not follow the newest.
  struct Row {
    bool is_ahead = false;
    Timestamp first, last;
    std::size_t count = 0;
  };
  std::optional<Timestamp> newest_;
  std::optional<Row> row_;
};

}  // namespace tutti::robot
