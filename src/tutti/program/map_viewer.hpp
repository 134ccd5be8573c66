// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "tutti/mapfile/shown_map.hpp"

namespace tutti::program {

/// Shows the mission to others while the server makes its map. It has threads of its own; the server's thread calls
/// these functions, which must not block.
class MapViewer {
 public:
  virtual ~MapViewer() = default;
  /// True if it has time for this revision and does not show it yet.
  [[nodiscard]] virtual bool wants(std::uint64_t revision) const = 0;
  virtual void show(std::shared_ptr<const mapfile::ShownMap> map) = 0;

 protected:
  MapViewer() = default;
  MapViewer(const MapViewer&) = default;
  MapViewer(MapViewer&&) = default;
  MapViewer& operator=(const MapViewer&) = default;
  MapViewer& operator=(MapViewer&&) = default;
};

}  // namespace tutti::program
