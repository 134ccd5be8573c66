// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/answered_pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {
namespace answered_pairs_test {

template <class T>
void shuffle(std::vector<T>& list, Rng& rng) {
  for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[rng.index(i)]);
}

/// Submaps of three robots, as they came.
std::vector<SubmapId> arrivals(std::uint32_t each, Rng& rng) {
  std::vector<SubmapId> ids;
  for (std::uint32_t i = 0; i < each; ++i)
    for (std::uint32_t robot = 0; robot < 3; ++robot) ids.push_back({RobotId{robot}, i});
  shuffle(ids, rng);
  return ids;
}

std::vector<SubmapPair> pairs_of(const std::vector<SubmapId>& ids) {
  std::vector<SubmapPair> pairs;
  for (std::size_t b = 0; b < ids.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) pairs.push_back(ordered(ids[a], ids[b]));
  return pairs;
}

TEST(AnsweredPairs, KnowsExactlyWhatWasAnsweredWhateverTheOrder) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    const std::vector<SubmapId> ids = arrivals(7, rng);
    AnsweredPairs answered;
    for (const SubmapId id : ids) answered.add_submap(id);
    std::vector<SubmapPair> order = pairs_of(ids);
    shuffle(order, rng);
    std::set<SubmapPair> truth;
    for (const SubmapPair& next : order) {
      ASSERT_TRUE(answered.insert(next));
      if (rng.bernoulli(0.2)) {
        ASSERT_FALSE(answered.insert(next));
      }
      truth.insert(next);
      if (truth.size() % 20 > 0 && truth.size() + 5 < order.size()) continue;
      for (const SubmapPair& pair : order) ASSERT_EQ(answered.contains(pair), truth.contains(pair));
      std::vector<SubmapPair> open;
      std::ranges::copy_if(order, std::back_inserter(open), [&](const auto& pair) { return !truth.contains(pair); });
      std::ranges::sort(open);
      std::vector<SubmapPair> of_all;
      for (const SubmapId id : ids) std::ranges::copy(answered.open(id), std::back_inserter(of_all));
      std::ranges::sort(of_all);
      ASSERT_EQ(of_all, open);
      for (std::size_t b = 0; b < ids.size(); ++b) {
        std::size_t a = 0;
        while (a < b && truth.contains(ordered(ids[a], ids[b]))) ++a;
        ASSERT_EQ(answered.watermark(ids[b]), a);
      }
    }
    EXPECT_EQ(answered.intervals_beyond(), 0U);
    AnsweredPairs in_order;
    for (const SubmapId id : ids) in_order.add_submap(id);
    for (const SubmapPair& pair : pairs_of(ids)) in_order.insert(pair);
    EXPECT_EQ(answered, in_order);
    answered.forget_answers();
    for (const SubmapPair& pair : order) EXPECT_FALSE(answered.contains(pair));
  }
}

TEST(AnsweredPairs, ASubmapThatIsNeverAnsweredCostsOneIntervalOfEveryLaterOne) {
  Rng rng(1);
  const std::vector<SubmapId> ids = arrivals(50, rng);
  AnsweredPairs answered;
  for (const SubmapId id : ids) answered.add_submap(id);
  for (const SubmapPair& pair : pairs_of(ids))
    if (pair.first != ids[20] && pair.second != ids[20]) answered.insert(pair);
  EXPECT_EQ(answered.intervals_beyond(), ids.size() - 22);  // the next one has nothing beyond
  EXPECT_EQ(answered.watermark(ids.back()), 20U);
}

TEST(AnsweredPairs, TakesAllEarlierOnesButAFewAtOnce) {
  Rng rng(4);
  const std::vector<SubmapId> ids = arrivals(8, rng);
  for (int trial = 0; trial < 20; ++trial) {
    AnsweredPairs at_once, one_by_one;
    for (const SubmapId id : ids)
      for (AnsweredPairs* set : {&at_once, &one_by_one}) set->add_submap(id);
    for (std::size_t later = 0; later < ids.size(); ++later) {
      if (later > 0 && rng.bernoulli(0.5)) {  // some were answered before
        const SubmapPair pair = ordered(ids[later], ids[rng.index(later)]);
        at_once.insert(pair);
        one_by_one.insert(pair);
      }
      std::vector<SubmapId> open;
      for (std::size_t k = rng.index(6); k > 0; --k) open.push_back(ids[rng.index(ids.size())]);  // later ones, too
      at_once.insert_all_but(ids[later], open);
      for (std::size_t earlier = 0; earlier < later; ++earlier)
        if (std::ranges::find(open, ids[earlier]) == open.end()) one_by_one.insert(ordered(ids[later], ids[earlier]));
    }
    EXPECT_EQ(at_once, one_by_one);
  }
}

TEST(AnsweredPairs, KnowsNothingOfSubmapsThatHaveNotCome) {
  AnsweredPairs answered;
  answered.add_submap({RobotId{0}, 0});
  EXPECT_FALSE(answered.contains({{RobotId{0}, 0}, {RobotId{0}, 1}}));
  answered.add_submap({RobotId{0}, 1});
  answered.insert({{RobotId{0}, 0}, {RobotId{0}, 1}});
  answered.add_submap({RobotId{0}, 0});  // again
  EXPECT_TRUE(answered.contains({{RobotId{0}, 0}, {RobotId{0}, 1}}));
}

}  // namespace answered_pairs_test
}  // namespace tutti::server
