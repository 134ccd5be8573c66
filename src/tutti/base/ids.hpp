// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace tutti {

/// Robots assign keyframe and submap ids themselves; the ids are valid everywhere and never rewritten.
struct RobotId {
  std::uint32_t value = 0;
  friend auto operator<=>(const RobotId&, const RobotId&) = default;
};

/// A keyframe: counts up from 0 per robot.
struct KeyframeId {
  RobotId robot;
  std::uint32_t index = 0;
  friend auto operator<=>(const KeyframeId&, const KeyframeId&) = default;
};

/// A submap: counts up from 0 per robot.
struct SubmapId {
  RobotId robot;
  std::uint32_t index = 0;
  friend auto operator<=>(const SubmapId&, const SubmapId&) = default;
};

}  // namespace tutti

template <>
struct std::hash<tutti::RobotId> {
  std::size_t operator()(const tutti::RobotId& id) const noexcept { return std::hash<std::uint32_t>{}(id.value); }
};
template <>
struct std::hash<tutti::KeyframeId> {
  std::size_t operator()(const tutti::KeyframeId& id) const noexcept {
    return std::hash<std::uint64_t>{}((std::uint64_t{id.robot.value} << 32U) | id.index);
  }
};
template <>
struct std::hash<tutti::SubmapId> {
  std::size_t operator()(const tutti::SubmapId& id) const noexcept {
    return std::hash<std::uint64_t>{}((std::uint64_t{id.robot.value} << 32U) | id.index);
  }
};
