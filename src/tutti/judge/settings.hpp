// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/config.hpp"

namespace tutti::judge {

/// What odometry and closures must show against each other (who_is_wrong.hpp).
struct WhoIsWrongConfig {
  bool let_odometry_fail = true;
  double confidence = 0.999;  ///< Share of pairs of true closures that should agree.
  int least_support = 2;      ///< A closure with which fewer others agree, and odometry neither, is not considered.
  double least_votes = 2.0;   ///< Failed odometry must explain more votes than this, one more for every run that is let
                              ///< go, and more for what is far from the errors that odometry says it has.
  double search_s = 20.0;  ///< Odometry so long before and after a candidate may have failed, too, before the candidate
                           ///< must pay for itself.
  int candidate_groups = 3;     ///< Groups of neighbouring closures, the largest, that are tried as wrong all together;
                                ///< each must explain more than least_votes.
  int most_refused_groups = 5;  ///< Groups that can be wrong all together.
  int min_joining_closures = 2;  ///< Fewer closures do not join two robots, or two pieces of one robot's odometry.

  template <class V>
  void describe(V& v) {
    v.field("let_odometry_fail", let_odometry_fail, any(),
            "Odometry may have failed where closures say so (off: every closure against it is wrong).");
  }
};

}  // namespace tutti::judge
