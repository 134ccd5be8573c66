// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/config.hpp"
#include "tutti/perception/visual/absolute_pose.hpp"

namespace tutti::visual {

/// Settings of visual closures, from two visual payloads to loop closures or a refusal.
struct VisualClosureConfig {
  double min_time_apart_s = 0.0;  ///< Least time between two submaps of any robots, for robots cut from one recording.
  int min_landmarks = 30;         ///< Least number of landmarks with descriptors in a submap.
  /// Largest RMS error of a submap's landmarks in its own images: more shows a wrong calibration.
  double max_residual_px = 3.0;
  double max_hamming = 0.2;        ///< Largest Hamming distance of a match, as a share of the bits.
  double max_hamming_ratio = 0.9;  ///< Ratio test with the nearest descriptor of another landmark.
  int min_matches = 8;             ///< Least number of matches to try a keyframe, and of inliers to believe it.
  AbsolutePoseConfig pose;         ///< RANSAC.
  /// Largest standard deviation of the closure's position, in its most uncertain direction.
  double max_position_sigma_m = 0.02;
  double min_spread = 0.1;  ///< Least area of the box around the inliers, as a share of the image.
  std::uint64_t ransac_seed = 0;
  template <class V>
  void describe(V& v) {
    v.field("min_time_apart_s", min_time_apart_s, at_least(0.0),
            "Submaps nearer in time are not compared, whosever they are: for robots cut from one recording.");
    v.field("max_residual_px", max_residual_px, greater_than(0.0),
            "RMS of a submap's landmarks in its own images above which its calibration is not believed.");
    v.field("max_hamming", max_hamming, between(0.0, 1.0), "Bits in which a match may differ, as a share of all.");
    v.field("max_position_sigma_m", max_position_sigma_m, greater_than(0.0),
            "Standard deviation of a closure's position in its most uncertain direction.");
    v.field("ransac_seed", ransac_seed, any(), "Another one draws other samples.");
  }
};

}  // namespace tutti::visual
