// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/hall.hpp"

namespace tutti::simulation {

/// How good the images of a camera are.
struct ImageConfig {
  double noise_sigma = 2.0;         ///< Noise of a pixel, of 255 grey values.
  double exposure_swing = 0.15;     ///< Exposure is this share longer, and shorter,
  double exposure_period_s = 20.0;  ///< once in this time.
};

/// The same camera with images of half the width and height.
CameraModel halved(const CameraModel& camera);

/// A hall and its ray caster, shared by cameras and robots.
struct HallScene {
  explicit HallScene(Hall it) : hall(std::move(it)), surface(hall.mesh) {}
  Hall hall;
  Bvh surface;
};

/// Takes images of a hall. Immutable, safe to use from several threads.
class SimulatedCamera {
 public:
  SimulatedCamera(std::shared_ptr<const HallScene> scene, const CameraModel& model, const ImageConfig& config);

  /// What is seen from T_world_camera; `time_s` tells the exposure, `rng` the noise. One ray a pixel, through its
  /// centre; pixels that see nothing (no direction, or out of the hall) are black.
  [[nodiscard]] Image image(const Pose3& T_world_camera, double time_s, Rng rng) const;
  /// What a depth sensor with the same pixels would measure from there, with its noise.
  [[nodiscard]] DepthImage depth(const Pose3& T_world_camera, const DepthSensor& sensor, Rng rng) const;

 private:
  std::shared_ptr<const HallScene> scene_;
  CameraModel model_;
  ImageConfig config_;
  std::vector<Eigen::Vector3f> rays_;  ///< Unit, camera frame, by pixel; zero where there is none.
};

/// The images of a robot that moves along `truth` (T_world_body), one per camera and pose, made when asked for; with
/// `depth`, depth images of the first camera, too.
ImageStream simulate_images(std::shared_ptr<const HallScene> scene, const std::vector<Camera>& cameras,
                            Trajectory truth, const ImageConfig& config, Rng rng,
                            const std::optional<DepthSensor>& depth = {});

}  // namespace tutti::simulation
