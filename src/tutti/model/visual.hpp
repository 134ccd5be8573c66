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

/// What made the descriptors. Only descriptors of one kind can be compared.
enum class DescriptorKind : std::uint8_t { none = 0, orb = 1, brisk = 2, maplab = 3 };  // maplab: 384 bits, as imported

/// Binary descriptors, one per row, bits padded with zeros to words of 64.
struct Descriptors {
  DescriptorKind kind = DescriptorKind::none;
  std::uint32_t words = 0;          ///< Per descriptor: 4 for ORB, 8 for BRISK, 6 for maplab's.
  std::vector<std::uint64_t> bits;  ///< size() * words
  [[nodiscard]] std::size_t size() const { return words == 0 ? 0 : bits.size() / words; }
  [[nodiscard]] std::span<const std::uint64_t> row(std::size_t i) const { return {bits.data() + i * words, words}; }
  friend bool operator==(const Descriptors&, const Descriptors&) = default;
};

inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFF;

/// A keypoint of an image.
struct Observation {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;                ///< Standard deviation of each coordinate.
  std::uint32_t landmark = kNoIndex;    ///< Index into VisualPayload::landmarks: what it is a view of.
  std::uint32_t descriptor = kNoIndex;  ///< Row of VisualPayload::descriptors; a byte budget leaves many without.
  friend bool operator==(const Observation&, const Observation&) = default;
};

/// A keypoint as the tracker leaves it.
struct TrackedKeypoint {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
  std::uint64_t track = 0;  ///< The same number in several images is the same point; 0: seen in this one alone.
  friend bool operator==(const TrackedKeypoint&, const TrackedKeypoint&) = default;
};

/// What a robot's tracker (or a file) says of one image: the robot's input, as a scan is a LiDAR's.
struct TrackedImage {
  std::uint32_t camera = 0;  ///< Index into the robot's cameras.
  std::vector<TrackedKeypoint> keypoints;
  Descriptors descriptors;  ///< One per keypoint, or none.
  friend bool operator==(const TrackedImage&, const TrackedImage&) = default;
};

/// What the IMU said at a moment, in the body frame.
struct ImuSample {
  Timestamp stamp;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();           ///< rad/s
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  ///< m/s^2, +9.81 upwards at rest.
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

/// Of samples by increasing stamps, those that say how a body moved from one moment to another: from the last one
/// before or at `from` to the first one not before `until`, as far as there are any.
template <class Samples>
std::vector<ImuSample> imu_over(const Samples& samples, Timestamp from, Timestamp until) {
  auto first = std::ranges::upper_bound(samples, from, {}, &ImuSample::stamp);
  auto last = std::ranges::lower_bound(samples, until, {}, &ImuSample::stamp);
  if (first != samples.begin()) --first;
  if (last != samples.end()) ++last;
  return first < last ? std::vector<ImuSample>(first, last) : std::vector<ImuSample>();
}

/// The images of all cameras at one moment.
struct TrackedImages {
  Timestamp stamp;
  std::shared_ptr<const std::vector<Camera>> cameras;  ///< Never null, the same for all images of a robot.
  std::vector<TrackedImage> images;                    ///< At most one per camera.
  /// What the IMU said since the images before, from its last sample before them to its first one not before these:
  /// increasing stamps. None when there is no IMU.
  std::vector<ImuSample> imu;
  ImuNoise imu_noise;
};

/// There are cameras, each sound; each image is of one of them, has finite keypoints with positive sigmas, no track
/// twice, and as many descriptors as keypoints or none; what the IMU said is finite, with increasing stamps.
Status check_images(const TrackedImages& images);

/// One image, at the stamp of a keyframe.
struct VisualFrame {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index of a keyframe of the submap.
  std::uint32_t camera = 0;    ///< Index into VisualPayload::cameras.
  std::vector<Observation> observations;
  friend bool operator==(const VisualFrame&, const VisualFrame&) = default;
};

/// A point that several images saw, triangulated with the robot's odometry.
struct Landmark {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< Submap frame, m.
  float sigma_m = 0.0F;  ///< Standard deviation along its most uncertain direction, usually the viewing ray.
  friend bool operator==(const Landmark&, const Landmark&) = default;
};

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// What the IMU measured from one keyframe to the next, preintegrated (Forster et al. 2017, eqs. 35 to 38, 44, 63),
/// order everywhere [rotation; velocity; position], linearised at the biases given.
struct ImuPreintegration {
  std::uint32_t from_keyframe = 0;  ///< KeyframeId::index; to the one after it.
  double duration_s = 0.0;
  Eigen::Quaterniond delta_rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_velocity = Eigen::Vector3d::Zero();  ///< m/s, in the frame of the first keyframe.
  Eigen::Vector3d delta_position = Eigen::Vector3d::Zero();  ///< m
  Matrix9d covariance = Matrix9d::Zero();                    ///< Of [rotation; velocity; position].
  Eigen::Matrix<double, 9, 6> d_bias = Eigen::Matrix<double, 9, 6>::Zero();  ///< By [gyro bias; accelerometer bias].
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();                       ///< rad/s, at the linearisation.
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();              ///< m/s^2, at the linearisation.
};

/// What the cameras of one robot saw along one submap.
struct VisualPayload {
  std::vector<Camera> cameras;
  std::vector<VisualFrame> frames;  ///< By keyframe, then by camera.
  std::vector<Landmark> landmarks;
  Descriptors descriptors;
  std::vector<ImuPreintegration> imu;  ///< By keyframe; empty when there is no IMU.
};

}  // namespace tutti
