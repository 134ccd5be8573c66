// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/scan_match.hpp"

#include <gtest/gtest.h>

namespace tutti::localise {
namespace scan_match_test {

const RelativePose kHere{.T_a_b = {}, .covariance = Matrix6d::Identity() * 1e-3};

ScanMatch good() {
  return {.T_world_body = kHere, .converged = true, .overlap = 0.8, .plane_rmse_m = 0.04, .in_view = 2000};
}

TEST(ScanMatch, AScanThatLiesOnTheMapConfirms) {
  EXPECT_EQ(assess(good(), kHere).evidence, Evidence::confirms);
  EXPECT_TRUE(assess(good(), kHere).why.empty());
}

TEST(ScanMatch, SeenThroughWallsIsAgainstWhateverElseFits) {
  ScanMatch match = good();
  match.contradiction = 0.5;
  EXPECT_EQ(assess(match, kHere).evidence, Evidence::against);
  match.in_view = 50;  // of a handful of points nothing follows
  EXPECT_NE(assess(match, kHere).evidence, Evidence::against);
}

TEST(ScanMatch, FarFromWhereTheRobotShouldBeIsAgainst) {
  ScanMatch match = good();
  match.T_world_body.T_a_b.translation.x() = 1.5;
  EXPECT_EQ(assess(match, kHere).evidence, Evidence::against);
  EXPECT_NE(assess(match, kHere).why.find("1.50 m"), std::string::npos);
}

TEST(ScanMatch, WhereTheMapShowsLittleNothingFollows) {
  ScanMatch match = good();
  match.overlap = 0.1;
  match.T_world_body.T_a_b.translation.x() = 1.5;
  EXPECT_EQ(assess(match, kHere).evidence, Evidence::nothing);
  match.converged = false;
  EXPECT_EQ(assess(match, kHere).evidence, Evidence::nothing);
}

TEST(ScanMatch, FarWorseThanTheScansBeforeConfirmsNothing) {
  const double quality = good().quality();
  EXPECT_EQ(assess(good(), kHere, quality / 0.75).evidence, Evidence::confirms);
  const Assessment refused = assess(good(), kHere, quality / 0.65);
  EXPECT_EQ(refused.evidence, Evidence::nothing);
  EXPECT_NE(refused.why.find("those before did to"), std::string::npos) << refused.why;
}

/// A place that was found needs more than a start pose: closer scans, and enough in view that could contradict.
TEST(ScanMatch, WhatWasFoundMustPassAStricterGate) {
  EXPECT_EQ(assess_guess(good(), kHere, GuessGate::of_found()).evidence, Evidence::confirms);
  const auto refused = [](auto spoil, const char* why) {
    ScanMatch match = good();
    spoil(match);
    EXPECT_EQ(assess(match, kHere).evidence, Evidence::confirms) << why;
    EXPECT_EQ(assess_guess(match, kHere, GuessGate::of_start()).evidence, Evidence::confirms) << why;
    const Assessment found = assess_guess(match, kHere, GuessGate::of_found());
    EXPECT_EQ(found.evidence, Evidence::nothing) << why;
    EXPECT_NE(found.why.find(why), std::string::npos) << found.why;
  };
  refused([](ScanMatch& match) { match.contradiction = 0.12; }, "12 % contradicts it");
  refused([](ScanMatch& match) { match.plane_rmse_m = 0.09; }, "fits to 51 %");
  refused([](ScanMatch& match) { match.in_view = 780; }, "780 points are in view");
}

}  // namespace scan_match_test
}  // namespace tutti::localise
