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
#include "tutti/model/visual.hpp"

/// What a robot has heard since its last checkpoint: an agent that hears it again knows the same, to the bit.
namespace tutti::node {

struct OdometrySample {
  Timestamp stamp;
  Pose3 T_odom_body;
  Matrix6d increment_covariance = Matrix6d::Zero();
};
struct HeardGraph {
  std::string frame;                  ///< Of the ProxyGraphMessage.
  std::optional<std::size_t> budget;  ///< RobotAgent::receive().
};
using JournalEntry = std::variant<OdometrySample, Scan, HeardGraph, TrackedImages>;

/// Exact, for this machine: its bytes are not for others.
std::string encode(const JournalEntry& entry);
/// Of any bytes. What is in it is checked by who hears it.
Result<JournalEntry> decode_entry(std::string_view bytes);

}  // namespace tutti::node
