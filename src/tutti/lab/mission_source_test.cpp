// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_source.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tutti::lab {
namespace mission_source_test {

TEST(MissionSource, RobotsAreNumberedByTheirPlaceOrByTheirName) {
  const auto demo = load({.file = "demo"});
  ASSERT_TRUE(demo.has_value()) << demo.error().message;
  EXPECT_EQ(robot_names(*demo), (std::vector<std::string>{"alpha", "bravo"}));
  const auto copies = load({.file = "demo", .assignments = {"simulation.robots=[{name: r, copies: 2}, {}]"}});
  ASSERT_TRUE(copies.has_value()) << copies.error().message;
  EXPECT_EQ(robot_names(*copies), (std::vector<std::string>{"r1", "r2", "charlie"}));
  EXPECT_EQ(program::number_of("r2", robot_names(*copies), false)->value, 1U);
  EXPECT_FALSE(program::number_of("a", robot_names(*copies), false).has_value());
  EXPECT_EQ(program::number_of("a", robot_names(*copies), true)->value, 0xe40c292cU);  // FNV-1a's own
  EXPECT_GE(program::number_of("foobar", {}, true)->value, 0x80000000U);
}

TEST(MissionSource, WithoutAMissionClosuresAreFoundFromScans) {
  const auto defaults = load({.assignments = {"server.update_least_s=3"}});
  ASSERT_TRUE(defaults.has_value()) << defaults.error().message;
  EXPECT_EQ(defaults->server.update_least_s, 3.0);
  EXPECT_EQ(defaults->closures.verifier, "lidar");
  EXPECT_FALSE(load({.assignments = {"closures.verifier=reference"}}).has_value());
  EXPECT_FALSE(load({.assignments = {"closures.colour=red"}}).has_value());
  EXPECT_FALSE(load({.file = "nowhere.yaml"}).has_value());
}

// Only who has the mission can find closures that are drawn, or taken from a reference.
TEST(MissionSource, OnlyVerifiersThatNeedTheMissionAreMadeOfIt) {
  const auto plain = server_settings({.file = "demo"});
  ASSERT_TRUE(plain.has_value()) << plain.error().message;
  EXPECT_EQ(plain->verifiers.other, nullptr);
  EXPECT_TRUE(plain->accepts_others);
  EXPECT_EQ(plain->robots, (std::vector<std::string>{"alpha", "bravo"}));
  EXPECT_EQ(plain->verifiers.verifier()->id().name, "lidar");
  const auto spoiled = worker_settings({.file = "demo", .assignments = {"closures.wrong_share=0.1"}});
  ASSERT_TRUE(spoiled.has_value()) << spoiled.error().message;
  EXPECT_NE(spoiled->verifiers.other, nullptr);
  EXPECT_TRUE(worker_settings({}).has_value() && worker_settings({})->mission.empty());
}

}  // namespace mission_source_test
}  // namespace tutti::lab
