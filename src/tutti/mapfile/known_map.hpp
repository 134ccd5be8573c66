// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "tutti/base/result.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/mapfile/floors.hpp"

namespace tutti::mapfile {

/// A map's file as a map to localise in, and what it was made from.
struct OpenedMap {
  std::shared_ptr<const localise::KnownMap> known;
  Content content;
  server::MapEstimate estimate;
  Floors floors;             ///< As `known` has them.
  std::size_t left_out = 0;  ///< Submaps that are on none.
};

/// Reads a copy of a map's file (open_copy()): its floors, with poses as a server has them. Clouds and
/// images stay in the file and are read when they are needed. Errors: as read(), and that the map has no submap with a
/// cloud or images.
Result<OpenedMap> open_known_map(const std::filesystem::path& file);

}  // namespace tutti::mapfile
