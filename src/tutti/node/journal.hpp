// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/position_fix.hpp"
#include "tutti/model/visual.hpp"

/// The entries of a robot's journal: what the robot has heard since its last checkpoint. An agent that hears them again
/// knows the same, bit for bit.
namespace tutti::node {

/// A sample of raw odometry.
struct OdometrySample {
  Timestamp stamp;
  Pose3 T_odom_body;
  Matrix6d increment_covariance = Matrix6d::Zero();  ///< The step since the previous sample, right tangent.
};
/// A proxy graph that the robot received.
struct HeardGraph {
  std::string frame;  ///< A ProxyGraphMessage, encoded.
};
using JournalEntry = std::variant<OdometrySample, Scan, HeardGraph, TrackedImages, PositionFix>;

/// Encodes an entry exactly. The bytes are for the same machine only.
std::string encode(const JournalEntry& entry);
/// Decodes any bytes. Whether values make sense is checked by the agent that hears the entry.
Result<JournalEntry> decode_entry(std::string_view bytes);

}  // namespace tutti::node
