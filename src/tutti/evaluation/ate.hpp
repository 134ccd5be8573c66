// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "tutti/evaluation/association.hpp"

namespace tutti::evaluation {

/// Absolute trajectory error (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, eqs. 4
/// and 5): what is left between reference and estimate after one rigid alignment (SE(3), no scale).
struct AteResult {
  std::size_t pairs = 0;
  double rmse_m = 0.0;
  double mean_m = 0.0;
  double median_m = 0.0;
  double max_m = 0.0;
  double rmse_deg = 0.0;       ///< Of the angle between the aligned estimate's attitude and the reference's.
  Pose3 T_reference_estimate;  ///< The alignment.
};

/// Aligns positions (Umeyama 1991) and measures; nothing without pairs. Up to two pairs, or positions on one line,
/// leave part of the rotation open: align_points() then takes the smallest. Several robots in one estimate frame:
/// concatenate their pairs, which gives them one joint alignment.
std::optional<AteResult> ate(std::span<const PosePair> pairs);
/// The same under a given alignment.
std::optional<AteResult> ate_aligned(std::span<const PosePair> pairs, const Pose3& T_reference_estimate);

}  // namespace tutti::evaluation
