// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tutti/perception/visual/frontend/image_tracker.hpp"
#include "tutti/program/feed/feed_sensors.hpp"

namespace tutti::program {

/// The eyes of a robot that is fed: images as they come, decoded, and points followed through them.
class FedCamera {
 public:
  explicit FedCamera(const visual::TrackerConfig& config) : config_(config) {}

  /// Images after those before, whose raw ones have their camera's size (check_images()); at a keyframe they are
  /// described. None where there is nothing to see; take_errors() says why.
  TrackedImages see(const FedImages& images, bool keyframe);
  /// Told once.
  std::vector<Error> take_errors() { return std::exchange(errors_, {}); }

 private:
  visual::TrackerConfig config_;
  std::shared_ptr<const FeedSensors> sensors_;     // by which the tracker is made
  std::unique_ptr<visual::ImageTracker> tracker_;  // null: of these there can be none
  std::vector<Error> errors_;
};

}  // namespace tutti::program
