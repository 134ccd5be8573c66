// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/alerts.hpp"

#include <gtest/gtest.h>

namespace tutti::consistency {
namespace alerts_test {

SuspectedOrigin at(double from_s, double until_s, bool alert = true) {
  return {.from = Timestamp{} + from_s, .until = Timestamp{} + until_s, .alert = alert};
}

Suspicion update(std::uint64_t revision, std::vector<SuspectedOrigin> origins) {
  return {.time_s = 100.0 * static_cast<double>(revision), .revision = revision, .origins = std::move(origins)};
}

TEST(FollowAlerts, KnowsSinceWhenAndShowsTheLatest) {
  const std::vector<Suspicion> updates{update(1, {}), update(2, {at(150, 190)}), update(3, {at(160, 185)}),
                                       update(4, {at(20, 30), at(161, 184)})};
  const auto alerts = follow_alerts(updates);
  ASSERT_EQ(alerts.size(), 2U);
  EXPECT_EQ(alerts[0].known_since_revision, 4U);  // by start, not by when it was known
  EXPECT_EQ(alerts[1].known_since_s, 200.0);
  EXPECT_EQ(alerts[1].known_since_revision, 2U);
  EXPECT_EQ(alerts[1].origin.from, Timestamp{} + 161.0);
  EXPECT_FALSE(alerts[0].withdrawn_s || alerts[1].withdrawn_s);
}

TEST(FollowAlerts, DriftWithoutAlertIsNone) {
  EXPECT_TRUE(follow_alerts(std::vector{update(1, {at(1, 9, false)}), update(2, {at(2, 8, false)})}).empty());
  EXPECT_TRUE(follow_alerts({}).empty());
}

TEST(FollowAlerts, WithdrawnOnceAndRaisedAgain) {
  std::vector<Suspicion> updates{update(1, {at(10, 20)}), update(2, {at(10, 20, false)}), update(3, {})};
  auto alerts = follow_alerts(updates);
  ASSERT_EQ(alerts.size(), 1U);
  EXPECT_EQ(alerts[0].withdrawn_s, 200.0);  // drift that the odometry allows for is no alert any more
  updates.push_back(update(4, {at(15, 25)}));
  alerts = follow_alerts(updates);
  ASSERT_EQ(alerts.size(), 1U);
  EXPECT_FALSE(alerts[0].withdrawn_s);
  EXPECT_EQ(alerts[0].known_since_revision, 1U);
}

TEST(FollowAlerts, SplitsAndMerges) {
  std::vector<Suspicion> updates{update(1, {at(10, 50)}), update(2, {at(10, 20), at(40, 50)})};
  auto alerts = follow_alerts(updates);
  ASSERT_EQ(alerts.size(), 2U);
  EXPECT_EQ(alerts[0].known_since_revision, 1U);
  EXPECT_EQ(alerts[1].known_since_revision, 1U);
  updates = {update(1, {at(40, 50)}), update(2, {at(10, 20), at(40, 50)}), update(3, {at(12, 44)})};
  alerts = follow_alerts(updates);
  ASSERT_EQ(alerts.size(), 1U);
  EXPECT_EQ(alerts[0].known_since_revision, 1U);
}

}  // namespace alerts_test
}  // namespace tutti::consistency
