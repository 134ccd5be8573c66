// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/association.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace association_test {

constexpr std::int64_t kMs = 1'000'000;

/// A body that turns and runs at constant speed, seen at these times.
Trajectory at(const std::vector<std::int64_t>& ms) {
  Trajectory trajectory;
  for (const std::int64_t t : ms) {
    const double s = static_cast<double>(t) * 1e-3;
    trajectory.push_back({{t * kMs}, {so3_exp({0.0, 0.0, 0.1 * s}), {2.0 * s, 0.0, 0.0}}});
  }
  return trajectory;
}

std::vector<std::int64_t> stamps_ms(const std::vector<PosePair>& pairs) {
  std::vector<std::int64_t> out;
  for (const PosePair& pair : pairs) out.push_back(pair.stamp.ns / kMs);
  return out;
}

TEST(Associate, InterpolatesOnlyAcrossShortGaps) {
  const Trajectory reference = at({0, 100, 200, 900, 1000});
  const auto pairs = associate(at({-50, 0, 30, 130, 200, 500, 900, 950, 1001}), reference, {.max_gap_s = 0.1});
  EXPECT_EQ(stamps_ms(pairs), (std::vector<std::int64_t>{0, 30, 130, 200, 900, 950}));
  for (const PosePair& pair : pairs) EXPECT_LT(local(pair.estimate, pair.reference).norm(), 1e-12);
}

TEST(Associate, NearestWithinTheDifference) {
  const Trajectory reference = at({0, 100, 200});
  const auto pairs = associate(at({-21, -20, 50, 81, 119, 150, 180, 220, 221}), reference,
                               {.interpolate = false, .max_difference_s = 0.02});
  EXPECT_EQ(stamps_ms(pairs), (std::vector<std::int64_t>{-20, 81, 119, 180, 220}));
  EXPECT_EQ(pairs[1].reference, reference[1].pose);
  EXPECT_EQ(pairs[2].reference, reference[1].pose);  // one reference pose may serve several
  EXPECT_EQ(pairs[3].reference, reference[2].pose);
  const auto tied = associate(at({50}), reference, {.interpolate = false, .max_difference_s = 1.0});
  EXPECT_EQ(tied[0].reference, reference[0].pose);
}

TEST(Associate, NothingWithNothing) {
  for (const bool interpolate : {true, false}) {
    EXPECT_TRUE(associate({}, at({0}), {.interpolate = interpolate}).empty());
    EXPECT_TRUE(associate(at({0}), {}, {.interpolate = interpolate}).empty());
  }
}

/// Against the definition, by looking at every reference pose.
RC_GTEST_PROP(Associate, NearestIsTheNearest, ()) {
  const auto increasing = [] {
    std::vector<std::int64_t> ms;
    std::int64_t now = *rc::gen::inRange<std::int64_t>(-50, 50);
    for (int i = *rc::gen::inRange(0, 12); i > 0; --i) ms.push_back(now += *rc::gen::inRange<std::int64_t>(1, 30));
    return ms;
  };
  const Trajectory reference = at(increasing());
  const Trajectory estimate = at(increasing());
  const auto pairs = associate(estimate, reference, {.interpolate = false, .max_difference_s = 0.0105});
  std::size_t next = 0;
  for (const StampedPose& pose : estimate) {
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    for (const StampedPose& candidate : reference)
      least = std::min(least, std::abs(candidate.stamp.ns - pose.stamp.ns));
    if (least > 10 * kMs) continue;
    RC_ASSERT(next < pairs.size());
    RC_ASSERT(pairs[next].stamp == pose.stamp);
    RC_ASSERT(std::abs(pairs[next].reference.translation.x() - pose.pose.translation.x()) <=
              2e-9 * static_cast<double>(least) + 1e-12);  // at 2 m/s
    ++next;
  }
  RC_ASSERT(next == pairs.size());
}

}  // namespace association_test
}  // namespace tutti::evaluation
