// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/update_json.hpp"

#include <gtest/gtest.h>

#include "tutti/program/mission_source.hpp"

namespace tutti::program {
namespace update_json_test {

TEST(UpdateJson, ComesBackExactlyThroughText) {
  mission::UpdateRecord update{.time_s = 12.3,
                               .revision = 1ULL << 60U,
                               .onboard_rmse_m = 0.1,
                               .server_rmse_m = std::nullopt,
                               .answers = {{"adaptive", 3, 0.25}, {"uniform", 4, std::nullopt}}};
  update.origins.push_back({.from = {1'577'836'980'099'104'643},
                            .until = {1'577'836'981'199'104'651},
                            .place_m = {1.0, -2.0 / 3.0, 3.0},
                            .scale = 2,
                            .length_m = 7.0,
                            .translation_m = 0.3,
                            .rotation_rad = 0.01,
                            .significance = 1.5,
                            .alert = true});
  const auto back = update_of(Json::parse(to_json(update).dump()));
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ(back->time_s, update.time_s);
  EXPECT_EQ(back->revision, update.revision);
  EXPECT_EQ(back->onboard_rmse_m, update.onboard_rmse_m);
  EXPECT_EQ(back->server_rmse_m, update.server_rmse_m);
  ASSERT_EQ(back->answers.size(), 2U);
  EXPECT_EQ(back->answers[0].policy, "adaptive");
  EXPECT_EQ(back->answers[1].constraints, 4U);
  EXPECT_EQ(back->answers[1].rmse_m, std::nullopt);
  ASSERT_EQ(back->origins.size(), 1U);
  EXPECT_EQ(back->origins[0].from, update.origins[0].from);
  EXPECT_EQ(back->origins[0].until, update.origins[0].until);
  EXPECT_EQ(back->origins[0].place_m, update.origins[0].place_m);
  EXPECT_EQ(back->origins[0].scale, 2);
  EXPECT_EQ(back->origins[0].significance, 1.5);
  EXPECT_TRUE(back->origins[0].alert);
}

TEST(UpdateJson, WhatIsMissingIsAnError) {
  Json event = to_json(mission::UpdateRecord{.time_s = 1.0, .revision = 2});
  ASSERT_TRUE(update_of(event).has_value());
  event.erase("answers");
  EXPECT_FALSE(update_of(event).has_value());
}

TEST(MissionSource, RobotsAreNumberedByTheirPlaceOrByTheirName) {
  const auto demo = load({.file = "demo"});
  ASSERT_TRUE(demo.has_value()) << demo.error().message;
  EXPECT_EQ(robot_names(*demo), (std::vector<std::string>{"alpha", "bravo"}));
  const auto copies = load({.file = "demo", .assignments = {"simulation.robots=[{name: r, copies: 2}, {}]"}});
  ASSERT_TRUE(copies.has_value()) << copies.error().message;
  EXPECT_EQ(robot_names(*copies), (std::vector<std::string>{"r1", "r2", "charlie"}));
  EXPECT_EQ(robot_id_of("").value, 0x811c9dc5U);  // FNV-1a's own
  EXPECT_EQ(robot_id_of("a").value, 0xe40c292cU);
  EXPECT_GE(robot_id_of("foobar").value, 0x80000000U);
}

TEST(MissionSource, WithoutAMissionClosuresAreFoundFromScans) {
  const auto defaults = load({.assignments = {"server.update_period_s=3"}});
  ASSERT_TRUE(defaults.has_value()) << defaults.error().message;
  EXPECT_EQ(defaults->server.update_period_s, 3.0);
  EXPECT_EQ(defaults->closures.finder, "lidar");
  EXPECT_FALSE(load({.assignments = {"closures.finder=reference"}}).has_value());
  EXPECT_FALSE(load({.assignments = {"closures.colour=red"}}).has_value());
  EXPECT_FALSE(load({.file = "nowhere.yaml"}).has_value());
}

}  // namespace update_json_test
}  // namespace tutti::program
