// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tutti/model/image.hpp"
#include "tutti/perception/visual/frontend/internal/spread.hpp"

namespace tutti::visual::internal {

/// OpenCV works in the threads that call it, and starts none. Set once and for all: with TBB below it,
/// cv::setNumThreads() from two threads at a time crashes.
void keep_opencv_to_one_thread();

struct FlowRule {
  int window_px = 21;
  int levels = 3;             ///< Halvings of the image.
  double agreement_px = 0.7;  ///< There and back again.
};

/// An image and its halvings with their gradients, as optical flow needs them.
class Pyramid {
 public:
  Pyramid(const Image& image, const FlowRule& rule);
  struct Levels;
  [[nodiscard]] const Levels& levels() const { return *levels_; }
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  int width_px_, height_px_;
  std::shared_ptr<const Levels> levels_;
};

/// Where points of one image are in another: pyramidal Lucas-Kanade (Bouguet 2001), begun at `guesses`, one per point,
/// and followed back; nothing where it does not come back, or leaves the image.
std::vector<std::optional<Eigen::Vector2f>> follow(const Pyramid& from, const Pyramid& to,
                                                   std::span<const Eigen::Vector2f> points,
                                                   std::span<const Eigen::Vector2f> guesses, const FlowRule& rule);

/// Corners of an image (FAST, Rosten and Drummond 2006) with how much they stand out; none within `border_px` of its
/// edge.
std::vector<Candidate> find_corners(const Image& image, int threshold, int border_px);

}  // namespace tutti::visual::internal
