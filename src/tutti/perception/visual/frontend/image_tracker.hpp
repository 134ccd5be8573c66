// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/perception/visual/depth_view.hpp"
#include "tutti/perception/visual/frontend/visual_tracker.hpp"

namespace tutti::visual {

/// The images of a robot's cameras at one time.
struct SeenImages {
  Timestamp stamp;
  std::uint64_t instant = 0;          ///< Larger than that of all images before; track numbers are derived from it.
  std::vector<Result<Image>> images;  ///< One per camera; an empty image is a missing one.
  std::function<Result<DepthImage>()> load_depth = {};  ///< Called at keyframes; empty without depth.
};

/// Follows points through the images of a robot, live or recorded, one time after the other.
class ImageTracker {
 public:
  /// One or two cameras, or one with depth, that check_camera() accepts. Errors: other cameras, or a program built
  /// without OpenCV.
  static Result<std::unique_ptr<ImageTracker>> make(std::vector<Camera> cameras, std::optional<DepthSensor> depth,
                                                    const TrackerConfig& config);
  /// VisualTracker::track(), and at a keyframe the view by depth (view_by_depth()). Each image that cannot be read or
  /// has another size adds an error to take_errors(); without the first camera's image nothing is returned.
  std::vector<TrackedImage> track(const SeenImages& seen, bool keyframe);
  /// Forgets all tracks. The next images are of `instant`, and new tracks have other numbers than all before.
  void restart(std::uint64_t instant);
  /// The cameras that returned images refer to: those of make(), and with depth the virtual one (depth_camera()).
  [[nodiscard]] const std::shared_ptr<const std::vector<Camera>>& cameras() const { return cameras_; }
  /// Errors since the last call.
  std::vector<Error> take_errors() { return std::exchange(errors_, {}); }

 private:
  ImageTracker(std::vector<Camera> cameras, std::optional<DepthSensor> depth, const TrackerConfig& config);
  void add_depth(const SeenImages& seen, std::vector<TrackedImage>& tracked);

  std::vector<Camera> of_images_;
  std::optional<DepthSensor> depth_;
  std::shared_ptr<const std::vector<Camera>> cameras_;
  VisualTracker tracker_;
  DepthWatch depth_watch_;
  std::vector<Error> errors_;
};

}  // namespace tutti::visual
