// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/config.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/visual/closure_config.hpp"

namespace tutti::finders {

/// Which finder finds closures from what sensors saw, and its settings.
struct FinderConfig {
  std::string finder = "lidar";
  /// Submaps of one robot with a smaller difference of indices are not compared; neighbours overlap anyway.
  int min_submap_gap = 2;
  double feature_cache_mb = 1000.0;  ///< For lidar about 2,400 submaps of 5,000 points.
  lidar::LidarClosureConfig lidar;
  visual::VisualClosureConfig visual;
  [[nodiscard]] bool wants_images() const { return finder != "lidar"; }
  template <class V>
  void describe(V& v) {
    v.field("finder", finder, one_of({"lidar", "visual", "sensors"}),
            "lidar: from the submap clouds; visual: from images; sensors: from whatever two submaps both carry.");
    describe_sensors(v);
  }

 protected:
  /// Describes all settings but `finder`.
  template <class V>
  void describe_sensors(V& v) {
    v.field("min_submap_gap", min_submap_gap, at_least(1.0),
            "lidar, visual: submaps of one robot nearer than this are not compared.");
    v.field(
        "feature_cache_mb", feature_cache_mb, between(16.0, 1e6),
        "lidar: memory for what was computed of the newest submaps, about 0.4 MB each; where it is full, every pair "
        "with an older one takes tens of milliseconds instead of less than one.");
    v.field("lidar", lidar);
    v.field("visual", visual);
  }
};

}  // namespace tutti::finders
