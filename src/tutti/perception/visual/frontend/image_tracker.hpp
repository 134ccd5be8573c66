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

/// What a robot's cameras saw at one moment.
struct SeenImages {
  Timestamp stamp;
  std::uint64_t moment = 0;           ///< Larger than that of all images before; numbers of tracks are made of it.
  std::vector<Result<Image>> images;  ///< One per camera; an empty one is missing.
  std::function<Result<DepthImage>()> load_depth = {};  ///< Asked for at keyframes; not set: there is none.
};

/// Follows points through the images of a robot, one moment after the other: of a recording or as they come.
class ImageTracker {
 public:
  /// An error: not one or two cameras, or one with depth, that check_camera() accepts; or built without OpenCV.
  static Result<std::unique_ptr<ImageTracker>> make(std::vector<Camera> cameras, std::optional<DepthSensor> depth,
                                                    const TrackerConfig& config);
  /// VisualTracker::track(), and at a keyframe the view by depth (view_by_depth()). Images that cannot be read or are
  /// of another size are an error each; without the first camera's nothing is seen.
  std::vector<TrackedImage> track(const SeenImages& seen, bool keyframe);
  /// Forgets all tracks; the next images are of this moment, and new tracks have other numbers than those before.
  void restart(std::uint64_t moment);
  /// As images have them: those it was made with, and of depth the one by which its views are.
  [[nodiscard]] const std::shared_ptr<const std::vector<Camera>>& cameras() const { return cameras_; }
  /// Told once.
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
