// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/world.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace tutti::simulation {
namespace world_test {

std::optional<std::size_t> corridor_between(const CorridorWorld& world, std::size_t a, std::size_t b) {
  for (std::size_t i = 0; i < world.corridors.size(); ++i)
    if (world.corridors[i].a == a && world.corridors[i].b == b) return i;
  return std::nullopt;
}

RC_GTEST_PROP(World, FeaturelessAreTheLongestCorridors, (std::uint32_t seed)) {
  WorldConfig config;
  config.featureless_share = *rc::gen::element(0.0, 0.1, 0.3, 1.0);
  const CorridorWorld world = make_world(config, Rng(seed));
  double longest_rough = 0.0, shortest_featureless = 1e9;
  std::size_t featureless = 0;
  for (const Corridor& corridor : world.corridors) {
    if (corridor.kind == CorridorKind::featureless) {
      ++featureless;
      shortest_featureless = std::min(shortest_featureless, corridor.length_m);
    } else {
      RC_ASSERT(corridor.kind == CorridorKind::rough);
      longest_rough = std::max(longest_rough, corridor.length_m);
    }
  }
  RC_ASSERT(longest_rough <= shortest_featureless);
  const double share = static_cast<double>(featureless) / static_cast<double>(world.corridors.size());
  RC_ASSERT(std::abs(share - config.featureless_share) <= 0.5 / static_cast<double>(world.corridors.size()) + 1e-12);
}

TEST(World, NamedCorridorsAreFeatureless) {
  WorldConfig config;
  config.network = {.rows = 2, .columns = 3, .missing_share = 0.0};
  config.featureless_share = 0.0;
  config.featureless = {1, 0, 2, 5};
  const CorridorWorld world = make_world(config, Rng(1));
  EXPECT_TRUE(check_world(world, config).has_value());
  for (const Corridor& corridor : world.corridors) {
    const bool named = (corridor.a == 0 && corridor.b == 1) || (corridor.a == 2 && corridor.b == 5);
    EXPECT_EQ(corridor.kind == CorridorKind::featureless, named) << corridor.a << " to " << corridor.b;
  }
  for (const std::vector<int>& bad : {std::vector<int>{0, 5}, {0, 99}, {0, 1, 2}}) {
    config.featureless = bad;
    EXPECT_FALSE(check_world(make_world(config, Rng(1)), config).has_value());
  }
}

TEST(World, TerraceIsNumberedAsDocumented) {
  WorldConfig config;
  config.kind = "terrace";
  const CorridorWorld world = make_world(config, Rng(1));
  ASSERT_EQ(world.junctions.size(), 25U);
  EXPECT_EQ(world.junctions[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(world.junctions[3], Eigen::Vector3d(30, 0, 0));
  EXPECT_EQ(world.junctions[5], Eigen::Vector3d(30, 18, 0));
  EXPECT_EQ(world.junctions[8], Eigen::Vector3d(0, 18, 0));
  for (const auto& [a, b] : {std::pair{1, 7}, {4, 10}, {0, 9}}) {
    const auto corridor = corridor_between(world, a, b);
    ASSERT_TRUE(corridor) << a << " to " << b;
    EXPECT_EQ(world.corridors[*corridor].kind, CorridorKind::office);
  }
  for (std::size_t i = 10; i < 25; ++i) EXPECT_EQ(world.junctions[i].z(), config.ramp_rise_m);
  std::size_t open = 0;
  for (const Corridor& corridor : world.corridors) {
    EXPECT_EQ(corridor.kind == CorridorKind::open, corridor.a >= 10) << corridor.a << " to " << corridor.b;
    open += corridor.kind == CorridorKind::open;
  }
  EXPECT_EQ(open, 15U);
}

RC_GTEST_PROP(World, TerraceOfAnySizeIsALoopOnEachSideOfTheRamp, (std::uint32_t seed)) {
  WorldConfig config;
  config.kind = "terrace";
  config.office_length_m = *rc::gen::inRange(5, 80);
  config.office_width_m = *rc::gen::inRange(5, 80);
  config.roof_length_m = *rc::gen::inRange(5, 80);
  config.roof_width_m = *rc::gen::inRange(5, 80);
  const CorridorWorld world = make_world(config, Rng(seed));
  double office = 0.0, roof = 0.0;
  std::size_t ramps = 0;
  for (std::size_t i = 0; i < world.junctions.size(); ++i) RC_ASSERT(world.corridors_at[i].size() >= 2U);
  for (const Corridor& corridor : world.corridors) {
    RC_ASSERT(corridor.a < corridor.b);
    const bool on_roof_a = world.junctions[corridor.a].x() > config.office_length_m + 1.0;
    const bool on_roof_b = world.junctions[corridor.b].x() > config.office_length_m + 1.0;
    ramps += on_roof_a != on_roof_b;
    (corridor.kind == CorridorKind::open ? roof : office) += corridor.length_m;
  }
  RC_ASSERT(ramps == 1U);
  RC_ASSERT(std::abs(roof - 2.0 * (config.roof_length_m + config.roof_width_m)) < 1e-9);
  RC_ASSERT(office >= 2.0 * (config.office_length_m + config.office_width_m));
}

RC_GTEST_PROP(World, CorridorAtFindsTheCorridorOfAPlace, (std::uint32_t seed)) {
  const CorridorWorld world = make_world({}, Rng(seed));
  Rng rng(seed);
  const std::size_t corridor = rng.index(world.corridors.size());
  const Eigen::Vector3d a = world.junctions[world.corridors[corridor].a];
  const Eigen::Vector3d b = world.junctions[world.corridors[corridor].b];
  const Eigen::Vector3d place = a + rng.uniform(0.3, 0.7) * (b - a);
  RC_ASSERT(corridor_at(world, place, 1e-6) == corridor);
  const Eigen::Vector3d beside = place + 0.5 * (b - a).cross(Eigen::Vector3d::UnitZ()).normalized();
  RC_ASSERT(corridor_at(world, beside, 0.51) == corridor);
  RC_ASSERT(!corridor_at(world, beside, 0.49));
}

TEST(World, RobotsStartInTheTwoTunnelsOfStoreysInTurn) {
  WorldConfig config;
  config.kind = "storeys";
  const CorridorWorld world = make_world(config, Rng(4));
  const std::vector<std::size_t> networks = networks_of(world);
  const std::size_t half = world.junctions.size() / 2;
  for (std::size_t k = 0; k < networks.size(); ++k) EXPECT_EQ(networks[k], k < half ? 0 : half);
  EXPECT_GT(world.junctions[half].z() - world.junctions[0].z(), 0.5 * kStorey_m);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    std::size_t above = 0;
    const auto starts = spread_starts(world, 5, Rng(seed));
    for (std::size_t k = 0; k < 5; ++k) {
      above += starts[k] >= half ? 1 : 0;
      EXPECT_NEAR(static_cast<double>(above), 0.5 * static_cast<double>(k + 1), 0.5);
    }
  }
}

}  // namespace world_test
}  // namespace tutti::simulation
