// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/visual.hpp"
#include "tutti/perception/visual/frontend/describe_image.hpp"

namespace tutti::visual {

namespace internal {
class Pyramid;
}

struct TrackerConfig {
  int features = 200;
  double enough_share = 0.9;  ///< New points are looked for when fewer than this share of `features` is left.
  int threshold = 12;         ///< Grey values by which a new corner differs from what is round it.
  int cell_px = 40;           ///< New corners are spread evenly over cells of this size.
  int distance_px = 16;       ///< New corners are at least this far from any other.
  int window_px = 15;         ///< Side of the window by which a point is followed.
  int levels = 3;             ///< How often the image is halved: how far a point may move at once.
  double agreement_px = 0.7;  ///< A point followed to the next image and back again must return within this distance.
  double epipolar_px = 2.0;   ///< Stereo: largest epipolar error of the two views of a point.
  double sigma_px = 0.5;      ///< Standard deviation that followed points are given.
  DescriptorConfig descriptors;
  template <class V>
  void describe(V& v) {
    v.field("features", features, between(10, 5000), "Points followed at a time, in every image.");
    v.field("descriptors", descriptors, any(), "How keyframes are described.");
  }
};

/// Follows points from image to image of one camera, or of two that are exposed at the same time, the second of which
/// sees the same points. Images that are without texture, blurred or wrongly exposed give fewer points or none. Track
/// numbers are never used again.
class VisualTracker {
 public:
  /// One or two cameras that check_camera() accepts.
  VisualTracker(std::vector<Camera> cameras, const TrackerConfig& config);

  /// Takes the next images, one per camera in their order, each of its camera's size (check_sizes(), else
  /// std::logic_error), and returns one result per image. At a `keyframe` the results have descriptors and more
  /// keypoints: in the first camera those that describe_image() finds, in the second those of them that it sees, too,
  /// under a track number that no later image has. An empty image is a missing one: without the second there is no
  /// second result, without the first there is none, and its points are looked for in the next image.
  std::vector<TrackedImage> track(std::span<const Image> images, bool keyframe);

  /// Forgets all tracks; new ones have numbers of at least `first_track`.
  void restart(std::uint64_t first_track);

 private:
  [[nodiscard]] std::vector<TrackedKeypoint> follow_from_last(const internal::Pyramid& now);
  void add_corners(const Image& image, std::vector<TrackedKeypoint>& keypoints);
  [[nodiscard]] std::vector<TrackedKeypoint> seen_by_second(const internal::Pyramid& first,
                                                            const internal::Pyramid& second,
                                                            std::span<const TrackedKeypoint> keypoints) const;

  std::vector<Camera> cameras_;
  TrackerConfig config_;
  std::shared_ptr<const internal::Pyramid> last_;  ///< Null before the first image.
  std::vector<TrackedKeypoint> tracks_;            ///< In the last image of the first camera.
  std::vector<Eigen::Vector2f> motion_px_;         ///< How far each track moved to get there.
  std::uint64_t next_track_ = 1;
};

/// Accepts one image per camera, each empty or of its camera's size; else ErrorCode::invalid.
Status check_sizes(std::span<const Image> images, std::span<const Camera> cameras);

}  // namespace tutti::visual
