// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/perception/visual/clock_check.hpp"
#include "tutti/perception/visual/frontend/image_tracker.hpp"

namespace tutti::visual {

struct TrackingConfig {
  TrackerConfig tracker;
  double max_stamp_difference_s = 0.005;
  std::string turned_stereo = "one_camera";
  template <class V>
  void describe(V& v) {
    v.field("tracker", tracker, any(), "What is followed from image to image.");
    v.field("max_stamp_difference_s", max_stamp_difference_s, between(0.0, 1.0),
            "An odometry sample and an image of one moment are at most this far apart.");
    v.field("turned_stereo", turned_stereo, one_of({"one_camera", "correct", "believe"}),
            "Where what two cameras see at once says that they are turned against each other otherwise than their "
            "calibration has it: the second one is not used, is turned by as much, or nothing is done.");
  }
};

/// Follows points through all images of a recorded stream and returns those of the odometry's samples. Samples are
/// asked for one after the other; after a jump forward (a restart) tracks begin anew, and a sample that is asked for
/// again has no images. take_errors() also reports, once, images that are not stamped by the odometry's clock, a
/// camera turned about its optical axis (ClockCheck), or a second camera turned against the first (StereoCheck).
class TrackingSource : public VisualSource {
 public:
  /// Fails when the stream's stamps do not match those of the odometry. The error states by how much they differ, by
  /// the motion in the images where it shows; stamps alone know the offset only up to multiples of the time between
  /// images. Fails also as ImageTracker::make() does.
  static Result<std::shared_ptr<TrackingSource>> open(ImageStream stream, Trajectory odometry,
                                                      const TrackingConfig& config);

  [[nodiscard]] TrackedImages images(std::size_t sample, bool keyframe) override;
  std::vector<Error> take_errors() override { return std::exchange(errors_, {}); }

 private:
  TrackingSource(ImageStream stream, Trajectory odometry, const TrackingConfig& config,
                 std::unique_ptr<ImageTracker> tracker);
  void check_clock();
  [[nodiscard]] std::vector<TrackedImage> track(std::size_t instant, bool keyframe);

  ImageStream stream_;
  Trajectory odometry_;
  TrackingConfig config_;
  std::unique_ptr<ImageTracker> tracker_;
  ClockCheck clock_;
  bool clock_checked_ = false;
  std::size_t next_instant_ = 0, next_sample_ = 0;
  std::vector<Error> errors_;
};

}  // namespace tutti::visual
