// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

/// Where a submap lies, in the world of a component. It hangs on the keyframe in its middle.
struct Place {
  std::uint32_t component = 0;
  Pose3 T_world_submap;
};
/// Nothing: the map does not have it.
std::optional<Place> place(const Submap& submap, const server::MapEstimate& map);

/// The largest component, or, where nobody there has a cloud, the one with most points.
std::uint32_t component_to_show(const Content& content, const server::MapEstimate& map);

}  // namespace tutti::mapfile
