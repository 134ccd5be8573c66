// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/field_json.hpp"

#include <gtest/gtest.h>

#include "support/wire/messages.hpp"
#include "tutti/consistency/explanation.hpp"

namespace tutti::program {
namespace field_json_test {

TEST(FieldJson, HasEveryFieldByItsName) {
  const MissionStatus::Robot robot{.robot = RobotId{2},
                                   .last_seen = Timestamp{} + 3.0,
                                   .submaps = 7,
                                   .status = {.name = "alpha", .health = {.battery_percent = 50.0}}};
  const FieldJson json = json_of_fields(robot, Timestamp{} + 5.0);
  EXPECT_EQ(json.at("number"), 2);
  EXPECT_EQ(json.at("last_seen_s_ago"), 2.0);
  EXPECT_TRUE(json.at("last_update_s_ago").is_null());
  EXPECT_EQ(json.at("submaps"), 7) << "in the map, and not those that the robot has begun";
  EXPECT_EQ(json.at("name"), "alpha");  // of the status inside
  EXPECT_EQ(json.at("battery_percent"), 50.0);
  EXPECT_TRUE(json.at("battery_v").is_null());
  EXPECT_EQ(json.at("T_odom_body").at("quaternion_xyzw"), FieldJson({0.0, 0.0, 0.0, 1.0}));
}

TEST(FieldJson, IsReadBack) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    const NodeStatus status = wire::test::any_status(rng);
    NodeStatus again;
    ASSERT_TRUE(read_json_fields(FieldJson::parse(json_of_fields(status).dump()), again));
    EXPECT_EQ(again, status);
  }
  const consistency::SuspectedOrigin origin{.from = {-5}, .place_m = {1.0, 2.0, 3.0}, .scale = 2, .alert = true};
  consistency::SuspectedOrigin again;
  ASSERT_TRUE(read_json_fields(json_of_fields(origin), again));
  EXPECT_EQ(again.from, origin.from);
  EXPECT_EQ(again.place_m, origin.place_m);
  EXPECT_TRUE(again.alert);
}

TEST(FieldJson, AnotherTypeIsAnError) {
  NodeStatus status;
  EXPECT_FALSE(read_json_fields(FieldJson{{"session", "three"}}, status));
  EXPECT_FALSE(read_json_fields(FieldJson{{"T_odom_body", {{"translation_m", 1}}}}, status));
  EXPECT_TRUE(read_json_fields(FieldJson{{"of_a_newer_program", 1}}, status));
}

}  // namespace field_json_test
}  // namespace tutti::program
