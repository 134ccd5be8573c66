// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/worst_update.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tutti::mission {
namespace worst_update_test {

UpdateRecord update(double time_s, double onboard_m, double server_m, std::optional<double> corrected_m) {
  return {.time_s = time_s,
          .onboard_rmse_m = onboard_m,
          .server_rmse_m = server_m,
          .answers = {{"uniform", 0, 9.0}, {"spectral", 0, corrected_m}}};
}

TEST(WorstUpdate, IsWhereTheEstimateIsWorstBesideOdometry) {
  const std::vector<UpdateRecord> updates{update(10, 0.1, 0.2, 0.1), update(20, 0.5, 4.0, 0.4),
                                          update(30, 5.0, 4.5, 4.8), update(40, 6.0, 0.1, {})};
  const auto server = worst_of_server(updates);
  ASSERT_TRUE(server.has_value());
  EXPECT_EQ(server->time_s, 20.0);
  EXPECT_EQ(server->rmse_m, 4.0);
  EXPECT_EQ(server->onboard_rmse_m, 0.5);
  EXPECT_EQ(worst_of_policy(updates, "spectral")->time_s, 10.0);
  EXPECT_EQ(worst_of_policy(updates, "uniform")->time_s, 10.0);
}

TEST(WorstUpdate, IsNoneWithoutAReference) {
  EXPECT_FALSE(worst_of_server({}).has_value());
  const std::vector<UpdateRecord> updates{{.time_s = 1.0}, update(2.0, 0.1, 0.1, {})};
  EXPECT_FALSE(worst_of_policy(updates, "spectral").has_value());
  EXPECT_FALSE(worst_of_policy(updates, "no such").has_value());
  EXPECT_EQ(worst_of_server(updates)->time_s, 2.0);
}

}  // namespace worst_update_test
}  // namespace tutti::mission
