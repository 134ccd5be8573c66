// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/image_tracker.hpp"

#include <utility>

namespace tutti::visual {
namespace {

/// An image begins fewer tracks than 2 to this: after a restart their numbers are new.
constexpr unsigned kNumberBits = 16;

/// With depth, the camera by which its views are.
std::vector<Camera> with_depth(std::vector<Camera> cameras, const std::optional<DepthSensor>& depth,
                               const TrackerConfig& config) {
  if (depth) cameras.push_back(depth_camera(cameras.front(), *depth, config.sigma_px));
  return cameras;
}

}  // namespace

Result<std::unique_ptr<ImageTracker>> ImageTracker::make(std::vector<Camera> cameras, std::optional<DepthSensor> depth,
                                                         const TrackerConfig& config) {
  if (cameras.empty() || cameras.size() > 2)
    return fail(ErrorCode::unsupported, "{} cameras, expected one or two", cameras.size());
  if (depth && cameras.size() != 1)
    return fail(ErrorCode::unsupported, "{} cameras with depth, expected one", cameras.size());
  for (const Camera& camera : cameras)
    if (auto ok = check_camera(camera.model); !ok) return tl::unexpected(ok.error());
  return std::unique_ptr<ImageTracker>(new ImageTracker(std::move(cameras), depth, config));
}

ImageTracker::ImageTracker(std::vector<Camera> cameras, std::optional<DepthSensor> depth, const TrackerConfig& config)
    : of_images_(std::move(cameras)),
      depth_(depth),
      cameras_(std::make_shared<const std::vector<Camera>>(with_depth(of_images_, depth, config))),
      tracker_(of_images_, config) {}

void ImageTracker::restart(std::uint64_t instant) { tracker_.restart((instant << kNumberBits) + 1); }

std::vector<TrackedImage> ImageTracker::track(const SeenImages& seen, bool keyframe) {
  std::vector<Image> images;
  for (std::size_t camera = 0; camera < of_images_.size(); ++camera) {
    Result<Image> image = camera < seen.images.size() ? seen.images[camera] : Image();
    if (image)
      if (const auto ok = check_sizes({&*image, 1}, {&of_images_[camera], 1}); !ok)
        image = in_context(fmt::format("camera {} at {} ns", camera, seen.stamp.ns), ok.error());
    if (!image) errors_.push_back(image.error());
    if (!image && camera == 0) return {};
    images.push_back(image ? *std::move(image) : Image());
  }
  auto tracked = tracker_.track(images, keyframe);
  if (keyframe && depth_ && seen.load_depth && !tracked.empty()) add_depth(seen, tracked);
  return tracked;
}

void ImageTracker::add_depth(const SeenImages& seen, std::vector<TrackedImage>& tracked) {
  constexpr std::uint64_t kOfOneImage = std::uint64_t{1} << 62U;  // numbers of tracks to which no tracker counts
  auto depth = seen.load_depth();
  if (depth && depth->empty()) return;
  if (depth)
    if (const auto ok = check_depth_size(*depth, of_images_.front()); !ok)
      depth = in_context(fmt::format("depth at {} ns", seen.stamp.ns), ok.error());
  if (!depth) {
    errors_.push_back(depth.error());
    return;
  }
  if (auto amiss = depth_watch_.add(*depth, *depth_)) errors_.push_back({ErrorCode::invalid, *std::move(amiss)});
  tracked.push_back(view_by_depth(tracked.front(), *depth, *depth_, of_images_.front(), cameras_->at(1),
                                  kOfOneImage + (seen.instant << kNumberBits)));
}

}  // namespace tutti::visual
