// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tutti/wire/internal/visual_codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

Status check_calibration(const Camera& camera) {
  if (auto ok = check_camera(camera.model); !ok) return ok;
  if (static_cast<std::size_t>(std::max(camera.model.width_px, camera.model.height_px)) > kMaxImageSide_px)
    return fail(ErrorCode::invalid, "an image of {} x {} pixels, at most {} are accepted", camera.model.width_px,
                camera.model.height_px, kMaxImageSide_px);
  if (!is_valid(camera.T_body_camera) || camera.T_body_camera.translation.cwiseAbs().maxCoeff() > kMaxCoordinate_m)
    return fail(ErrorCode::invalid, "T_body_camera is no pose");
  return {};
}

Status check_counts_of(const VisualPayload& visual) {
  std::size_t observations = 0;
  for (const VisualFrame& frame : visual.frames) observations += frame.observations.size();
  const Descriptors& descriptors = visual.descriptors;
  if (visual.cameras.empty() || visual.cameras.size() > kMaxCameras)
    return fail(ErrorCode::invalid, "{} cameras, expected 1 to {}", visual.cameras.size(), kMaxCameras);
  if (visual.frames.size() > kMaxImages || observations > kMaxObservations || visual.landmarks.size() > kMaxLandmarks)
    return fail(ErrorCode::invalid, "{} images, {} observations, {} landmarks, at most {}, {} and {} are accepted",
                visual.frames.size(), observations, visual.landmarks.size(), kMaxImages, kMaxObservations,
                kMaxLandmarks);
  const bool is_none = descriptors.kind == DescriptorKind::none;
  if (descriptors.kind > DescriptorKind::maplab || is_none != (descriptors.words == 0) ||
      (is_none && !descriptors.bits.empty()) || descriptors.words > kMaxDescriptorWords ||
      (descriptors.words != 0 && descriptors.bits.size() % descriptors.words != 0) ||
      8 * descriptors.bits.size() > kMaxDescriptorBytes)
    return fail(ErrorCode::invalid, "descriptors of kind {} with {} words each, {} in all",
                static_cast<int>(descriptors.kind), descriptors.words, descriptors.bits.size());
  return {};
}

/// `last_seen`: per landmark the number of the image, from 1, that saw it last.
Status check_observation(const VisualPayload& visual, const CameraModel& camera, const Observation& seen,
                         std::size_t image, std::vector<std::size_t>& last_seen) {
  constexpr double kRounding_px = -1.0;  // keypoints at the edge of the image may be rounded out of it
  if (!seen.pixel.allFinite() || !in_image(camera, seen.pixel.cast<double>(), kRounding_px))
    return fail(ErrorCode::invalid, "keypoint at ({}, {}) px, outside the image", seen.pixel.x(), seen.pixel.y());
  if (!(seen.sigma_px > 0.0F && seen.sigma_px <= kMaxSigma_px))
    return fail(ErrorCode::invalid, "a sigma of {} px, expected above 0 to {}", seen.sigma_px, kMaxSigma_px);
  if (seen.descriptor != kNoIndex && seen.descriptor >= visual.descriptors.size())
    return fail(ErrorCode::invalid, "descriptor {} of {}", seen.descriptor, visual.descriptors.size());
  if (seen.landmark == kNoIndex) return {};
  if (seen.landmark >= visual.landmarks.size())
    return fail(ErrorCode::invalid, "landmark {} of {}", seen.landmark, visual.landmarks.size());
  if (std::exchange(last_seen[seen.landmark], image) == image)
    return fail(ErrorCode::invalid, "landmark {} is seen twice", seen.landmark);
  return {};
}

Status check_frames(const Submap& submap) {
  const VisualPayload& visual = *submap.visual;
  std::vector<std::size_t> last_seen(visual.landmarks.size());
  for (std::size_t i = 0; i < visual.frames.size(); ++i) {
    const VisualFrame& frame = visual.frames[i];
    const std::string where = "image " + std::to_string(i);
    if (frame.keyframe < submap.keyframes.front().index || frame.keyframe > submap.keyframes.back().index)
      return fail(ErrorCode::invalid, "{} is of keyframe {}, expected {} to {}", where, frame.keyframe,
                  submap.keyframes.front().index, submap.keyframes.back().index);
    if (frame.camera >= visual.cameras.size())
      return fail(ErrorCode::invalid, "{} is of camera {} of {}", where, frame.camera, visual.cameras.size());
    const auto order = [](const VisualFrame& f) { return std::pair(f.keyframe, f.camera); };
    if (i > 0 && order(frame) <= order(visual.frames[i - 1]))
      return fail(ErrorCode::invalid, "{} does not come after the one before it", where);
    for (const Observation& seen : frame.observations)
      if (auto ok = check_observation(visual, visual.cameras[frame.camera].model, seen, i + 1, last_seen); !ok)
        return in_context(where, ok.error());
  }
  return {};
}

Status check_landmark(const Landmark& landmark) {
  if (!landmark.position.allFinite() ||
      landmark.position.cwiseAbs().maxCoeff() > static_cast<float>(kMaxLandmarkRange_m))
    return fail(ErrorCode::invalid, "not within {} m", kMaxLandmarkRange_m);
  if (!(landmark.sigma_m >= 0.0F && landmark.sigma_m <= kMaxLandmarkRange_m))
    return fail(ErrorCode::invalid, "a sigma of {} m, expected 0 to {}", landmark.sigma_m, kMaxLandmarkRange_m);
  return {};
}

Status check_imu(const ImuPreintegration& imu) {
  constexpr double kRounding = 1e-6;
  if (!(imu.duration_s > 0.0) || !std::isfinite(imu.duration_s))
    return fail(ErrorCode::invalid, "a duration of {} s", imu.duration_s);
  if (!is_valid(Pose3{imu.delta_rotation, imu.delta_position}) || !imu.delta_velocity.allFinite() ||
      !imu.d_bias.allFinite() || !imu.gyro_bias.allFinite() || !imu.accelerometer_bias.allFinite())
    return fail(ErrorCode::invalid, "not finite, or its rotation is none");
  // Like check_covariance(): what is divided by its standard deviations has ones on the diagonal.
  const Matrix9d& covariance = imu.covariance;
  const Vector9d sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Vector9d scale = sigma.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  Matrix9d correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  correlation.diagonal().array() += kRounding;
  const Matrix9d unscaled = sigma.asDiagonal() * correlation * sigma.asDiagonal();
  const double largest = covariance.cwiseAbs().maxCoeff();
  if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() >= 0.0) ||
      !((covariance - covariance.transpose()).cwiseAbs().maxCoeff() <= kRounding * largest) ||
      !((covariance - unscaled).cwiseAbs().maxCoeff() <= 2.0 * kRounding * largest) ||
      correlation.selfadjointView<Eigen::Lower>().llt().info() != Eigen::Success)
    return fail(ErrorCode::invalid, "its covariance is none");
  return {};
}

}  // namespace

Status check_visual(const Submap& submap) {
  const VisualPayload& visual = *submap.visual;
  if (auto ok = check_counts_of(visual); !ok) return ok;
  for (const Camera& camera : visual.cameras)
    if (auto ok = check_calibration(camera); !ok) return in_context("camera", ok.error());
  if (auto ok = check_frames(submap); !ok) return ok;
  for (std::size_t i = 0; i < visual.landmarks.size(); ++i)
    if (auto ok = check_landmark(visual.landmarks[i]); !ok)
      return in_context("landmark " + std::to_string(i), ok.error());
  for (std::size_t i = 0; i < visual.imu.size(); ++i) {
    const ImuPreintegration& imu = visual.imu[i];
    if (imu.from_keyframe < submap.keyframes.front().index || imu.from_keyframe >= submap.keyframes.back().index ||
        (i > 0 && imu.from_keyframe <= visual.imu[i - 1].from_keyframe))
      return fail(ErrorCode::invalid, "IMU from keyframe {} to the next, expected increasing ones of {} to {}",
                  imu.from_keyframe, submap.keyframes.front().index, submap.keyframes.back().index);
    if (auto ok = check_imu(imu); !ok)
      return in_context("IMU from keyframe " + std::to_string(imu.from_keyframe), ok.error());
  }
  return {};
}

}  // namespace tutti::wire
