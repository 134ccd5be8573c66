// SPDX-License-Identifier: BSD-3-Clause
// From simulated images to landmarks and revisits, without any recording.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "tutti/geometry/so3.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"
#include "tutti/perception/visual/visual_payload.hpp"
#include "tutti/simulation/camera.hpp"
#include "tutti/simulation/flight.hpp"

namespace tutti::visual {
namespace hall_test {

std::vector<Camera> stereo() {
  const CameraModel model =
      simulation::halved({CameraKind::pinhole, 752, 480, 458.7, 457.3, 367.2, 248.4, {-0.283, 0.074, 2e-4, 1.8e-5}});
  const Eigen::Quaterniond ahead((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  return {{model, {ahead, {0.0, 0.055, 0.0}}}, {model, {ahead, {0.0, -0.055, 0.0}}}};
}

class Hall : public testing::Test {
 protected:
  static constexpr double kRate_hz = 8.0;

  /// The keyframes of a few seconds of flight that begins `start_deg` round the hall, with true poses.
  std::vector<KeyframeImages> fly(const std::vector<Camera>& cameras, double start_deg, double duration_s) const {
    return see(cameras,
               simulation::simulate_flight({.duration_s = duration_s, .rate_hz = kRate_hz, .start_deg = start_deg},
                                           Timestamp{0}),
               3);  // about every 0.3 m
  }
  /// Every so many poses a keyframe.
  std::vector<KeyframeImages> see(const std::vector<Camera>& cameras, const Trajectory& truth,
                                  std::size_t every) const {
    const auto source =
        TrackingSource::open(simulation::simulate_images(scene_, cameras, truth, {}, Rng(3)), truth, {}).value();
    std::vector<KeyframeImages> out;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const bool keyframe = i % every == 0;
      auto images = source->images(i, keyframe).images;
      if (keyframe) out.push_back({static_cast<std::uint32_t>(out.size()), truth[i].pose, std::move(images)});
    }
    return out;
  }

  /// How far a point is from where its ray from a keyframe's first camera hits the hall, m.
  [[nodiscard]] double depth_error(const Pose3& T_world_camera, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d ray = (point - T_world_camera.translation).normalized();
    const auto hit = scene_->surface.cast(T_world_camera.translation.cast<float>(), ray.cast<float>(), 100.0F);
    return hit ? std::abs((point - T_world_camera.translation).norm() - static_cast<double>(hit->distance)) : 100.0;
  }

  std::shared_ptr<const simulation::HallScene> scene_ =
      std::make_shared<const simulation::HallScene>(simulation::make_hall({}, Rng(1)));
};

TEST_F(Hall, LandmarksReprojectWithinAPixelAndLieOnTheWalls) {
  const std::vector<Camera> cameras = stereo();
  for (const std::size_t count : {1U, 2U}) {
    const std::vector<Camera> these(cameras.begin(), cameras.begin() + static_cast<std::ptrdiff_t>(count));
    const auto keyframes = fly(these, 0.0, 3.0);
    ASSERT_GE(keyframes.size(), 5U);
    const auto payload = make_visual_payload(keyframes, these, {});
    ASSERT_TRUE(payload.has_value()) << payload.error().message;
    EXPECT_GE(payload->landmarks.size(), 150U * count) << count;
    int views = 0, within = 0, near = 0;
    for (const VisualFrame& frame : payload->frames) {
      const Camera& camera = these[frame.camera];
      const Pose3 T_world_camera = keyframes[frame.keyframe].T_submap_body * camera.T_body_camera;
      for (const Observation& it : frame.observations) {
        if (it.landmark == kNoIndex) continue;
        const Eigen::Vector3d point = payload->landmarks[it.landmark].position.cast<double>();
        const auto pixel = project(camera.model, T_world_camera.inverse() * point);
        ++views;
        within += pixel && (*pixel - it.pixel.cast<double>()).norm() < 1.0 ? 1 : 0;
        near += depth_error(T_world_camera, point) < 4.0 * payload->landmarks[it.landmark].sigma_m + 0.02 ? 1 : 0;
      }
    }
    EXPECT_GE(views, 500 * static_cast<int>(count));
    EXPECT_GE(within, 0.95 * views) << within << " of " << views << ", cameras " << count;
    EXPECT_GE(near, 0.85 * views) << near << " of " << views << ", cameras " << count;
  }
}

TEST_F(Hall, StereoHasDepthWhereNothingTranslates) {
  const Pose3 place = simulation::simulate_flight({.duration_s = 0.1}, Timestamp{0}).front().pose;
  Trajectory turning;
  for (int i = 0; i < 3; ++i)
    turning.push_back({Timestamp{0} + 0.1 * i, place * Pose3{so3_exp({0.0, 0.0, 0.02 * i}), Eigen::Vector3d::Zero()}});
  const std::vector<Camera> cameras = stereo();
  const auto stereo_images = see(cameras, turning, 1), mono = see({cameras[0]}, turning, 1);
  EXPECT_TRUE(make_visual_payload(mono, {cameras[0]}, {}).value().landmarks.empty());
  const VisualPayload payload = make_visual_payload(stereo_images, cameras, {}).value();
  EXPECT_GE(payload.landmarks.size(), 100U);
  std::size_t right = 0;
  std::vector<double> relative;
  const Pose3 T_world_camera = place * cameras[0].T_body_camera;
  for (const Landmark& landmark : payload.landmarks) {
    const Eigen::Vector3d point = landmark.position.cast<double>();
    const double error_m = depth_error(T_world_camera, point);
    right += error_m < 4.0 * landmark.sigma_m + 0.02 ? 1 : 0;
    relative.push_back(error_m / (point - T_world_camera.translation).norm());
  }
  EXPECT_GE(10 * right, 9 * payload.landmarks.size()) << right << " of " << payload.landmarks.size();
  std::ranges::nth_element(relative, relative.begin() + relative.size() / 2);
  EXPECT_LT(relative[relative.size() / 2], 0.05);
}

TEST_F(Hall, RevisitsAreKnownByTheirDescriptors) {
  const std::vector<Camera> cameras = {stereo()[0]};
  // Two flights over the same segment, and one elsewhere.
  const auto first = fly(cameras, 0.0, 1.0), again = fly(cameras, 4.0, 1.0), elsewhere = fly(cameras, 180.0, 1.0);
  const auto matches = [](const TrackedImage& a, const TrackedImage& b) {
    constexpr double kRatio = 0.8;
    int count = 0;
    for (std::size_t i = 0; i < a.descriptors.size(); ++i) {
      int least = 1000, second = 1000;
      for (std::size_t k = 0; k < b.descriptors.size(); ++k) {
        int bits = 0;
        for (std::size_t w = 0; w < a.descriptors.words; ++w)
          bits += std::popcount(a.descriptors.row(i)[w] ^ b.descriptors.row(k)[w]);
        if (bits < least) std::swap(bits, least);
        second = std::min(second, bits);
      }
      count += least < kRatio * second ? 1 : 0;
    }
    return count;
  };
  const int revisit = matches(first[0].images[0], again[0].images[0]);
  const int other = matches(first[0].images[0], elsewhere[0].images[0]);
  EXPECT_GE(revisit, 40);
  EXPECT_GE(revisit, 4 * other) << other;
}

}  // namespace hall_test
}  // namespace tutti::visual
