// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>

#include "support/wire/messages.hpp"

/// Visual payloads, for the tests of wire/.
namespace tutti::wire::test {

inline ImuPreintegration any_imu(Rng& rng, std::uint32_t from_keyframe) {
  ImuPreintegration imu{.from_keyframe = from_keyframe, .duration_s = rng.uniform(0.1, 2.0)};
  imu.delta_rotation = any_pose(rng, 1.0).rotation;
  for (Eigen::Vector3d* v : {&imu.delta_velocity, &imu.delta_position, &imu.gyro_bias, &imu.accelerometer_bias})
    for (double& x : *v) x = rng.normal();
  Matrix9d root;
  for (double& x : root.reshaped()) x = rng.normal(0.01);
  imu.covariance = root * root.transpose();
  for (double& x : imu.d_bias.reshaped()) x = rng.normal();
  return imu;
}

/// Two cameras, about half of the images, keypoints with and without landmark and descriptor.
inline VisualPayload any_visual(Rng& rng, const Submap& submap, std::size_t keypoints = 20) {
  VisualPayload visual;
  const CameraModel model{CameraKind::pinhole, 752, 480, 458.0, 457.0, 367.0, 248.0, {-0.28, 0.07, 1e-4, 1e-5}};
  visual.cameras = {{model, any_pose(rng, 1.0)}, {model, any_pose(rng, 1.0)}};
  visual.landmarks.resize(rng.index(30));
  for (Landmark& landmark : visual.landmarks) {
    for (float& x : landmark.position) x = static_cast<float>(rng.normal(10.0));
    landmark.sigma_m = rng.bernoulli(0.1) ? 0.0F : static_cast<float>(std::exp(rng.normal(2.0)));
  }
  visual.descriptors = {DescriptorKind::maplab, 6, {}};
  for (std::uint64_t words = 6 * rng.index(40); words > 0; --words)
    visual.descriptors.bits.push_back(rng.index(~std::uint64_t{0}));
  for (const Keyframe& keyframe : submap.keyframes)
    for (const std::uint32_t camera : {0U, 1U}) {
      if (rng.bernoulli(0.5)) continue;
      VisualFrame& frame = visual.frames.emplace_back();
      frame.keyframe = keyframe.index;
      frame.camera = camera;
      std::size_t landmark = rng.index(4);
      for (std::uint64_t i = rng.index(keypoints); i > 0; --i) {
        Observation& seen = frame.observations.emplace_back();
        seen.pixel = {static_cast<float>(rng.uniform(-0.5, 751.5)), static_cast<float>(rng.uniform(-0.5, 479.5))};
        seen.sigma_px = static_cast<float>(std::exp(rng.normal()));
        landmark += 1 + rng.index(3);  // none twice
        if (landmark < visual.landmarks.size()) seen.landmark = static_cast<std::uint32_t>(landmark);
        if (rng.bernoulli(0.5) && visual.descriptors.size() > 0)
          seen.descriptor = static_cast<std::uint32_t>(rng.index(visual.descriptors.size()));
      }
    }
  for (std::size_t k = 0; k + 1 < submap.keyframes.size(); ++k)
    if (rng.bernoulli(0.7)) visual.imu.push_back(any_imu(rng, submap.keyframes[k].index));
  return visual;
}

inline SubmapMessage any_visual_submap(Rng& rng, std::size_t keyframes) {
  SubmapMessage message = any_submap(rng, keyframes, 0);
  message.submap.visual = std::make_shared<VisualPayload>(any_visual(rng, message.submap));
  return message;
}

}  // namespace tutti::wire::test
