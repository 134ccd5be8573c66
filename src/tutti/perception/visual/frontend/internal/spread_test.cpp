// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/internal/spread.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <set>

#include "tutti/base/random.hpp"

namespace tutti::visual::internal {
namespace spread_test {

constexpr SpreadRule kRule{.width_px = 200, .height_px = 120, .cell_px = 40, .distance_px = 5, .most = 30};

std::vector<Candidate> scattered(std::size_t n, Rng& rng) {
  std::vector<Candidate> out;
  for (std::size_t i = 0; i < n; ++i)
    out.push_back({Eigen::Vector2d(rng.uniform(0.0, 199.0), rng.uniform(0.0, 119.0)).cast<float>(),
                   static_cast<float>(rng.uniform(0.0, 1.0))});
  return out;
}

RC_GTEST_PROP(Spread, KeepsItsDistancesAndItsNumber, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto candidates = scattered(*rc::gen::inRange<std::size_t>(0, 300), rng);
  std::vector<Eigen::Vector2f> places;
  for (const Candidate& it : scattered(10, rng)) places.push_back(it.pixel);
  const auto chosen = spread(candidates, places, kRule);
  RC_ASSERT(chosen.size() <= kRule.most);
  for (const std::size_t i : chosen) {  // The distance is that of the larger coordinate, of whole pixels.
    for (const auto& p : places)
      RC_ASSERT((candidates[i].pixel - p).cwiseAbs().maxCoeff() > static_cast<float>(kRule.distance_px - 1));
    places.push_back(candidates[i].pixel);
  }
  RC_ASSERT(chosen == spread(candidates, std::span(places).first(10), kRule));
}

TEST(Spread, EveryCellGetsItsBestBeforeAnyGetsASecond) {
  Rng rng(1);
  std::vector<Candidate> candidates = scattered(400, rng);
  for (Candidate& it : candidates)
    if (it.pixel.x() < 40.0F) it.strength += 10.0F;  // The left looks better everywhere.
  const auto chosen = spread(candidates, {}, kRule);
  ASSERT_EQ(chosen.size(), 30U);
  std::set<std::pair<int, int>> cells;
  for (std::size_t k = 0; k < 15; ++k) {
    const Eigen::Vector2i cell = (candidates[chosen[k]].pixel / 40.0F).cast<int>();
    cells.insert({cell.x(), cell.y()});
  }
  EXPECT_EQ(cells.size(), 15U);  // There are 5 x 3.
}

}  // namespace spread_test
}  // namespace tutti::visual::internal
