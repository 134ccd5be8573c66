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

/// Noise and exposure of a camera's images.
struct ImageConfig {
  double noise_sigma = 2.0;         ///< Standard deviation per pixel, of 255 grey values.
  double exposure_swing = 0.15;     ///< The exposure varies by this share, up and down,
  double exposure_period_s = 20.0;  ///< once in this period.
};

/// The same camera with images of half the width and height.
CameraModel halved(const CameraModel& camera);

/// A hall and its ray caster, shared by cameras and robots.
struct HallScene {
  explicit HallScene(Hall it) : hall(std::move(it)), surface(hall.mesh) {}
  Hall hall;
  Bvh surface;
};

/// Renders images of a hall. Immutable, may be used from several threads.
class SimulatedCamera {
 public:
  SimulatedCamera(std::shared_ptr<const HallScene> scene, const CameraModel& model, const ImageConfig& config);

  /// The image from T_world_camera. `time_s` sets the exposure, `rng` the noise. One ray is cast per pixel, through its
  /// centre; pixels that see nothing (no direction, or out of the hall) are black.
  [[nodiscard]] Image image(const Pose3& T_world_camera, double time_s, Rng rng) const;
  /// The depths that a sensor with the same pixels would measure from T_world_camera, with its noise.
  [[nodiscard]] DepthImage depth(const Pose3& T_world_camera, const DepthSensor& sensor, Rng rng) const;

 private:
  std::shared_ptr<const HallScene> scene_;
  CameraModel model_;
  ImageConfig config_;
  std::vector<Eigen::Vector3f> rays_;  ///< Per pixel a unit direction in the camera frame, or zero.
};

/// The images of a robot that moves along `truth` (T_world_body), one per camera and pose, rendered on demand; with
/// `depth`, also depth images of the first camera.
ImageStream simulate_images(std::shared_ptr<const HallScene> scene, const std::vector<Camera>& cameras,
                            Trajectory truth, const ImageConfig& config, Rng rng,
                            const std::optional<DepthSensor>& depth = {});

}  // namespace tutti::simulation
