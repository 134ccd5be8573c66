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

/// At most config.candidates.max_guesses distinct alignments, best first. Levelled submaps differ by yaw and a shift:
/// main wall directions are laid on each other, the shift comes from correlating the oriented wall images by FFT, the
/// height from the horizontal surfaces.
std::vector<AlignmentGuess> propose_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                               const LidarClosureConfig& config);

/// Cheap test, invariant to the pose of either: false only when the two can never be accepted, because one is unusable
/// or shows hardly any walls. (Two submaps of one size cannot be told apart more cheaply than by propose_alignments.)
bool plausible_pair(const SubmapFeatures& a, const SubmapFeatures& b);

}  // namespace tutti::lidar
