// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <string>

namespace tutti {

/// A robot of a mission, by its number. Robots assign keyframe and submap ids themselves; the ids are valid everywhere
/// and never rewritten.
struct RobotId {
  std::uint32_t value = 0;
  friend auto operator<=>(const RobotId&, const RobotId&) = default;
};

/// One chain of odometry of a robot, in an odometry frame of its own. A robot that starts again without its saved state
/// begins a new session, with a larger number than its sessions before, such as the time of the start: keyframes and
/// submaps are counted from 0 again, and only loop closures tie the new chain to the map.
struct ChainId {
  RobotId robot;
  std::uint64_t session = 0;

  constexpr ChainId() = default;
  constexpr ChainId(RobotId of) : robot(of) {}  // NOLINT: a robot's name is that of its first chain
  constexpr ChainId(RobotId of, std::uint64_t number) : robot(of), session(number) {}
  friend auto operator<=>(const ChainId&, const ChainId&) = default;
  friend bool operator==(const ChainId&, const ChainId&) = default;
  friend bool operator==(const ChainId&, RobotId) = delete;  ///< Say which is meant: the robot or its first chain.
};

/// A keyframe: counts up from 0 per chain.
struct KeyframeId {
  ChainId chain;
  std::uint32_t index = 0;
  friend auto operator<=>(const KeyframeId&, const KeyframeId&) = default;
};

/// A submap: counts up from 0 per chain.
struct SubmapId {
  ChainId chain;
  std::uint32_t index = 0;
  using InColumns = void;
  template <class V>
  void describe(V& v) {  // base/fields.hpp
    v.field(1, "robot", chain.robot);
    v.field(2, "session", chain.session);
    v.field(3, "index", index);
  }
  friend auto operator<=>(const SubmapId&, const SubmapId&) = default;
};

/// An id as one number, for hashes and seeds. Ids of equal session numbers never share one.
inline std::uint64_t packed(const ChainId& chain, std::uint32_t index) {
  constexpr std::uint64_t kGoldenRatio = 0x9e3779b97f4a7c15U;
  return ((std::uint64_t{chain.robot.value} << 32U) | index) ^ (chain.session * kGoldenRatio);
}

/// "ROBOT:SESSION"; "ROBOT" alone for session 0.
std::string to_string(const ChainId& chain);
/// "CHAIN/INDEX", such as "3:5/17".
std::string to_string(const SubmapId& id);

}  // namespace tutti

template <>
struct std::hash<tutti::RobotId> {
  std::size_t operator()(const tutti::RobotId& id) const noexcept { return std::hash<std::uint32_t>{}(id.value); }
};
template <>
struct std::hash<tutti::KeyframeId> {
  std::size_t operator()(const tutti::KeyframeId& id) const noexcept {
    return std::hash<std::uint64_t>{}(tutti::packed(id.chain, id.index));
  }
};
template <>
struct std::hash<tutti::SubmapId> {
  std::size_t operator()(const tutti::SubmapId& id) const noexcept {
    return std::hash<std::uint64_t>{}(tutti::packed(id.chain, id.index));
  }
};
