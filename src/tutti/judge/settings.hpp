// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tutti/base/config.hpp"

namespace tutti::judge {

/// Settings of judge_closures() and explain_closures().
struct OutlierRejectionConfig {
  bool let_odometry_fail = true;
  double confidence = 0.999;    ///< Share of pairs of right closures that agree.
  double right_refused = 1e-3;  ///< Share of maps that refuse any right closure, or any right group, by chance.
  /// A closure with which fewer others agree, nor the odometry between its ends, is not considered.
  int least_support = 2;
  double least_votes = 2.0;  ///< Failed odometry must explain more votes than this, one more for every segment that
                             ///< is disregarded, and more the farther it is from the errors that odometry states.
  double search_s = 20.0;    ///< A window reaches this long before and after a segment of odometry that seems to have
                             ///< failed.
  int candidate_groups = 3;  ///< Number of groups of neighbouring closures, the largest first, that are tried as wrong
                             ///< all together; each must explain more than least_votes.
  int most_refused_groups = 5;   ///< Limit on the groups that are refused so.
  int min_joining_closures = 3;  ///< Fewer closures do not join two segments of odometry.
  /// Windows of failed odometry that were not needed are looked for as long as fewer hypotheses than the first were
  /// tried, or than have so many nodes together. Where a large map has failures in many places, some of these windows
  /// stay: what lies in them is known less well.
  std::size_t least_hypotheses = 20;
  std::size_t tried_nodes = 400'000;

  template <class V>
  void describe(V& v) {
    v.field("let_odometry_fail", let_odometry_fail, any(),
            "Odometry may have failed where closures say so (off: every closure against it is wrong).");
  }
};

}  // namespace tutti::judge
