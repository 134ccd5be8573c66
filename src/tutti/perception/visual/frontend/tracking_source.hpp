// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/perception/visual/frontend/visual_tracker.hpp"

namespace tutti::visual {

struct TrackingConfig {
  TrackerConfig tracker;
  double max_stamp_difference_s = 0.005;
  double keyframe_distance_m = 0.3;
  double keyframe_angle_deg = 15.0;
  double keyframe_time_s = 1.0;
  template <class V>
  void describe(V& v) {
    v.field("tracker", tracker, any(), "What is followed from image to image.");
    v.field("max_stamp_difference_s", max_stamp_difference_s, between(0.0, 1.0),
            "An odometry sample and an image of one moment are at most this far apart.");
    v.field("keyframe_distance_m", keyframe_distance_m, greater_than(0.0),
            "Images have descriptors after this much travel,");
    v.field("keyframe_angle_deg", keyframe_angle_deg, greater_than(0.0), "or this much rotation,");
    v.field("keyframe_time_s", keyframe_time_s, greater_than(0.0),
            "or this much time: what makes a keyframe of a submap.");
  }
};

/// Follows points through all images of a stream and serves those of the odometry's samples. Images have descriptors
/// where SubmapBuilder (robot/submap_builder.hpp), given the same limits, makes a keyframe. Samples are asked for in
/// increasing order; one asked for again, or late, has no images.
class TrackingSource : public VisualSource {
 public:
  /// Fails when the stream's stamps are not those of the odometry, saying by how much they differ.
  static Result<std::shared_ptr<TrackingSource>> open(ImageStream stream, Trajectory odometry,
                                                      const TrackingConfig& config);

  [[nodiscard]] Result<TrackedImages> images(std::size_t sample) override;

  /// Every image that could not be read so far; those between samples, and of a second camera, too.
  [[nodiscard]] const std::vector<Error>& unreadable() const { return unreadable_; }

 private:
  TrackingSource(ImageStream stream, Trajectory odometry, const TrackingConfig& config);
  /// Follows the tracks to the next sample.
  [[nodiscard]] Result<std::vector<TrackedImage>> advance(const StampedPose& sample);
  [[nodiscard]] Result<std::vector<TrackedImage>> track(std::size_t moment, bool keyframe);
  [[nodiscard]] bool is_keyframe(const StampedPose& sample);

  ImageStream stream_;
  std::shared_ptr<const std::vector<Camera>> cameras_;
  Trajectory odometry_;
  TrackingConfig config_;
  VisualTracker tracker_;
  std::size_t next_moment_ = 0, next_sample_ = 0;
  std::optional<StampedPose> last_keyframe_;
  std::vector<Error> unreadable_;
};

}  // namespace tutti::visual
