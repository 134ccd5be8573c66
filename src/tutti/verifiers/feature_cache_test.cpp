// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/feature_cache.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/verifiers/parallel.hpp"

namespace tutti::verifiers {
namespace feature_cache_test {

constexpr SubmapId id_of(std::uint32_t index) { return {RobotId{index % 3}, index / 3}; }

/// Features that name whose they are, of `cells` wall cells.
FeatureCache<lidar::SubmapFeatures>::Features features_of(SubmapId id, std::size_t cells = 100) {
  lidar::SubmapFeatures features{.id = id};
  features.view.walls.resize(cells);
  return std::make_shared<const lidar::SubmapFeatures>(std::move(features));
}

/// A cache whose work is counted.
struct Counted {
  explicit Counted(std::size_t budget_bytes) : cache(budget_bytes) {}
  /// Were they computed?
  bool get(std::uint32_t index, std::size_t cells = 100) {
    const std::size_t before = computed;
    const auto features = cache.get(id_of(index), [&]() -> Result<FeatureCache<lidar::SubmapFeatures>::Features> {
      ++computed;
      return features_of(id_of(index), cells);
    });
    EXPECT_TRUE(features && (*features)->id == id_of(index));
    return computed > before;
  }
  FeatureCache<lidar::SubmapFeatures> cache;
  std::atomic<std::size_t> computed{0};
};

const std::size_t kOne = lidar::bytes_of(*features_of({}));

TEST(FeatureCache, WhatThrowsOnceIsComputedTheNextTime) {
  FeatureCache<lidar::SubmapFeatures> cache(10 * kOne);
  const auto throws = []() -> Result<FeatureCache<lidar::SubmapFeatures>::Features> {
    throw std::out_of_range("a defect");
  };
  EXPECT_THROW(static_cast<void>(cache.get(id_of(1), throws)), std::out_of_range);
  const auto made = cache.get(
      id_of(1), []() -> Result<FeatureCache<lidar::SubmapFeatures>::Features> { return features_of(id_of(1)); });
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ((*made)->id, id_of(1));
}

// Those used last would all be gone when they are wanted again: 44,850 pairs, all of them but a few computed.
TEST(FeatureCache, EachNewOneAgainstAllBeforeItComputesNoMoreThanDoesNotFit) {
  constexpr std::uint32_t kSubmaps = 300, kRoom = 250;
  Counted counted(kRoom * kOne);
  for (std::uint32_t b = 0; b < kSubmaps; ++b)
    for (std::uint32_t a = 0; a < b; ++a) {
      counted.get(a);
      counted.get(b);
      ASSERT_LE(counted.cache.cached_bytes(), kRoom * kOne);
    }
  std::size_t unavoidable = kSubmaps;
  for (std::uint32_t b = kRoom; b < kSubmaps; ++b) unavoidable += b + 1 - kRoom;  // all before it do not fit
  EXPECT_LE(counted.computed, unavoidable);
  EXPECT_LT(counted.computed, 1600U);
  EXPECT_EQ(counted.cache.cached_bytes(), kRoom * kOne);
  for (std::uint32_t index = kSubmaps - kRoom; index < kSubmaps; ++index) EXPECT_FALSE(counted.get(index)) << index;
}

RC_GTEST_PROP(FeatureCache, TheNewestAreThereAndTheBudgetHolds, ()) {
  const std::size_t budget = kOne * *rc::gen::inRange<std::size_t>(0, 20);
  Counted counted(budget);
  std::vector<std::uint32_t> asked;  // by age
  const int calls = *rc::gen::inRange(0, 100);
  for (int call = 0; call < calls; ++call) {
    const auto index = *rc::gen::inRange<std::uint32_t>(0, 30);
    const std::size_t cells = 50 + 10 * index;  // always the same of one submap
    counted.get(index, cells);
    if (std::ranges::find(asked, index) == asked.end()) asked.push_back(index);
    RC_ASSERT(counted.cache.cached_bytes() <= budget);
    const std::uint32_t newest = asked.back(), newest_cells = 50 + 10 * newest;
    const bool fits = lidar::bytes_of(*features_of({}, newest_cells)) <= budget;
    RC_ASSERT(!fits || !counted.get(newest, newest_cells));
  }
}

TEST(FeatureCache, AnErrorIsNotKept) {
  FeatureCache<lidar::SubmapFeatures> cache(10 * kOne);
  const auto failing = [] {
    return Result<FeatureCache<lidar::SubmapFeatures>::Features>(fail(ErrorCode::io, "gone"));
  };
  EXPECT_FALSE(cache.get(id_of(1), failing));
  EXPECT_TRUE(
      cache.get(id_of(1), [] { return Result<FeatureCache<lidar::SubmapFeatures>::Features>(features_of(id_of(1))); }));
  EXPECT_TRUE(cache.get(id_of(1), failing));
}

TEST(FeatureCache, ThreadsThatAskAtTheSameTimeShareTheWork) {
  FeatureCache<lidar::SubmapFeatures> cache(10 * kOne);
  std::atomic<int> computed{0};
  for_each_parallel(4, 4, [&](std::size_t) {
    const auto features = cache.get(id_of(1), [&] {
      ++computed;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      return Result<FeatureCache<lidar::SubmapFeatures>::Features>(features_of(id_of(1)));
    });
    EXPECT_TRUE(features.has_value());
  });
  EXPECT_EQ(computed, 1);
}

TEST(FeatureCache, BytesAreThoseOfTheParts) {
  EXPECT_EQ(lidar::bytes_of(*features_of({}, 1100)) - lidar::bytes_of(*features_of({}, 100)),
            1000 * sizeof(lidar::WallCell));
}

}  // namespace feature_cache_test
}  // namespace tutti::verifiers
