// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// A calibrated camera of a robot.
struct Camera {
  CameraModel model;
  Pose3 T_body_camera;
  friend bool operator==(const Camera&, const Camera&) = default;
};

/// The algorithm that made descriptors. Only descriptors of one kind can be compared.
enum class DescriptorKind : std::uint8_t { none = 0, orb = 1, brisk = 2, maplab = 3 };  // maplab: 384 bits, as imported

/// Binary descriptors, one per row, padded with zero bits to words of 64 bits.
struct Descriptors {
  DescriptorKind kind = DescriptorKind::none;
  std::uint32_t words = 0;          ///< Words per descriptor: 4 for ORB, 8 for BRISK, 6 for maplab's.
  std::vector<std::uint64_t> bits;  ///< size() * words
  [[nodiscard]] std::size_t size() const { return words == 0 ? 0 : bits.size() / words; }
  [[nodiscard]] std::span<const std::uint64_t> row(std::size_t i) const { return {bits.data() + i * words, words}; }
  friend bool operator==(const Descriptors&, const Descriptors&) = default;
};

inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFF;

/// A keypoint of a submap's image.
struct Observation {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;  ///< Standard deviation of each coordinate.
  /// Index into VisualPayload::landmarks of the landmark that it is a view of, or kNoIndex.
  std::uint32_t landmark = kNoIndex;
  /// Row of VisualPayload::descriptors, or kNoIndex: a byte budget leaves many without.
  std::uint32_t descriptor = kNoIndex;
  friend bool operator==(const Observation&, const Observation&) = default;
};

/// A keypoint as the tracker gives it.
struct TrackedKeypoint {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
  /// Keypoints with the same number in several images are the same point; 0: seen in this image only.
  std::uint64_t track = 0;
  friend bool operator==(const TrackedKeypoint&, const TrackedKeypoint&) = default;
};

/// The keypoints of one image, from a robot's tracker or a file. This is the visual input of a robot, as a scan is its
/// LiDAR's.
struct TrackedImage {
  std::uint32_t camera = 0;  ///< Index into the robot's cameras.
  std::vector<TrackedKeypoint> keypoints;
  Descriptors descriptors;  ///< One per keypoint, or none.
  friend bool operator==(const TrackedImage&, const TrackedImage&) = default;
};

/// One sample of the IMU, in the body frame.
struct ImuSample {
  Timestamp stamp;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();           ///< rad/s
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  ///< Specific force in m/s^2: +9.81 upwards at rest.
  friend bool operator==(const ImuSample&, const ImuSample&) = default;
};

/// Noise densities of an IMU, as calibrated (EuRoC's sensor.yaml has them under these names).
struct ImuNoise {
  double gyro_noise_density = 1.7e-4;         ///< rad/s/sqrt(Hz)
  double gyro_random_walk = 2e-5;             ///< rad/s^2/sqrt(Hz)
  double accelerometer_noise_density = 2e-3;  ///< m/s^2/sqrt(Hz)
  double accelerometer_random_walk = 3e-3;    ///< m/s^3/sqrt(Hz)
  friend bool operator==(const ImuNoise&, const ImuNoise&) = default;
};

/// The IMU samples that cover the motion from `from` to `until`: from the last one at or before `from` to the first one
/// at or after `until`, as far as there are any. `samples` have increasing stamps.
template <class Samples>
std::vector<ImuSample> imu_over(const Samples& samples, Timestamp from, Timestamp until) {
  auto first = std::ranges::upper_bound(samples, from, {}, &ImuSample::stamp);
  auto last = std::ranges::lower_bound(samples, until, {}, &ImuSample::stamp);
  if (first != samples.begin()) --first;
  if (last != samples.end()) ++last;
  return first < last ? std::vector<ImuSample>(first, last) : std::vector<ImuSample>();
}

/// The images of all cameras at one time.
struct TrackedImages {
  Timestamp stamp;
  std::shared_ptr<const std::vector<Camera>> cameras;  ///< Never null, and the same for all images of a robot.
  std::vector<TrackedImage> images;                    ///< At most one per camera.
  /// The IMU samples since the previous images, from the last one before those to the first one not before these, with
  /// increasing stamps. Empty without an IMU.
  std::vector<ImuSample> imu;
  ImuNoise imu_noise;
};

/// Fails unless there are cameras, each valid; each image is of one of them and has finite keypoints with positive
/// sigmas, no track twice, and either no descriptors or one per keypoint; and IMU samples are finite with increasing
/// stamps.
Status check_images(const TrackedImages& images);

/// The keypoints of one image, taken at the stamp of a keyframe.
struct VisualFrame {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index of a keyframe of the submap.
  std::uint32_t camera = 0;    ///< Index into VisualPayload::cameras.
  std::vector<Observation> observations;
  friend bool operator==(const VisualFrame&, const VisualFrame&) = default;
};

/// A point seen in several images, triangulated with the robot's odometry.
struct Landmark {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< Submap frame, m.
  float sigma_m = 0.0F;  ///< Standard deviation along its most uncertain direction, which is usually the viewing ray.
  friend bool operator==(const Landmark&, const Landmark&) = default;
};

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// The IMU's measurements from one keyframe to the next, preintegrated (Forster et al. 2017, eqs. 35 to 38, 44, 63) and
/// linearised at the given biases. Vectors and matrices are ordered [rotation; velocity; position].
struct ImuPreintegration {
  std::uint32_t from_keyframe = 0;  ///< KeyframeId::index of the first keyframe; the second is the one after it.
  double duration_s = 0.0;
  Eigen::Quaterniond delta_rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_velocity = Eigen::Vector3d::Zero();  ///< m/s, in the frame of the first keyframe.
  Eigen::Vector3d delta_position = Eigen::Vector3d::Zero();  ///< m, in the frame of the first keyframe.
  Matrix9d covariance = Matrix9d::Zero();                    ///< In rad, m/s, m.
  /// Derivative by [gyro bias; accelerometer bias].
  Eigen::Matrix<double, 9, 6> d_bias = Eigen::Matrix<double, 9, 6>::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< The linearisation's, rad/s.
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< The linearisation's, m/s^2.
};

/// The visual data of one robot's cameras along one submap.
struct VisualPayload {
  std::vector<Camera> cameras;
  std::vector<VisualFrame> frames;  ///< Sorted by keyframe, then by camera.
  std::vector<Landmark> landmarks;
  Descriptors descriptors;
  std::vector<ImuPreintegration> imu;  ///< Sorted by keyframe; empty without an IMU.
};

}  // namespace tutti
