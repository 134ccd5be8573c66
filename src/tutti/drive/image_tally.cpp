// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/image_tally.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tutti::drive {
namespace {

std::size_t followed(const TrackedImage& image) {
  return static_cast<std::size_t>(
      std::ranges::count_if(image.keypoints, [](const TrackedKeypoint& it) { return it.track != 0; }));
}

}  // namespace

std::optional<std::string> ImageTally::add(Timestamp keyframe, const std::vector<TrackedImage>& images) {
  if (keyframes_++ == 0) first_ = last_seen_ = keyframe;
  if (const double gap_s = keyframe - last_seen_; gap_s > longest_s_) {
    longest_s_ = gap_s;
    longest_from_ = last_seen_;
  }
  if (!images.empty()) {
    last_seen_ = keyframe;
    stopped_ = false;
    poor_ += followed(images.front()) < kFewPoints ? 1 : 0;
    return std::nullopt;
  }
  ++without_;
  if (stopped_ || keyframe - last_seen_ <= kSilence_s) return std::nullopt;
  stopped_ = true;
  return fmt::format("the camera gives no images since {:.1f} s after the start, for {:.1f} s now", last_seen_ - first_,
                     keyframe - last_seen_);
}

std::vector<std::string> ImageTally::notes() const {
  std::vector<std::string> out;
  if (without_ > 0)
    out.push_back(
        fmt::format("no image at {} of {} keyframes; the longest gap is {:.1f} s, from {:.1f} s after the "
                    "start on",
                    without_, keyframes_, longest_s_, longest_from_ - first_));
  if (poor_ > 0)
    out.push_back(
        fmt::format("{} of {} keyframes show fewer than {} points that can be followed: no texture, blur or "
                    "a wrong exposure",
                    poor_, keyframes_, kFewPoints));
  return out;
}

}  // namespace tutti::drive
