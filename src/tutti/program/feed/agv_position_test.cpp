// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/agv_position.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tutti/geometry/so3.hpp"

namespace tutti::program {
namespace agv_position_test {

TEST(AgvPosition, IsInitialisedOnlyWhereTheRobotIsLocalised) {
  InMap in_map{.map = "site", .version = 7, .state = "localised"};
  in_map.T_world_body = {so3_exp({0, 0, 0.5}), {1, 2, 3}};
  in_map.sigma_m = 0.05;
  in_map.age_s = 0.1;
  in_map.overlap = 0.9;
  auto json = nlohmann::json::parse(agv_position(in_map));
  EXPECT_EQ(json.at("x"), 1.0);
  EXPECT_EQ(json.at("y"), 2.0);
  EXPECT_NEAR(json.at("theta").get<double>(), 0.5, 1e-12);
  EXPECT_EQ(json.at("mapId"), "site");
  EXPECT_EQ(json.at("positionInitialized"), true);
  EXPECT_EQ(json.at("localizationScore"), 0.9);
  EXPECT_EQ(json.at("deviationRange"), 0.05);
  in_map.floor = 2;
  EXPECT_EQ(nlohmann::json::parse(agv_position(in_map)).at("mapId"), "site_2");

  in_map.state = "off the map";  // odometry goes on from its last place
  json = nlohmann::json::parse(agv_position(in_map));
  EXPECT_EQ(json.at("x"), 1.0);
  EXPECT_EQ(json.at("positionInitialized"), false);
  EXPECT_EQ(json.at("localizationScore"), 0.0);
  EXPECT_FALSE(json.contains("deviationRange"));

  in_map = {.map = "site", .version = 7, .state = "lost"};
  json = nlohmann::json::parse(agv_position(in_map));
  EXPECT_EQ(json.at("x"), 0.0);
  EXPECT_EQ(json.at("positionInitialized"), false);
}

}  // namespace agv_position_test
}  // namespace tutti::program
