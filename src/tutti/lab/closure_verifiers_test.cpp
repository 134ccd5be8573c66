// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/closure_verifiers.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace tutti::lab {
namespace closure_verifiers_test {

MissionConfig config_of(const std::string& verifier, double wrong_share = 0.0) {
  MissionConfig config;
  config.closure_changes.verifier = verifier;
  if (verifier != "reference") config.closures.verifier = verifier;
  config.closure_changes.wrong_share = wrong_share;
  return config;
}

TEST(MakeClosureVerifier, NamesDifferWithEverythingThatIsDrawn) {
  std::set<MethodId> ids;
  const auto expect_new = [&](const MissionConfig& config, std::uint64_t seed) {
    EXPECT_TRUE(ids.insert(make_closure_verifier(config, {}, seed)->id()).second)
        << config.closure_changes.verifier << " " << seed;
  };
  for (const std::uint64_t seed : {1, 2})
    for (const double wrong_share : {0.1, 0.2}) expect_new(config_of("lidar", wrong_share), seed);
  for (const std::uint64_t seed : {1, 2}) expect_new(config_of("reference"), seed);
  MissionConfig farther = config_of("reference");
  farther.closure_changes.reference.radius_m += 1.0;
  expect_new(farther, 1);
  expect_new(config_of("lidar"), 1);
  EXPECT_EQ(ids.count(make_closure_verifier(config_of("lidar"), {}, 2)->id()), 1U);  // nothing is drawn
}

// Only who has the mission can answer as it does.
TEST(MakeClosureVerifier, WhatIsDrawnIsMadeOfNoSettings) {
  EXPECT_FALSE(make_closure_verifier(config_of("visual"), {}, 1)->settings().empty());
  EXPECT_TRUE(make_closure_verifier(config_of("visual", 0.1), {}, 1)->settings().empty());
  EXPECT_TRUE(make_closure_verifier(config_of("reference"), {}, 1)->settings().empty());
}

}  // namespace closure_verifiers_test
}  // namespace tutti::lab
