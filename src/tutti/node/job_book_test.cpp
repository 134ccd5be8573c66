// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/job_book.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::node {
namespace job_book_test {

constexpr Timestamp kStart{0};

SubmapPair pair_of(std::uint32_t first, std::uint32_t second) {
  return {{ChainId{RobotId{0}, 0}, first}, {ChainId{RobotId{1}, 0}, second}};
}

TEST(JobBook, ClosesOnlyWhatItHasOpened) {
  JobBook jobs("1/2/", 100.0);
  const std::string name = jobs.next_name();
  jobs.open({.pairs = {pair_of(0, 1)}, .refinement = nullptr, .since = kStart});
  EXPECT_NE(jobs.next_name(), name);
  for (const char* other : {"", "1/2/", "1/2/7", "1/2/0x", "2/2/0", "1/2/-1", "1/2/99999999999999999999"})
    EXPECT_FALSE(jobs.close(other, kStart)) << other;
  const auto closed = jobs.close(name, kStart);
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->pairs, std::vector{pair_of(0, 1)});
  EXPECT_FALSE(jobs.close(name, kStart));
}

TEST(JobBook, NeedsTheSubmapsOfOpenJobsAndNoOthers) {
  Rng rng(7);
  JobBook jobs("", 100.0);
  std::map<std::string, std::vector<SubmapPair>> open;
  for (int round = 0; round < 300; ++round) {
    if (rng.bernoulli(0.5)) {
      std::vector<SubmapPair> pairs;
      for (std::size_t k = 1 + rng.index(4); k > 0; --k)
        pairs.push_back(pair_of(static_cast<std::uint32_t>(rng.index(12)), static_cast<std::uint32_t>(rng.index(12))));
      open[jobs.next_name()] = pairs;
      jobs.open({.pairs = pairs, .refinement = nullptr, .since = kStart});
    } else if (!open.empty()) {
      const auto any = std::next(open.begin(), static_cast<std::ptrdiff_t>(rng.index(open.size())));
      EXPECT_TRUE(jobs.close(any->first, kStart));
      open.erase(any);
    }
    for (std::uint32_t i = 0; i < 12; ++i) {
      const auto is_in = [&](const SubmapId& id) {
        return std::ranges::any_of(open, [&](const auto& job) {
          return std::ranges::any_of(job.second, [&](const auto& p) { return p.first == id || p.second == id; });
        });
      };
      for (const SubmapId& id : {pair_of(i, 0).first, pair_of(0, i).second}) EXPECT_EQ(jobs.needs(id), is_in(id));
    }
  }
}

TEST(JobBook, NeedsWhatARefinementIsOf) {
  JobBook jobs("", 100.0);
  auto refinement = std::make_shared<RefinementJob>();
  refinement->parts.push_back({.submap = pair_of(3, 0).first});
  const std::string name = jobs.next_name();
  jobs.open({.pairs = {}, .refinement = refinement, .since = kStart});
  EXPECT_TRUE(jobs.needs(pair_of(3, 0).first));
  jobs.close(name, kStart);
  EXPECT_FALSE(jobs.needs(pair_of(3, 0).first));
}

TEST(JobBook, WhatWaitsBehindAnotherCountsFromItsTurn) {
  JobBook jobs("", 100.0);
  const std::string first = jobs.next_name();
  jobs.open({.pairs = {pair_of(0, 1)}, .refinement = nullptr, .since = kStart});
  jobs.open({.pairs = {pair_of(0, 2)}, .refinement = nullptr, .since = kStart});
  jobs.close(first, kStart + 90.0);
  EXPECT_EQ(jobs.next_due(), kStart + 190.0);
  EXPECT_TRUE(jobs.take_late(kStart + 189.0).empty());
  EXPECT_EQ(jobs.take_late(kStart + 190.0).size(), 1U);
  EXPECT_EQ(jobs.size(), 0U);
}

TEST(JobBook, WaitsTwiceAsLongEveryTimeAndForEverWithoutATimeout) {
  for (const unsigned asked : {0U, 1U, 3U}) {
    JobBook jobs("", 100.0);
    jobs.open({.pairs = {pair_of(0, 1)}, .refinement = nullptr, .since = kStart, .asked = asked});
    EXPECT_EQ(jobs.next_due(), kStart + 100.0 * static_cast<double>(1U << asked));
  }
  JobBook jobs("", 0.0);
  jobs.open({.pairs = {pair_of(0, 1)}, .refinement = nullptr, .since = kStart});
  EXPECT_FALSE(jobs.next_due());
  EXPECT_TRUE(jobs.take_late(kStart + 1e6).empty());
}

TEST(FailedPairs, AreAskedLaterEachTimeAndGivenUpInTheEnd) {
  FailedPairs failed(100.0, 3);
  Timestamp now = kStart;
  EXPECT_EQ(failed.note(pair_of(0, 1), now), FailedPairs::Next::ask_later);
  EXPECT_EQ(failed.note(pair_of(0, 1), now), FailedPairs::Next::nothing);  // the same answer once more
  EXPECT_EQ(failed.waiting(), 1U);
  EXPECT_EQ(failed.next_due(), now + 10.0);
  EXPECT_TRUE(failed.take_due(now + 9.0).empty());
  now = now + 10.0;
  EXPECT_EQ(failed.take_due(now), std::vector{pair_of(0, 1)});
  EXPECT_EQ(failed.waiting(), 0U);
  EXPECT_EQ(failed.note(pair_of(0, 1), now), FailedPairs::Next::ask_later);
  EXPECT_EQ(failed.next_due(), now + 20.0);
  failed.take_due(now + 20.0);
  EXPECT_EQ(failed.note(pair_of(0, 1), now), FailedPairs::Next::give_up);
  EXPECT_EQ(failed.note(pair_of(0, 1), now), FailedPairs::Next::ask_later);  // it is forgotten
  failed.forget(pair_of(0, 1));
  EXPECT_FALSE(failed.next_due());
}

TEST(FailedPairs, AreAskedAtOnceWithoutATimeout) {
  FailedPairs failed(0.0, 2);
  EXPECT_EQ(failed.note(pair_of(0, 1), kStart), FailedPairs::Next::ask_now);
  EXPECT_FALSE(failed.next_due());
  EXPECT_EQ(failed.note(pair_of(0, 1), kStart), FailedPairs::Next::give_up);
}

}  // namespace job_book_test
}  // namespace tutti::node
