// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "tutti/drive/driver.hpp"
#include "tutti/model/sensors.hpp"
#include "tutti/perception/visual/frontend/image_tracker.hpp"

namespace tutti::program {

/// Decodes the images that a robot is fed, and tracks points through them.
class FedCamera {
 public:
  explicit FedCamera(const visual::TrackerConfig& config) : config_(config) {}

  /// Driver::Track of these images, of which raw ones must have their camera's size (check_images()).
  drive::Driver::Seen see(const EncodedImages& images, bool keyframe);

 private:
  visual::TrackerConfig config_;
  std::shared_ptr<const Sensors> sensors_;         // for which the tracker was made
  std::unique_ptr<visual::ImageTracker> tracker_;  // null: these sensors allow none
};

}  // namespace tutti::program
