// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "tutti/model/submap.hpp"
#include "tutti/perception/visual/closure_config.hpp"

namespace tutti::visual {

/// A submap as its images show it: two descriptors of each of its 512 landmarks that most keyframes saw (33 kB of ORB
/// at most). Empty when fewer than config.min_landmarks have one, or when there are no images: then it is unknown. The
/// payload's indices must be valid, as wire::decode_submap() checks.
std::string describe_place(const Submap& submap, const VisualClosureConfig& config);

/// True for what describe_place() returns, unless it is empty.
bool is_descriptor(std::string_view bytes);

/// Compares one place with many.
class PlaceMatcher {
 public:
  /// `descriptor`: is_descriptor(), as of every other one.
  PlaceMatcher(std::string_view descriptor, const VisualClosureConfig& config);
  ~PlaceMatcher();
  /// How many descriptors of both places are near one of the other's (max_hamming, at most 0.16). Some near ones are
  /// missed (DescriptorTables), the same ones whichever of both is asked. 0 for descriptors of another kind.
  [[nodiscard]] double likeness(std::string_view other) const;

 private:
  struct Place;
  std::unique_ptr<const Place> place_;
};

}  // namespace tutti::visual
