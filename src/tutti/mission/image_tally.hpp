// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::mission {

/// What a robot's cameras showed at its keyframes: whether they went on, and whether there was anything to see.
class ImageTally {
 public:
  static constexpr double kSilence_s = 5.0;      ///< Without an image for longer: the camera has stopped.
  static constexpr std::size_t kFewPoints = 20;  ///< Fewer are followed: there is nothing to make landmarks of.

  /// The images of a keyframe, or none, by increasing stamps. Says so when the camera has stopped, once for every stop.
  std::optional<std::string> add(Timestamp keyframe, const std::vector<TrackedImage>& images);
  /// What is amiss, one line each.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  std::size_t keyframes_ = 0, without_ = 0, poor_ = 0;
  Timestamp first_, last_seen_;  // keyframes; the first one counts as seen
  Timestamp longest_from_;
  double longest_s_ = 0.0;
  bool stopped_ = true;  // or has not begun
};

}  // namespace tutti::mission
