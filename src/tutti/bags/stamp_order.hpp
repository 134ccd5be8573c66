// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/timestamp.hpp"

namespace tutti::bags {

/// A message of a topic: what it was stamped with, when the bag's recorder had it, and its number in the topic.
struct Arrival {
  Timestamp stamp, logged;
  std::uint64_t message = 0;
};

/// A message that came behind one that is newer by more than this is not sorted in, but wrong.
inline constexpr double kSortWithin_s = 1.0;

/// In which order a topic's messages are used. Where the clock of their stamps starts again, they are several runs, of
/// which the one that lasts longest is used.
struct StampOrder {
  struct Run {
    std::size_t begin = 0, end = 0;  ///< Positions of its messages.
    Timestamp first, last;
    [[nodiscard]] double duration_s() const { return last - first; }
  };
  std::vector<std::size_t> used;  ///< Positions in the order of their stamps, which increase.
  std::size_t late = 0;           ///< Those among them that came behind a newer one.
  std::vector<std::pair<std::size_t, std::string>> refused;  ///< Positions within the run, and why.
  std::vector<Run> runs;
  std::size_t run = 0;  ///< The one that is used; its messages are `used` and `refused`.

  /// "its clock starts again 1 times: .."; empty when it does not.
  [[nodiscard]] std::string in_words() const;
};

/// Positions of `arrivals` by when they were logged. Chunks of an MCAP and rows of a db3 may be stored in any order.
/// Where the recorder's own clock started again (messages of long stretches would alternate), they stay as stored.
std::vector<std::size_t> log_order(std::span<const Arrival> arrivals);

/// `arrivals` are in the order in which they were logged. One stamp that is far ahead or behind starts no run: a clock
/// starts again when the messages that follow go on behind it, too; a day ahead, it was set.
StampOrder order_by_stamp(std::span<const Arrival> arrivals);

}  // namespace tutti::bags
