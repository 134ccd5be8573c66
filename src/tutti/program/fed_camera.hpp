// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tutti/model/sensors.hpp"
#include "tutti/perception/visual/frontend/image_tracker.hpp"

namespace tutti::program {

/// Decodes the images that a robot is fed, and tracks points through them.
class FedCamera {
 public:
  explicit FedCamera(const visual::TrackerConfig& config) : config_(config) {}

  /// Tracks points in the next images, of which raw ones must have their camera's size (check_images()); at a
  /// keyframe descriptors are computed. Empty when there is nothing to track; take_errors() has the reason.
  TrackedImages see(const EncodedImages& images, bool keyframe);
  /// The errors since the last call.
  std::vector<Error> take_errors() { return std::exchange(errors_, {}); }

 private:
  visual::TrackerConfig config_;
  std::shared_ptr<const Sensors> sensors_;         // for which the tracker was made
  std::unique_ptr<visual::ImageTracker> tracker_;  // null: these sensors allow none
  std::vector<Error> errors_;
};

}  // namespace tutti::program
