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
/// after which up is z. Up is the mean z axis of its robots' bodies; where these turn about their y axis far more than
/// about z, they are cameras, and up is against that. Grids of the map are level, its clouds are in its world.
Pose3 level_frame(const server::MapEstimate& map, std::uint32_t component);
/// T_upright_world: the rotation by quarter turns that comes nearest to level_frame(), which small changes of the map
/// do not change; the identity, unless its robots' frames are a camera's or it stands on its side.
Pose3 upright_frame(const server::MapEstimate& map, std::uint32_t component);
/// A warning where one robot of the component is the other way up than another by the axes of their bodies:
/// level_frame() then is level for one of them alone. No value where all agree.
std::optional<std::string> disagreement_on_up(const Content& content, const server::MapEstimate& map,
                                              std::uint32_t component);
/// How files in either frame state it, in one line.
std::string in_words(const Pose3& T_level_world);

}  // namespace tutti::mapfile
