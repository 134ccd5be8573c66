// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/bags/bag_reader.hpp"

namespace tutti::bags {

/// What Tutti could use a topic for, by its type alone.
enum class Use { nothing, odometry, scans, images, calibration, imu, fixes, poses, transforms };

Use use_of(std::string_view type);

struct TopicInfo {
  std::string topic, type;
  Use use = Use::nothing;
  std::uint64_t count = 0;
  Timestamp first = kLastTimestamp, last = kFirstTimestamp;  ///< Log times: the earliest and the latest.
  std::string frames;   ///< Of the first message, where its type is known: "odom -> base_link", else empty.
  std::string problem;  ///< Why the first message could not be decoded, else empty.
  [[nodiscard]] double rate_hz() const;  ///< 0 of fewer than two messages, or of no time.
};

struct BagInfo {
  std::vector<TopicInfo> topics;  ///< By name.
  std::uint64_t messages = 0;
  std::uint64_t errors = 0;        ///< Records and chunks that could not be read;
  std::vector<std::string> said;   ///< what the first ten of them had,
  std::vector<std::string> notes;  ///< and what is odd besides.
};

/// Reads all of the bag once, one chunk at a time.
BagInfo inspect(BagReader& bag);

/// What Tutti would take from it, a line each: "odometry     /odom (27.1 Hz), odom -> base_link". Several of a kind are
/// all named, and of what is missing it says what that means.
std::vector<std::string> uses(const BagInfo& info);

}  // namespace tutti::bags
