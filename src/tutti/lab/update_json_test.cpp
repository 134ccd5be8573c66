// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/update_json.hpp"

#include <gtest/gtest.h>

namespace tutti::lab {
namespace update_json_test {

using program::Json;

TEST(UpdateJson, ComesBackExactlyThroughText) {
  mission::UpdateRecord update{.time_s = 12.3,
                               .revision = 1ULL << 60U,
                               .onboard_rmse_m = 0.1,
                               .server_rmse_m = std::nullopt,
                               .perfect_rmse_m = 0.2,
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
  EXPECT_EQ(back->perfect_rmse_m, update.perfect_rmse_m);
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

TEST(UpdateJson, AnotherTypeIsAnError) {
  Json event = to_json(mission::UpdateRecord{.time_s = 1.0, .revision = 2});
  ASSERT_TRUE(update_of(event).has_value());
  event["answers"] = "none";
  EXPECT_FALSE(update_of(event).has_value());
}

}  // namespace update_json_test
}  // namespace tutti::lab
