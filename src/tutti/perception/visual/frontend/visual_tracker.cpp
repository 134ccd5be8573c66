// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/visual_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/perception/visual/clock_check.hpp"
#include "tutti/perception/visual/frontend/internal/optical_flow.hpp"
#include "tutti/perception/visual/frontend/internal/spread.hpp"

namespace tutti::visual {
namespace {

std::vector<Eigen::Vector2f> pixels_of(std::span<const TrackedKeypoint> keypoints) {
  std::vector<Eigen::Vector2f> out;
  out.reserve(keypoints.size());
  for (const TrackedKeypoint& it : keypoints) out.push_back(it.pixel);
  return out;
}

internal::FlowRule flow_rule(const TrackerConfig& config) {
  return {.window_px = config.window_px, .levels = config.levels, .agreement_px = config.agreement_px};
}

}  // namespace

Status check_sizes(std::span<const Image> images, std::span<const Camera> cameras) {
  if (images.size() != cameras.size())
    return fail(ErrorCode::invalid, "{} images of {} cameras", images.size(), cameras.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraModel& model = cameras[i].model;
    if (images[i].empty() || (images[i].width_px == model.width_px && images[i].height_px == model.height_px)) continue;
    return fail(ErrorCode::invalid, "an image of {} x {} pixels, camera {} has {} x {}", images[i].width_px,
                images[i].height_px, i, model.width_px, model.height_px);
  }
  return {};
}

VisualTracker::VisualTracker(std::vector<Camera> cameras, const TrackerConfig& config)
    : cameras_(std::move(cameras)), config_(config) {
  TUTTI_CHECK(cameras_.size() == 1 || cameras_.size() == 2, "{} cameras, expected one or two", cameras_.size());
  for (const Camera& camera : cameras_) {
    const Status ok = check_camera(camera.model);
    TUTTI_CHECK(ok.has_value(), "{}", ok.error().message);
  }
}

std::vector<TrackedImage> VisualTracker::track(std::span<const Image> images, bool keyframe) {
  const Status sizes = check_sizes(images, cameras_);
  TUTTI_CHECK(sizes.has_value(), "{}", sizes.error().message);
  if (images[0].empty()) return {};
  auto first = std::make_shared<const internal::Pyramid>(images[0], flow_rule(config_));
  tracks_ = follow_from_last(*first);
  add_corners(images[0], tracks_);

  std::vector<TrackedImage> out(1);
  out[0].keypoints = tracks_;
  if (keyframe) out[0] = describe_image(images[0], config_.descriptors, tracks_);
  if (cameras_.size() == 2 && !images[1].empty()) {
    for (TrackedKeypoint& it : out[0].keypoints)
      if (it.track == 0) it.track = next_track_++;
    TrackedImage second;
    second.keypoints = seen_by_second(*first, internal::Pyramid(images[1], flow_rule(config_)), out[0].keypoints);
    if (keyframe) {
      DescriptorConfig these = config_.descriptors;
      these.keypoints = 0;  // beside those that there are
      second = describe_image(images[1], these, second.keypoints);
    }
    second.camera = 1;
    out.push_back(std::move(second));
  }
  last_ = std::move(first);
  return out;
}

void VisualTracker::restart(std::uint64_t first_track) {
  last_.reset();
  tracks_.clear();
  motion_px_.clear();
  next_track_ = std::max(next_track_, first_track);
}

std::vector<TrackedKeypoint> VisualTracker::follow_from_last(const internal::Pyramid& now) {
  std::vector<TrackedKeypoint> out;
  std::vector<Eigen::Vector2f> motion;
  if (last_) {
    const std::vector<Eigen::Vector2f> pixels = pixels_of(tracks_);
    std::vector<Eigen::Vector2f> guesses(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) guesses[i] = pixels[i] + motion_px_[i];
    const auto found = internal::follow(*last_, now, pixels, guesses, flow_rule(config_));
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!found[i]) continue;
      out.push_back({.pixel = *found[i], .sigma_px = tracks_[i].sigma_px, .track = tracks_[i].track});
      motion.push_back(*found[i] - pixels[i]);
    }
  }
  motion_px_ = std::move(motion);
  return out;
}

void VisualTracker::add_corners(const Image& image, std::vector<TrackedKeypoint>& keypoints) {
  const auto wanted = static_cast<std::size_t>(config_.features);
  if (static_cast<double>(keypoints.size()) >= config_.enough_share * config_.features) return;
  const auto corners = internal::find_corners(image, config_.threshold, config_.window_px / 2);
  const internal::SpreadRule rule{.width_px = image.width_px,
                                  .height_px = image.height_px,
                                  .cell_px = config_.cell_px,
                                  .distance_px = config_.distance_px,
                                  .most = wanted - keypoints.size()};
  for (const std::size_t i : internal::spread(corners, pixels_of(keypoints), rule))
    keypoints.push_back(
        {.pixel = corners[i].pixel, .sigma_px = static_cast<float>(config_.sigma_px), .track = next_track_++});
  motion_px_.resize(keypoints.size(), Eigen::Vector2f::Zero());
}

std::vector<TrackedKeypoint> VisualTracker::seen_by_second(const internal::Pyramid& first,
                                                           const internal::Pyramid& second,
                                                           std::span<const TrackedKeypoint> keypoints) const {
  const Pose3 T_first_second = cameras_[0].T_body_camera.inverse() * cameras_[1].T_body_camera;
  // Where it would be if it were far away.
  std::vector<std::size_t> which;
  std::vector<Eigen::Vector3d> rays;
  std::vector<Eigen::Vector2f> pixels, guesses;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const auto ray = unproject(cameras_[0].model, keypoints[i].pixel.cast<double>());
    if (!ray) continue;
    const auto guess = project(cameras_[1].model, T_first_second.rotation.conjugate() * *ray);
    if (!guess) continue;
    which.push_back(i);
    rays.push_back(*ray);
    pixels.push_back(keypoints[i].pixel);
    guesses.push_back(guess->cast<float>());
  }
  std::vector<TrackedKeypoint> out;
  const auto found = internal::follow(first, second, pixels, guesses, flow_rule(config_));
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!found[k]) continue;
    const auto ray = unproject(cameras_[1].model, found[k]->cast<double>());
    if (!ray || epipolar_error_rad(T_first_second, rays[k], *ray) * cameras_[1].model.fx > config_.epipolar_px)
      continue;
    const TrackedKeypoint& it = keypoints[which[k]];
    out.push_back({.pixel = *found[k], .sigma_px = it.sigma_px, .track = it.track});
  }
  return out;
}

}  // namespace tutti::visual
