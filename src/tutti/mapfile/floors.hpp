// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

/// The floors of a map: component_to_show(), and in their order the other components in which kLeastOfFloor submaps
/// have a cloud or images. Nothing ties their worlds to each other. They are numbered from 1.
class Floors {
 public:
  static constexpr std::size_t kLeastOfFloor = 3;
  static Floors of(const Content& content, const server::MapEstimate& map);
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(components_.size()); }
  /// The floor that is this component; nothing: it is none.
  [[nodiscard]] std::optional<std::uint32_t> of_component(std::uint32_t component) const;

 private:
  std::vector<std::uint32_t> components_;
};

/// A robot was last seen at one of them in a session, and at the other first in its next.
struct Lift {
  struct End {
    ChainId chain;
    std::uint32_t floor = 1;
    Pose3 T_world_body;  ///< In the floor's world.
  };
  End from, to;
};
/// Where robots have changed floors within kLongestLift_s, by their clocks.
std::vector<Lift> lifts_of(const Floors& floors, const server::MapEstimate& map);
inline constexpr double kLongestLift_s = 600.0;

}  // namespace tutti::mapfile
