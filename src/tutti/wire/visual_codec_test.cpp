// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "support/wire/visual.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace visual_codec_test {

bool same(const ImuPreintegration& a, const ImuPreintegration& b, double covariance_error) {
  return a.from_keyframe == b.from_keyframe && a.duration_s == b.duration_s &&
         a.delta_rotation.coeffs() == b.delta_rotation.coeffs() && a.delta_velocity == b.delta_velocity &&
         a.delta_position == b.delta_position && a.d_bias == b.d_bias && a.gyro_bias == b.gyro_bias &&
         a.accelerometer_bias == b.accelerometer_bias &&
         (a.covariance - b.covariance).cwiseAbs().maxCoeff() <= covariance_error;
}

bool same_imu(const VisualPayload& a, const VisualPayload& b, double covariance_error) {
  return std::ranges::equal(a.imu, b.imu, [&](const auto& x, const auto& y) { return same(x, y, covariance_error); });
}

bool is_near(float a, float b) { return a == b || std::abs(std::log(a / b)) < 0.006F; }

RC_GTEST_PROP(VisualCodec, RoundTrip, (std::uint32_t seed)) {
  Rng rng(seed);
  const SubmapMessage message = test::any_visual_submap(rng, 1 + rng.index(12));
  const auto decoded = decode_submap(encode(message));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(decoded->submap.visual != nullptr);
  const VisualPayload& in = *message.submap.visual;
  const VisualPayload& out = *decoded->submap.visual;
  RC_ASSERT(out.cameras == in.cameras);
  RC_ASSERT(out.descriptors == in.descriptors);
  RC_ASSERT(same_imu(out, in, 1e-15));  // what is not symmetric to the bit becomes so
  RC_ASSERT(out.landmarks.size() == in.landmarks.size());
  for (std::size_t i = 0; i < in.landmarks.size(); ++i) {
    RC_ASSERT((out.landmarks[i].position - in.landmarks[i].position).cwiseAbs().maxCoeff() <= 0.0005F);
    RC_ASSERT(is_near(out.landmarks[i].sigma_m, in.landmarks[i].sigma_m));
  }
  RC_ASSERT(out.frames.size() == in.frames.size());
  for (std::size_t i = 0; i < in.frames.size(); ++i) {
    RC_ASSERT(out.frames[i].keyframe == in.frames[i].keyframe);
    RC_ASSERT(out.frames[i].camera == in.frames[i].camera);
    RC_ASSERT(out.frames[i].observations.size() == in.frames[i].observations.size());
    for (std::size_t k = 0; k < in.frames[i].observations.size(); ++k) {
      const Observation& a = in.frames[i].observations[k];
      const Observation& b = out.frames[i].observations[k];
      RC_ASSERT((a.pixel - b.pixel).cwiseAbs().maxCoeff() <= 1.0F / 32.0F);
      RC_ASSERT(is_near(a.sigma_px, b.sigma_px));
      RC_ASSERT(a.landmark == b.landmark);
      RC_ASSERT(a.descriptor == b.descriptor);
    }
  }
  const auto again = decode_submap(encode(*decoded));
  RC_ASSERT(again.has_value());
  RC_ASSERT(again->submap.visual->frames == out.frames);
  RC_ASSERT(again->submap.visual->landmarks == out.landmarks);
  RC_ASSERT(same_imu(*again->submap.visual, out, 0.0));
}

TEST(VisualCodec, CamerasAloneAndNothingAtAllComeBack) {
  Rng rng(1);
  SubmapMessage message = test::any_submap(rng, 1, 0);
  EXPECT_EQ(decode_submap(encode(message))->submap.visual, nullptr);
  auto blind = std::make_shared<VisualPayload>();
  blind->cameras = test::any_visual(rng, message.submap).cameras;
  blind->cameras.back().model.kind = CameraKind::rational;
  blind->cameras.back().model.distortion = {0.26, -0.95, -0.005, 0.003, 1.16, 0.1, 0.2, 0.3};
  message.submap.visual = blind;
  const auto decoded = decode_submap(encode(message));
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  ASSERT_NE(decoded->submap.visual, nullptr);
  EXPECT_EQ(decoded->submap.visual->cameras, blind->cameras);
  EXPECT_TRUE(decoded->submap.visual->frames.empty());
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(VisualCodec, WhatIsWrongIsRefusedByName) {
  Rng rng(2);
  SubmapMessage message = test::any_submap(rng, 8, 0);
  VisualPayload good;
  do {
    good = test::any_visual(rng, message.submap);
  } while (good.frames.size() < 3 || good.frames[0].observations.size() < 2 || good.landmarks.size() < 3 ||
           good.descriptors.size() < 2 || good.imu.size() < 2);
  const auto refusal = [&](const std::function<void(VisualPayload&)>& change) {
    auto bad = std::make_shared<VisualPayload>(good);
    change(*bad);
    message.submap.visual = bad;
    const Status status = validate(message);
    return status ? std::string("accepted") : status.error().message;
  };
  EXPECT_EQ(refusal([](VisualPayload&) {}), "accepted");
  using V = VisualPayload;
  const std::vector<std::pair<const char*, std::function<void(V&)>>> wrong = {
      {"0 cameras, expected 1 to 8", [](V& v) { v.cameras.clear(); }},
      {"camera: focal lengths", [](V& v) { v.cameras[1].model.fx = 0.0; }},
      {"camera: camera kind 9", [](V& v) { v.cameras[0].model.kind = static_cast<CameraKind>(9); }},
      {"an image of 70000 x 480", [](V& v) { v.cameras[0].model.width_px = 70'000; }},
      {"T_body_camera", [](V& v) { v.cameras[0].T_body_camera.rotation.coeffs() *= 2.0; }},
      {"image 0 is of keyframe", [](V& v) { v.frames[0].keyframe -= 1000; }},
      {"image 1 is of camera 2 of 2", [](V& v) { v.frames[1].camera = 2; }},
      {"does not come after", [](V& v) { std::swap(v.frames[0], v.frames[1]); }},
      {"outside the image", [](V& v) { v.frames[0].observations[0].pixel.x() = 760.0F; }},
      {"outside the image", [](V& v) { v.frames[0].observations[0].pixel.y() = kNan; }},
      {"a sigma of 0 px", [](V& v) { v.frames[0].observations[0].sigma_px = 0.0F; }},
      {"a sigma of nan px", [](V& v) { v.frames[0].observations[0].sigma_px = kNan; }},
      {"image 0: landmark 3000 of", [](V& v) { v.frames[0].observations[0].landmark = 3000; }},
      {"landmark 1 is seen twice",
       [](V& v) { v.frames[0].observations[0].landmark = v.frames[0].observations[1].landmark = 1; }},
      {"image 0: descriptor 3000 of", [](V& v) { v.frames[0].observations[0].descriptor = 3000; }},
      {"descriptors of kind 9", [](V& v) { v.descriptors.kind = static_cast<DescriptorKind>(9); }},
      {"with 9 words", [](V& v) { v.descriptors.words = 9; }},
      {"descriptors of kind", [](V& v) { v.descriptors.bits.pop_back(); }},
      {"landmark 2: not within", [](V& v) { v.landmarks[2].position.y() = 1e5F; }},
      {"landmark 2: a sigma", [](V& v) { v.landmarks[2].sigma_m = -1.0F; }},
      {"IMU from keyframe", [](V& v) { std::swap(v.imu[0], v.imu[1]); }},
      {"a duration of", [](V& v) { v.imu[0].duration_s = 0.0; }},
      {"its rotation is none", [](V& v) { v.imu[0].delta_rotation.coeffs() *= 1.1; }},
      {"not finite", [](V& v) { v.imu[1].d_bias(3, 4) = kNan; }},
      {"covariance", [](V& v) { v.imu[1].covariance(2, 2) = -1.0; }},
      {"covariance", [](V& v) { v.imu[1].covariance(2, 2) = kNan; }},
      {"covariance", [](V& v) { v.imu[1].covariance(1, 2) = v.imu[1].covariance(2, 1) = 1.0; }},
  };
  for (const auto& [expected, change] : wrong)
    EXPECT_NE(refusal(change).find(expected), std::string::npos) << expected << ": " << refusal(change);
}

}  // namespace visual_codec_test
}  // namespace tutti::wire
