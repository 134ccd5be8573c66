// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/estimation/bundle/landmark_merge.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::bundle {

struct GuidedMatchConfig {
  double radius_px = 40.0;    ///< Search radius around the pixel that the map's poses project a landmark to.
  double max_hamming = 0.16;  ///< Largest Hamming distance of a match, as a share of the bits.
  /// Ratio test: Hamming distance of a match over that of the nearest descriptor of another landmark.
  double max_hamming_ratio = 0.9;
};

/// Finds landmarks that two submaps have in common, where a loop closure ties the submaps together and the poses
/// therefore predict where to search. Every landmark of the first submap is projected into the images of the second and
/// matched with the descriptors around; each image votes for one landmark, and two landmarks match when each has most
/// of the other's votes. A pair gives no matches when `submaps` lacks one of the two or when their descriptors are of
/// different kinds.
std::vector<LandmarkMatch> guided_matches(std::span<const PosedSubmap> submaps, std::span<const SubmapPair> pairs,
                                          const GuidedMatchConfig& config);

}  // namespace tutti::bundle
