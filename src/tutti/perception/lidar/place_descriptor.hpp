// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/model/submap.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/place_correlation.hpp"

namespace tutti::lidar {

/// A submap as seen from above, in 4 kB: the turned views (birds_eye_view.hpp), of which the 32 x 32 longest
/// wavelengths are left, in 8 bits each. Wherever a submap stands and is turned to, its descriptor hardly changes.
/// Empty when the submap is not usable or shows hardly any walls: then it is unknown.
std::string describe_place(const Submap& submap, const LidarClosureConfig& config);

/// True for what describe_place() returns with these settings, unless it is empty.
bool is_descriptor(std::string_view bytes, const LidarClosureConfig& config);

/// Compares one place with many.
class PlaceMatcher {
 public:
  /// `descriptor`: is_descriptor(), as of every other one.
  explicit PlaceMatcher(std::string_view descriptor);
  /// The highest correlation of the two views from above over all shifts and the yaws that lay wall directions on each
  /// other, at most 1. The best rough alignments (propose_alignments()) have the same, at half the resolution.
  [[nodiscard]] double likeness(std::string_view other) const;

 private:
  PlaceViews views_;
};

}  // namespace tutti::lidar
