// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::drive {

/// Watches whether a robot's cameras keep delivering images at its keyframes, and whether these show enough.
class ImageTally {
 public:
  static constexpr double kSilence_s = 5.0;      ///< A camera has stopped when it gives no image for longer.
  static constexpr std::size_t kFewPoints = 20;  ///< With fewer tracked points no landmarks can be made.

  /// Adds the images at a keyframe (possibly none); keyframes by increasing stamps. Returns a message when the camera
  /// has stopped, once per stop.
  std::optional<std::string> add(Timestamp keyframe, const std::vector<TrackedImage>& images);
  /// The faults so far, one line each.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  std::size_t keyframes_ = 0, without_ = 0, poor_ = 0;
  Timestamp first_, last_seen_;  // stamps of keyframes; the first one counts as seen
  Timestamp longest_from_;
  double longest_s_ = 0.0;
  bool stopped_ = true;  // or has not begun
};

}  // namespace tutti::drive
