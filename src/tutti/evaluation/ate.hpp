// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

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
  /// Root mean square of the angle between the aligned estimate's attitude and the reference's.
  double rmse_deg = 0.0;
  Pose3 T_reference_estimate;  ///< The alignment.
};

/// ATE after aligning the positions with align_points(); no value without pairs. Up to two pairs, or positions on one
/// line, leave part of the rotation open: the smallest rotation is taken. The joint ATE of several robots whose
/// estimates share a frame is that of their concatenated pairs.
std::optional<AteResult> ate(std::span<const PosePair> pairs);
/// As ate(), under a given alignment.
std::optional<AteResult> ate_aligned(std::span<const PosePair> pairs, const Pose3& T_reference_estimate);

/// By what the estimate's positions are multiplied for the similarity Sim(3) that brings them closest to the reference
/// (Umeyama, PAMI 1991, eq. 42): what one camera alone cannot know. 1 where fewer than two places differ.
double best_scale(std::span<const PosePair> pairs);
/// The pairs with the estimate's positions multiplied by `scale`, about its frame's origin.
std::vector<PosePair> scaled(std::span<const PosePair> pairs, double scale);

}  // namespace tutti::evaluation
