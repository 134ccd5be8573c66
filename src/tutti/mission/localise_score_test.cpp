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
  auto map = lay_on_map({pairs});
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

/// Where the reference says that the robot stands to the nearest of the map's poses it is right, however far the map
/// itself is off there and turned.
TEST(LocaliseScore, WrongIsMeasuredInTheMap) {
  std::vector<evaluation::PosePair> pairs;
  const auto mapped = [](const Pose3& truth) {  // the second half of the map is turned by 6 degrees about its middle
    const Pose3 turned = Pose3{so3_exp({0.0, 0.0, 6.0 * kRadPerDeg}), {0.0, 0.0, 0.0}} * truth;
    return truth.translation.x() > 0.0 ? turned : truth;
  };
  for (int k = -100; k <= 100; ++k) {
    const Pose3 truth{Eigen::Quaterniond::Identity(), {static_cast<double>(k), 0.0, 0.0}};
    pairs.push_back({at(k), mapped(truth), truth});
  }
  const MapReference map = *lay_on_map({pairs});
  Trajectory reference;
  std::vector<localise::Located> course(10);
  for (int k = 0; k < 10; ++k) {
    const Pose3 truth{so3_exp({0.0, 0.0, 0.5}), {90.2 + k, 1.0, 0.0}};
    reference.push_back({at(k), truth});
    localise::Located& located = course[static_cast<std::size_t>(k)];
    located.stamp = at(k);
    located.state = k == 0 ? localise::State::lost : localise::State::localised;
    located.T_world_body = RelativePose{mapped(truth), Matrix6d::Identity()};
    if (k == 7) located.T_world_body->T_a_b.translation.y() += 1.01;
    if (k == 8) located.T_world_body->T_a_b.rotation *= so3_exp({0.0, 0.0, 5.1 * kRadPerDeg});
    if (k == 9) located.T_world_body->T_a_b = map.T_world_reference * truth;  // where the map has nothing
  }
  const LocaliseScore score = score_of(course, reference, {map}, {});
  EXPECT_EQ(score.scored, 9U);
  EXPECT_EQ(score.wrong, 3U);
  EXPECT_EQ(score.right_last, at(6));
  EXPECT_GT(score.rmse_m, 1.0);
  EXPECT_GT(score.map_rmse_m, 1.0);
  course.resize(7);
  EXPECT_NEAR(score_of(course, reference, {map}, {}).max_m, 0.0, 1e-9);
  EXPECT_FALSE(lay_on_map({}).has_value());
}

/// Two drives that nothing joins end 20 m apart, and the map has the second 3 m to the side. Between them either is
/// right, and nothing else is; where only one is in sight, the other is wrong.
TEST(LocaliseScore, BetweenTwoDrivesThatTheMapHasApartEitherIsRight) {
  const Eigen::Vector3d aside(0.0, 3.0, 0.0);
  std::vector<std::vector<evaluation::PosePair>> drives(2);
  for (int k = 0; k < 50; ++k) {
    const Pose3 first{Eigen::Quaterniond::Identity(), {-60.0 + k, 0.0, 0.0}};
    const Pose3 second{Eigen::Quaterniond::Identity(), {10.0 + k, 0.0, 0.0}};
    drives[0].push_back({at(k), first, first});
    drives[1].push_back({at(100 + k), {second.rotation, second.translation + aside}, second});
  }
  const MapReference map = *lay_on_map(drives);
  const auto wrong_at = [&](double x, const Eigen::Vector3d& off) {
    const Pose3 truth{Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}};
    localise::Located located{.state = localise::State::localised, .why = {}, .places = {}};
    located.stamp = at(0);
    located.T_world_body = RelativePose{{truth.rotation, truth.translation + off}, Matrix6d::Identity()};
    return score_of({located}, {{at(0), truth}, {at(1), truth}}, {map}, {}).wrong == 1;
  };
  for (const double x : {-8.0, 0.0, 8.0}) {
    EXPECT_FALSE(wrong_at(x, {0.0, 0.0, 0.0})) << x;
    EXPECT_FALSE(wrong_at(x, aside)) << x;
    EXPECT_TRUE(wrong_at(x, 0.5 * aside)) << x;
    EXPECT_TRUE(wrong_at(x, -aside)) << x;
  }
  EXPECT_TRUE(wrong_at(-30.0, aside));
  EXPECT_TRUE(wrong_at(30.0, {0.0, 0.0, 0.0}));
}

}  // namespace localise_score_test
}  // namespace tutti::mission
