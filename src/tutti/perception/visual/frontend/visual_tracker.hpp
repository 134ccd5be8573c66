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
  double enough_share = 0.9;  ///< New ones are looked for when fewer than this share of them is left.
  int threshold = 12;
  int cell_px = 40;      ///< New corners are spread evenly over cells of this size.
  int distance_px = 16;  ///< New corners are at least this far from any other.
  int window_px = 15;    ///< Side of the window by which a point is followed.
  int levels = 3;
  double agreement_px = 0.7;  ///< A point followed to the next image and back again comes back within this.
  double epipolar_px = 2.0;   ///< Stereo: the two views of a point lie within this of one plane with the two cameras.
  double sigma_px = 0.5;      ///< Standard deviation of a followed point, as it is passed on.
  DescriptorConfig descriptors;
  template <class V>
  void describe(V& v) {
    v.field("features", features, between(10, 5000), "Points followed at a time, in every image.");
    v.field("threshold", threshold, between(1, 255),
            "Grey values by which a new corner differs from what is round it.");
    v.field("levels", levels, between(0, 6), "How often the image is halved: how far a point may move at once.");
    v.field("descriptors", descriptors, any(), "Of keyframes.");
  }
};

/// Follows points from image to image of one camera, or of two that are exposed at one moment (the second sees what
/// the first one does). Images without texture, blurred or of the wrong exposure give fewer points or none; numbers of
/// tracks are never used again.
class VisualTracker {
 public:
  /// One or two cameras that check_camera() accepts.
  VisualTracker(std::vector<Camera> cameras, const TrackerConfig& config);

  /// The next images, one per camera in their order, each of its camera's size (check it before: check_sizes()). At a
  /// `keyframe` both have descriptors, and more keypoints: in the first camera those that describe_image() finds, in
  /// the second those of them that are seen there, under one number that no later image has. An empty image is one that
  /// is missing: without the second there is no second result, without the first none, and its points are looked for in
  /// the next one.
  std::vector<TrackedImage> track(std::span<const Image> images, bool keyframe);

  /// Forgets all tracks; new ones have at least this number.
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
  std::vector<TrackedKeypoint> tracks_;            ///< In the last image of the first camera,
  std::vector<Eigen::Vector2f> motion_px_;         ///< and how far each moved to get there.
  std::uint64_t next_track_ = 1;
};

/// Have the images the size of their cameras, and is there one for each? (Empty ones are missing.)
Status check_sizes(std::span<const Image> images, std::span<const Camera> cameras);

}  // namespace tutti::visual
