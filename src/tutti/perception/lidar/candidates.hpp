// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {

/// A rough T_a_b between two submap frames.
struct AlignmentGuess {
  Pose3 T_a_b;
  double score = 0.0;  ///< Correlation of the two views from above, in [0, 1].
};

/// At most config.candidates.max_guesses distinct rough alignments, best first. Levelled submaps differ by yaw and a
/// shift: the yaw comes from laying main wall directions on each other, the shift from correlating the oriented wall
/// images by FFT, the height from the horizontal surfaces. None when either submap is unusable.
std::vector<AlignmentGuess> propose_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                               const LidarClosureConfig& config);

/// Cheap test before propose_alignments(), invariant to the poses of both submaps: false only when the pair can never
/// be accepted, because one submap is unusable or shows hardly any walls.
bool plausible_pair(const SubmapFeatures& a, const SubmapFeatures& b);

}  // namespace tutti::lidar
