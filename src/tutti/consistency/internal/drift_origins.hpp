// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/consistency/time_chain.hpp"

namespace tutti::consistency::internal {

/// Odometry from node `first` to node `last` misses the server's map by more than their uncertainty explains.
struct DriftSegment {
  std::size_t first = 0;
  std::size_t last = 0;
  double significance = 0.0;  ///< Mahalanobis distance over its threshold, against what odometry usually does.
  bool alert = false;         ///< Also against odometry's own covariance there.
};

/// Scan statistic (Kulldorff 1997; Arias-Castro, Donoho, Huo 2005): over segments of all places and of lengths in
/// steps of half an octave, what odometry misses by against its covariance; the segment that stands out most, its ends
/// then moved node by node, then the rest that do not overlap with it, as long as they stand out: chi-square with 6
/// degrees of freedom beyond `probability` shared by all segments. When several stand out nearly alike, the
/// shortest is meant. Odometry's covariance is taken as it usually is (per metre, median over the run: a covariance
/// that odometry itself has inflated does not hide anything), plus the server's own uncertainty over the segment, whose
/// scales speak of these lengths (DisagreementTest::scale_length_m()).
std::vector<DriftSegment> drift_segments(const TimeChain& chain, std::span<const double> scale_lengths_m,
                                         const ChainUncertainty* uncertainty, double probability);

}  // namespace tutti::consistency::internal
