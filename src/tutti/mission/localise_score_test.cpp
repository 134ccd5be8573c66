// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/localise_score.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace localise_score_test {

constexpr double kSigma_m = 0.02;

Pose3 truth_at(double along_m) {
  return {so3_exp({0.0, 0.0, 0.02 * along_m}), {along_m, 10.0 * std::sin(0.05 * along_m), 0.0}};
}
/// The map is bent by up to 0.2 m.
Eigen::Vector3d bend_at(double along_m) { return {0.2 * std::sin(0.03 * along_m), 0.0, 0.0}; }
Timestamp at(double seconds) { return Timestamp{} + seconds; }

MapReference bent_map() {
  std::vector<evaluation::PosePair> pairs;
  for (int k = 0; k <= 400; ++k) {
    const double along_m = 0.5 * k;
    const Pose3 truth = truth_at(along_m);
    pairs.push_back({at(k), {truth.rotation, truth.translation + bend_at(along_m)}, truth});
  }
  auto map = lay_on_map(pairs);
  EXPECT_TRUE(map.has_value());
  return *map;
}

/// A robot that knows exactly how it stands to the map about it does not know how the map is bent: its covariance is
/// measured without that, and its error with it.
TEST(LocaliseScore, TheMapsOwnErrorIsNotTheRobots) {
  const MapReference map = bent_map();
  Rng rng(1);
  Trajectory reference;
  std::vector<localise::Located> course;
  for (int k = 0; k <= 1000; ++k) {
    const double along_m = 0.2 * k;
    const Pose3 truth = truth_at(along_m);
    reference.push_back({at(k), truth});
    const Eigen::Vector3d noise(rng.normal(), rng.normal(), rng.normal());
    localise::Located located{.state = localise::State::localised, .why = {}, .places = {}};
    located.stamp = at(k);
    located.T_world_body = RelativePose{{truth.rotation, truth.translation + bend_at(along_m) + kSigma_m * noise},
                                        Matrix6d::Identity() * kSigma_m * kSigma_m};
    course.push_back(std::move(located));
  }
  const LocaliseScore score = score_of(course, reference, {map}, {});
  EXPECT_EQ(score.scored, 1001U);
  EXPECT_EQ(score.wrong, 0U);
  EXPECT_NEAR(score.in_map_rmse_m, std::sqrt(3.0) * kSigma_m, 0.003);
  EXPECT_GT(score.map_rmse_m, 0.08);
  EXPECT_NEAR(score.rmse_m, std::hypot(score.map_rmse_m, score.in_map_rmse_m), 0.005);
  EXPECT_NEAR(score.within[0], 0.683, 0.03);
  EXPECT_NEAR(score.within[1], 0.954, 0.03);
}

/// A pose that is far off is wrong, whatever the map's error there.
TEST(LocaliseScore, WrongIsMeasuredAgainstTheReference) {
  const MapReference map = bent_map();
  Trajectory reference;
  std::vector<localise::Located> course(10);
  for (int k = 0; k < 10; ++k) {
    Pose3 pose = truth_at(k);
    reference.push_back({at(k), pose});
    if (k >= 7) pose.translation.y() += 2.0;
    localise::Located& located = course[static_cast<std::size_t>(k)];
    located.stamp = at(k);
    located.state = k == 0 ? localise::State::lost : localise::State::localised;
    located.T_world_body = RelativePose{pose, Matrix6d::Identity()};
  }
  const LocaliseScore score = score_of(course, reference, {map}, {});
  EXPECT_EQ(score.scored, 9U);
  EXPECT_EQ(score.wrong, 3U);
  EXPECT_EQ(score.right_last, at(6));
  EXPECT_FALSE(lay_on_map({}).has_value());
}

}  // namespace localise_score_test
}  // namespace tutti::mission
