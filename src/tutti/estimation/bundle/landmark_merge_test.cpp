// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/landmark_merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "support/estimation/bundle/scene.hpp"

namespace tutti::bundle {
namespace landmark_merge_test {

using namespace test;

/// Without any noise but the landmarks' own 5 cm, with poses as they truly are.
SceneOptions quiet() {
  return {.pixel_sigma = 1e-3,
          .odometry_sigma_m = 1e-6,
          .odometry_sigma_rad = 1e-6,
          .start_sigma_m = 0.0,
          .start_sigma_rad = 0.0};
}
MergeConfig everything() { return {.landmarks_per_keyframe = 0}; }

double distance_to_nearest(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& points) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& q : points) best = std::min(best, (p - q).norm());
  return best;
}

VisualPayload& payload(PosedSubmap& posed) {  // tests change what nobody else owns
  auto visual = std::make_shared<VisualPayload>(*posed.submap->visual);
  auto submap = std::make_shared<Submap>(*posed.submap);
  submap->visual = visual;
  posed.submap = submap;
  return *visual;
}

TEST(LandmarkMerge, NeighboursAreOneBySharedKeypoints) {
  const Scene scene = make_scene(quiet(), 1);
  const auto merged = merge_landmarks(scene.input.submaps, {}, everything()).value();
  const auto& summary = merged.summary;
  EXPECT_GT(summary.neighbour_joins, 50U);
  EXPECT_EQ(summary.closure_joins, 0U);
  EXPECT_EQ(summary.two_things, 0U);
  EXPECT_EQ(summary.views_contradicting, 0U);
  EXPECT_EQ(summary.landmarks_out, summary.landmarks_in - summary.neighbour_joins - summary.landmarks_uncertain);
  EXPECT_EQ(merged.problem.keyframes.size(), scene.truth.size());
  for (const auto& p : merged.problem.landmarks) EXPECT_LT(distance_to_nearest(p, scene.points), 5e-3);
}

TEST(LandmarkMerge, MatchesJoinTheRest) {
  const Scene scene = make_scene(quiet(), 2);
  ASSERT_GT(scene.input.matches.size(), 20U);
  const auto alone = merge_landmarks(scene.input.submaps, {}, everything()).value();
  const auto joined = merge_landmarks(scene.input.submaps, scene.input.matches, everything()).value();
  EXPECT_GT(joined.summary.closure_joins, 20U);
  EXPECT_LT(joined.summary.landmarks_out, alone.summary.landmarks_out);
  EXPECT_EQ(joined.summary.two_things, 0U);
  // Matches with a submap that is not here are ignored.
  const std::span first(scene.input.submaps.data(), 1);
  EXPECT_EQ(merge_landmarks(first, scene.input.matches, everything()).value().summary.closure_joins, 0U);
}

TEST(LandmarkMerge, OneLandmarkAtTwoPositionsIsTriangulatedAgain) {
  Scene scene = make_scene(quiet(), 3);
  for (auto& landmark : payload(scene.input.submaps[1]).landmarks) landmark.position *= 1.2F;  // a wrong depth
  const auto merged = merge_landmarks(scene.input.submaps, {}, everything()).value();
  EXPECT_GT(merged.summary.two_positions, 20U);
  for (const auto& p : merged.problem.landmarks) EXPECT_LT(distance_to_nearest(p, scene.points), 5e-3);
}

TEST(LandmarkMerge, WrongMatchesAreTakenApart) {
  const Scene scene = make_scene(quiet(), 4);
  const auto point = [&](const LandmarkId& id) { return scene.points[scene.point_of.at(id)]; };
  auto matches = scene.input.matches;
  const auto far = std::find_if(matches.begin(), matches.end(), [&](const LandmarkMatch& match) {
    return (point(match.other) - point(matches.front().one)).norm() > 1.0;
  });
  ASSERT_NE(far, matches.end());
  matches = {{matches.front().one, far->other}, {far->one, matches.front().other}};
  const auto right = merge_landmarks(scene.input.submaps, {}, everything()).value();
  const auto wrong = merge_landmarks(scene.input.submaps, matches, everything()).value();
  EXPECT_EQ(wrong.summary.closure_joins, 2U);
  EXPECT_GE(wrong.summary.two_things, 2U);
  EXPECT_NEAR(static_cast<double>(wrong.summary.views_out), static_cast<double>(right.summary.views_out), 4.0);
  for (const auto& p : wrong.problem.landmarks) EXPECT_LT(distance_to_nearest(p, scene.points), 5e-3);
}

TEST(LandmarkMerge, OrderDoesNotMatter) {
  Scene scene = make_scene({}, 5);
  const auto one = merge_landmarks(scene.input.submaps, scene.input.matches, {}).value();
  std::reverse(scene.input.submaps.begin(), scene.input.submaps.end());
  std::reverse(scene.input.matches.begin(), scene.input.matches.end());
  for (auto& match : scene.input.matches) std::swap(match.one, match.other);
  const auto other = merge_landmarks(scene.input.submaps, scene.input.matches, {}).value();
  EXPECT_EQ(one.problem.landmarks, other.problem.landmarks);
  EXPECT_EQ(one.problem.observations.size(), other.problem.observations.size());
}

TEST(LandmarkMerge, ThinsToTheBestObserved) {
  const Scene scene = make_scene(quiet(), 6);
  const auto all = merge_landmarks(scene.input.submaps, scene.input.matches, everything()).value();
  const auto few = merge_landmarks(scene.input.submaps, scene.input.matches, {.landmarks_per_keyframe = 20}).value();
  EXPECT_EQ(few.summary.landmarks_out + few.summary.landmarks_thinned, all.summary.landmarks_out);
  EXPECT_LT(few.summary.landmarks_out, all.summary.landmarks_out / 2);
  const auto views_per_landmark = [](const MergeSummary& summary) {
    return static_cast<double>(summary.views_out) / static_cast<double>(summary.landmarks_out);
  };
  EXPECT_GT(views_per_landmark(few.summary), views_per_landmark(all.summary));
  std::vector<int> views(scene.truth.size(), 0);
  for (const auto& view : few.problem.observations) ++views[view.keyframe];
  for (const int count : views) EXPECT_GE(count, 20);

  const auto redundant =
      merge_landmarks(scene.input.submaps, scene.input.matches, {.landmarks_per_keyframe = 0, .redundant_views = 3})
          .value();
  EXPECT_GT(redundant.summary.redundant_keyframes, 0U);
  EXPECT_LT(redundant.summary.views_out, all.summary.views_out);
  EXPECT_EQ(redundant.problem.keyframes.size(), scene.truth.size());
}

TEST(LandmarkMerge, WrongCalibrationShowsBeforeAnything) {
  Scene scene = make_scene({.odometry_sigma_m = 1e-4, .odometry_sigma_rad = 1e-4}, 7);
  const double right = merge_landmarks(scene.input.submaps, {}, {}).value().residuals.front().median_px;
  for (auto& posed : scene.input.submaps) payload(posed).cameras[0].model.fx *= 1.1;
  const double wrong = merge_landmarks(scene.input.submaps, {}, {}).value().residuals.front().median_px;
  EXPECT_GT(wrong, 2.0 * right);
}

TEST(LandmarkMerge, RefusesByName) {
  const Scene scene = make_scene(quiet(), 8);
  const auto refusal = [&](auto change) {
    Scene bad = scene;
    change(bad);
    const auto merged = merge_landmarks(bad.input.submaps, bad.input.matches, {});
    return merged ? std::string() : merged.error().message;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(refusal([](Scene&) {}), "");
  EXPECT_NE(refusal([](Scene& s) { s.input.submaps[1].T_world_body.pop_back(); }).find("submap 0/1"),
            std::string::npos);
  EXPECT_NE(refusal([](Scene& s) { s.input.submaps[0].T_world_body[3].translation.x() = kNan; }).find("keyframe 0/3"),
            std::string::npos);
  EXPECT_NE(refusal([](Scene& s) { payload(s.input.submaps[0]).landmarks[5].position.x() = kNan; }).find("landmark 5"),
            std::string::npos);
  EXPECT_NE(
      refusal([](Scene& s) { payload(s.input.submaps[0]).frames[2].observations[0].pixel.x() = kNan; }).find("0/2"),
      std::string::npos);
  EXPECT_NE(
      refusal([](Scene& s) { payload(s.input.submaps[0]).frames[2].observations[0].landmark = 9999; }).find("9999"),
      std::string::npos);
  EXPECT_NE(refusal([](Scene& s) { payload(s.input.submaps[0]).cameras[0].model.fx = -1.0; }).find("camera 0"),
            std::string::npos);
  EXPECT_NE(refusal([](Scene& s) { s.input.matches[0].one.index = 9999; }).find("9999"), std::string::npos);
  EXPECT_NE(refusal([](Scene& s) { s.input.submaps.push_back(s.input.submaps[0]); }).find("twice"), std::string::npos);
}

}  // namespace landmark_merge_test
}  // namespace tutti::bundle
