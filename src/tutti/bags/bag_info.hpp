// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/depth.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/bags/transform_tree.hpp"

namespace tutti::bags {

struct TopicInfo {
  std::string topic, type;
  Use use = Use::nothing;
  std::uint64_t count = 0;
  Timestamp first = kLastTimestamp, last = kFirstTimestamp;  ///< Log times: the earliest and the latest.
  std::string frames;  ///< Frames of the first message ("odom -> base_link"); empty for types without a use.
  std::optional<ImageLayout> image;  ///< The first message's, of images.
  std::optional<RosCameraInfo> calibration;
  bool has_fix = false;                  ///< A message has a position fix that a robot would use.
  std::string refused_fix;               ///< Why the first fix that it would not is refused.
  std::string problem;                   ///< Why the first message could not be decoded; empty if it could.
  [[nodiscard]] double rate_hz() const;  ///< Mean rate; 0 for fewer than two messages.
};

struct BagInfo {
  std::vector<TopicInfo> topics;  ///< Sorted by name, then by type.
  TransformTree tree;             ///< From all topics of transforms.
  std::set<std::string> robots;   ///< Namespaces that have odometry.
  std::uint64_t messages = 0;
  std::uint64_t errors = 0;        ///< Records and chunks that could not be read.
  std::vector<std::string> said;   ///< Messages of the first ten errors.
  std::vector<std::string> notes;  ///< BagReader::notes(), and a count of messages that disagrees with the bag's own.
};

/// Reads the whole bag once, one chunk at a time.
BagInfo inspect(BagReader& bag);

/// Inputs that Tutti would take from the bag, for people, a line per kind: "odometry     /odom (odom -> base_link)".
/// All topics of a kind are named; where a kind is missing the line states what that means. A topic of depth is named
/// with its camera, or with why it has none.
std::vector<std::string> uses(const BagInfo& info);

}  // namespace tutti::bags
