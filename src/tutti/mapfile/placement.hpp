// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

/// Pose of a submap in the world of its component. It follows from the estimate of the keyframe in the submap's middle
/// and the odometry from the submap's first keyframe to it.
struct Place {
  std::uint32_t component = 0;
  Pose3 T_world_submap;
};
/// No value when the map leaves the submap out.
std::optional<Place> place(const Submap& submap, const server::MapEstimate& map);

/// The largest component, or, where nobody there has a cloud, the one with most points.
std::uint32_t component_to_show(const Content& content, const server::MapEstimate& map);

/// T_level_world of a component, whose world has the tilt of the odometry that began it: a rotation about its origin,
/// after which the mean z axis of its robots' bodies is up. Grids of the map are level, its clouds are in its world.
Pose3 level_frame(const server::MapEstimate& map, std::uint32_t component);
/// How files in either frame say it, in one line.
std::string in_words(const Pose3& T_level_world);

}  // namespace tutti::mapfile
