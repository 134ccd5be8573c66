// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/landmark_merge.hpp"

namespace tutti::bundle::internal {

/// Submaps side by side in one problem, nothing merged yet but their shared keyframes: the landmarks of submap s are
/// [first_landmark[s], first_landmark[s + 1]).
struct Assembly {
  std::vector<const PosedSubmap*> submaps;  ///< By id.
  std::vector<std::size_t> first_landmark;  ///< One more than submaps.
  BundleProblem problem;
  std::vector<RelativePose> odometry;  ///< As given, in the order of problem.odometry.
  /// The same views, but of every submap by itself: its keyframes as its odometry had them, in the submap frame.
  BundleProblem apart;
};
Result<Assembly> assemble(std::span<const PosedSubmap> submaps, const MergeConfig& config);

}  // namespace tutti::bundle::internal
