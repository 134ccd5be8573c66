// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/config.hpp"

namespace tutti::judge {

/// What odometry and closures must show against each other (who_is_wrong.hpp).
struct WhoIsWrongConfig {
  bool let_odometry_fail = true;
  double confidence = 0.999;
  int least_support = 2;
  double least_votes = 2.0;
  double search_s = 20.0;
  int candidate_groups = 3;
  int most_refused_groups = 5;
  int min_joining_closures = 2;

  template <class V>
  void describe(V& v) {
    v.field("let_odometry_fail", let_odometry_fail, any(),
            "Odometry may have failed where closures say so (off: every closure against it is wrong).");
    v.field("confidence", confidence, between(0.5, 0.999999999), "Share of pairs of true closures that should agree.");
    v.field("least_support", least_support, at_least(0),
            "A closure with which fewer others agree, and odometry neither, is not considered.");
    v.field("least_votes", least_votes, at_least(0.0),
            "Failed odometry must explain more votes than this, one more for every run that is let go, and more for "
            "what is far from the errors that odometry says it has.");
    v.field("search_s", search_s, at_least(0.0),
            "Odometry so long before and after a candidate may have failed, too, before the candidate must pay for "
            "itself.");
    v.field("candidate_groups", candidate_groups, at_least(0),
            "Groups of neighbouring closures, the largest, that are tried as wrong all together; each must "
            "explain more than least_votes.");
    v.field("most_refused_groups", most_refused_groups, at_least(0), "Groups that can be wrong all together.");
    v.field("min_joining_closures", min_joining_closures, at_least(1.0),
            "Fewer closures do not join two robots, or two pieces of one robot's odometry.");
  }
};

}  // namespace tutti::judge
