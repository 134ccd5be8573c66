// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/update_pacer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::node {
namespace update_pacer_test {

constexpr UpdatePacer::Limits kLimits{.least_s = 0.5, .share = 0.25};
const Timestamp kBegin = Timestamp{} + 1000.0;

/// A server that gets news at these times, whose updates cost what `cost_s` says: when each began.
std::vector<Timestamp> updates(const std::vector<Timestamp>& news, const std::function<double()>& cost_s,
                               UpdatePacer pacer = UpdatePacer(kLimits, {})) {
  std::vector<Timestamp> out;
  Timestamp free_at;  // the last update is sent
  for (std::size_t i = 0; i < news.size();) {
    const Timestamp begins = pacer.earliest(std::max(news[i], free_at));
    while (i < news.size() && news[i] <= begins) ++i;  // it has all that has come by then
    const double cost = cost_s();
    pacer.end({begins, cost});
    free_at = begins + cost;
    out.push_back(begins);
  }
  return out;
}

TEST(UpdatePacer, NewsBeginsAnUpdateAtOnce) {
  UpdatePacer pacer(kLimits, {});
  EXPECT_EQ(pacer.earliest(kBegin), kBegin);  // the first
  pacer.end({kBegin, 0.01});
  EXPECT_EQ(pacer.earliest(kBegin + 7.0), kBegin + 7.0);
}

TEST(UpdatePacer, NoTwoBeginWithinTheLeast) {
  UpdatePacer pacer(kLimits, {});
  pacer.end({kBegin, 0.01});
  EXPECT_EQ(pacer.earliest(kBegin), kBegin + 0.5);
  EXPECT_EQ(pacer.earliest(kBegin + 0.1), kBegin + 0.5);
}

TEST(UpdatePacer, ALongUpdateKeepsTheNextBackByItsCost) {
  UpdatePacer pacer(kLimits, {});
  pacer.end({kBegin, 3.0});
  EXPECT_EQ(pacer.earliest(kBegin + 3.0), kBegin + 12.0);
  EXPECT_EQ(pacer.earliest(kBegin + 3.0, true), kBegin + 3.0);  // an operator does not wait for that
  EXPECT_EQ(pacer.earliest(kBegin + 0.2, true), kBegin + 0.5);
  EXPECT_EQ(pacer.earliest(kBegin + 20.0), kBegin + 20.0);  // what was not used is not kept
}

TEST(UpdatePacer, AClockThatStepsBackHoldsUpOneUpdateForItsWait) {
  UpdatePacer pacer(kLimits, {});
  pacer.end({kBegin, 1.0});
  const Timestamp back = kBegin - 3600.0;
  EXPECT_EQ(pacer.earliest(back), back + 4.0);
  EXPECT_EQ(pacer.earliest(back + 1.0), back + 4.0);  // it is not put off again and again
  EXPECT_EQ(pacer.earliest(back + 5.0), back + 5.0);
}

TEST(UpdatePacer, ABurstOfSubmapsIsTwoUpdates) {
  std::vector<Timestamp> news;
  for (int i = 0; i < 200; ++i) news.push_back(kBegin + 0.002 * i);
  const auto begun = updates(news, [] { return 0.05; });
  ASSERT_EQ(begun.size(), 2U);
  EXPECT_EQ(begun[0], kBegin);
  EXPECT_EQ(begun[1], kBegin + 0.5);
}

/// Whatever comes and whatever it costs: the share holds over the whole, none begins within the least or before the
/// last is sent, and none waits for longer than the last one's cost allows.
TEST(UpdatePacer, OverADayTheShareHolds) {
  Rng rng(1);
  std::vector<Timestamp> news;
  for (Timestamp at = kBegin; at < kBegin + 86400.0; at = at + rng.uniform(0.0, 4.0)) news.push_back(at);
  std::vector<double> costs;
  const auto begun = updates(news, [&] {
    costs.push_back(rng.bernoulli(0.01) ? rng.uniform(0.0, 20.0) : rng.uniform(0.0, 1.0));
    return costs.back();
  });
  ASSERT_GT(begun.size(), 10'000U);
  double sum_s = 0.0;
  for (std::size_t i = 0; i + 1 < begun.size(); ++i) {
    sum_s += costs[i];
    const double wait_s = begun[i + 1] - begun[i];
    EXPECT_GE(wait_s, 0.5 - 1e-6);
    EXPECT_GE(wait_s, costs[i] / 0.25 - 1e-6);
    EXPECT_LE(wait_s, std::max(0.5, costs[i] / 0.25) + 4.0 + 1e-6);  // news comes every 4 s at least
    EXPECT_LE(sum_s, 0.25 * (begun[i + 1] - kBegin) + 1e-3);
  }
}

}  // namespace update_pacer_test
}  // namespace tutti::node
