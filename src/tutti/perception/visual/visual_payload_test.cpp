// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/visual_payload.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "support/perception/visual/textured_room.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace visual_payload_test {

using namespace test;
const auto kRoom = textured_room(600, Rng(1));
const auto kCameras = stereo_cameras();
const VisualSubmapConfig kConfig;

Seen seen(const Flight& flight = {}) { return fly(kRoom, kCameras, flight, Rng(2)); }

VisualPayload payload_of(const Seen& seen, const VisualSubmapConfig& config = kConfig) {
  auto payload = make_visual_payload(seen.images, kCameras, config);
  EXPECT_TRUE(payload.has_value()) << payload.error().message;
  return payload.value_or(VisualPayload{});
}

/// The points of the room that the payload's landmarks are, by the pixels that saw them.
std::vector<std::size_t> points_of(const VisualPayload& payload, const Seen& seen) {
  std::vector<std::size_t> out(payload.landmarks.size(), kNoIndex);
  std::size_t image = 0;
  for (const KeyframeImages& keyframe : seen.images)
    for (const TrackedImage& tracked : keyframe.images) {
      for (const Observation& o : payload.frames[image].observations)
        for (const TrackedKeypoint& keypoint : tracked.keypoints)
          if (o.landmark != kNoIndex && keypoint.pixel == o.pixel) out[o.landmark] = keypoint.track - 1;
      ++image;
    }
  return out;
}

/// Errors over sigma_m of all landmarks, largest last.
std::vector<double> normalised_errors(const VisualPayload& payload, const Seen& seen) {
  const auto points = points_of(payload, seen);
  std::vector<double> out;
  for (std::size_t l = 0; l < points.size(); ++l) {
    const Eigen::Vector3d truth = seen.T_world_submap.inverse() * kRoom[points[l]].position;
    out.push_back((payload.landmarks[l].position.cast<double>() - truth).norm() / payload.landmarks[l].sigma_m);
  }
  std::ranges::sort(out);
  return out;
}

TEST(VisualPayload, landmarksAreWhereTheirSigmaSays) {
  for (const std::uint32_t cameras : {1U, 2U}) {
    const Seen s = seen({.cameras = cameras});
    const VisualPayload payload = payload_of(s);
    const auto errors = normalised_errors(payload, s);
    ASSERT_GT(errors.size(), 100U);
    EXPECT_LT(errors[errors.size() / 2], 1.0);  // of a normal distribution the median is at 0.67
    EXPECT_GT(errors[errors.size() / 2], 0.4);
    EXPECT_LT(errors[errors.size() * 97 / 100], 3.0);
  }
}

TEST(VisualPayload, odometryNoiseIsInTheSigma) {
  const Seen s = seen({.odometry_noise_m = 0.01});
  const auto errors = normalised_errors(payload_of(s), s);
  ASSERT_GT(errors.size(), 100U);
  EXPECT_LT(errors[errors.size() / 2], 1.2);
}

TEST(VisualPayload, aStereoPairIsEnough) {
  const Seen s = seen({.keyframes = 1, .cameras = 2});
  const VisualPayload payload = payload_of(s);
  EXPECT_GT(payload.landmarks.size(), 30U);
  EXPECT_EQ(payload.frames.size(), 2U);
  EXPECT_LT(normalised_errors(payload, s).front(), 1.0);
}

TEST(VisualPayload, aRobotThatStandsStillWithOneCameraHasNoLandmarks) {
  const VisualPayload payload = payload_of(seen({.to = Flight{}.from, .turn_rad = 0.0}));
  EXPECT_TRUE(payload.landmarks.empty());
  EXPECT_FALSE(payload.frames.front().observations.empty());  // but its keypoints can be found elsewhere
}

double bytes_of(const VisualPayload& payload) {
  double out = 8.0 * static_cast<double>(payload.descriptors.bits.size() + payload.landmarks.size());
  for (const VisualFrame& frame : payload.frames) out += 8.0 * static_cast<double>(frame.observations.size());
  return out;
}

double mean_views(const VisualPayload& payload) {
  double views = 0.0;
  for (const VisualFrame& frame : payload.frames)
    for (const Observation& o : frame.observations) views += o.landmark != kNoIndex;
  return views / static_cast<double>(payload.landmarks.size());
}

TEST(VisualPayload, theBudgetKeepsWhatManyImagesSawAndLeavesNoImageOut) {
  const Seen s = seen({.to = {6.5, 2.4, 1.6}, .turn_rad = 1.2, .keyframes = 12});
  const VisualPayload all = payload_of(s);
  for (const double budget_kb : {60.0, 20.0}) {
    const VisualPayload some = payload_of(s, {.budget_kb = budget_kb});
    EXPECT_LE(bytes_of(some), 1e3 * budget_kb);
    EXPECT_GT(bytes_of(some), 0.9e3 * budget_kb);
    EXPECT_GT(mean_views(some), mean_views(all));
    for (const VisualFrame& frame : some.frames) EXPECT_GT(frame.observations.size(), 10U);
  }
}

TEST(VisualPayload, withOneDescriptorEachLandmarkHasItsMostTypicalOne) {
  const VisualPayload payload = payload_of(seen(), {.one_descriptor_per_landmark = true});
  ASSERT_EQ(payload.descriptors.size(), payload.landmarks.size());
  std::set<std::uint32_t> described;
  for (const VisualFrame& frame : payload.frames)
    for (const Observation& o : frame.observations) {
      ASSERT_NE(o.landmark, kNoIndex);
      EXPECT_TRUE(o.descriptor == kNoIndex || described.insert(o.landmark).second);
    }
  EXPECT_EQ(described.size(), payload.landmarks.size());
}

TEST(VisualPayload, withoutDescriptorsThereAreStillLandmarks) {
  Seen s = seen();
  for (KeyframeImages& keyframe : s.images) keyframe.images.front().descriptors = {};
  const VisualPayload payload = payload_of(s);
  EXPECT_GT(payload.landmarks.size(), 100U);
  EXPECT_EQ(payload.descriptors.size(), 0U);
}

std::string complaint(const Seen& s, const std::vector<Camera>& cameras = kCameras) {
  const auto payload = make_visual_payload(s.images, cameras, kConfig);
  return payload ? "" : payload.error().message;
}

TEST(VisualPayload, wrongCalibrationIsReported) {
  auto cameras = kCameras;
  cameras[0].T_body_camera.rotation = cameras[0].T_body_camera.rotation * so3_exp({0.0, 0.0, 0.2});
  EXPECT_NE(
      complaint(seen({.from = {2.0, 1.0, 1.4}, .to = {5.0, 1.0, 1.4}, .turn_rad = 1.0}), cameras).find("calibration"),
      std::string::npos);
}

TEST(VisualPayload, whatTheOdometryExplainsIsNoWrongCalibration) {
  const VisualSubmapConfig strict{.max_residual_px = 1.0};
  const auto words = [&](const Seen& seen, double focal) {
    auto cameras = kCameras;
    for (Camera& camera : cameras) camera.model.fx *= focal;
    const auto payload = make_visual_payload(seen.images, cameras, strict);
    return payload ? std::string() : payload.error().message;
  };
  Seen s = seen({.turn_rad = 1.0});
  EXPECT_EQ(words(s, 1.1).find("landmarks miss their pixels by "), 0U) << words(s, 1.1);
  EXPECT_NE(words(s, 1.1).find("expected 0.7 px by the odometry's covariance and at most 1.4: calibration"),
            std::string::npos)
      << words(s, 1.1);
  EXPECT_EQ(words(s, 1.001), "");
  for (KeyframeImages& keyframe : s.images) keyframe.turn_variance_rad2 = keyframe.keyframe * 0.02 * 0.02;
  EXPECT_EQ(words(s, 1.1), "");
}

TEST(VisualPayload, inputThatContradictsItselfIsAnError) {
  const Seen good = seen({.keyframes = 3});
  Seen s = good;
  s.images[1].images[0].camera = 7;
  EXPECT_NE(complaint(s).find("keyframe 1, image of camera 7: camera 7 of 2"), std::string::npos);
  s = good;
  s.images[1].images[0].keypoints[0].pixel.x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(complaint(s).find("not in the image"), std::string::npos);
  s = good;
  s.images[1].images[0].keypoints[0].sigma_px = 0.0F;
  EXPECT_NE(complaint(s).find("standard deviation"), std::string::npos);
  s = good;
  s.images[1].images[0].keypoints.pop_back();
  EXPECT_NE(complaint(s).find("descriptors of"), std::string::npos);
  s = good;
  s.images[1].images[0].keypoints[1].track = s.images[1].images[0].keypoints[0].track;
  EXPECT_NE(complaint(s).find("twice in the image"), std::string::npos);
  s = good;
  s.images[1].images.push_back(s.images[1].images[0]);
  EXPECT_NE(complaint(s).find("two images of camera 0"), std::string::npos);
  s = good;
  s.images[1].images[0].descriptors.kind = DescriptorKind::orb;
  EXPECT_NE(complaint(s).find("another kind"), std::string::npos);
}

}  // namespace visual_payload_test
}  // namespace tutti::visual
