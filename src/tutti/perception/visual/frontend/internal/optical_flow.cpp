// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/internal/optical_flow.hpp"

#include <algorithm>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>

#include "tutti/base/check.hpp"

namespace tutti::visual::internal {

struct Pyramid::Levels {
  std::vector<cv::Mat> images;  ///< And gradients, alternately.
};

namespace {

/// Not copied: OpenCV only reads from it.
cv::Mat view(const Image& image) {
  return {image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.grey.data())};
}

struct Flow {
  std::vector<cv::Point2f> points;
  std::vector<std::uint8_t> found;
};

/// In one direction, from the `levels`th halving on.
Flow flow(const Pyramid& from, const Pyramid& to, const std::vector<cv::Point2f>& points,
          std::vector<cv::Point2f> guess, int window_px, int levels) {
  constexpr int kIterations = 12;
  constexpr double kStep_px = 0.03, kLeastEigenvalue = 1e-4;
  Flow out{.points = std::move(guess), .found = {}};
  cv::calcOpticalFlowPyrLK(from.levels().images, to.levels().images, points, out.points, out.found, cv::noArray(),
                           cv::Size(window_px, window_px), levels,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, kIterations, kStep_px),
                           cv::OPTFLOW_USE_INITIAL_FLOW, kLeastEigenvalue);
  return out;
}

std::vector<cv::Point2f> to_opencv(std::span<const Eigen::Vector2f> points) {
  std::vector<cv::Point2f> out;
  out.reserve(points.size());
  for (const Eigen::Vector2f& p : points) out.emplace_back(p.x(), p.y());
  return out;
}

}  // namespace

void keep_opencv_to_one_thread() {
  [[maybe_unused]] static const bool is_set = [] {
    cv::setNumThreads(1);
    return true;
  }();
}

Pyramid::Pyramid(const Image& image, const FlowRule& rule) : width_px_(image.width_px), height_px_(image.height_px) {
  TUTTI_CHECK(!image.empty());
  keep_opencv_to_one_thread();
  auto levels = std::make_shared<Levels>();
  cv::buildOpticalFlowPyramid(view(image), levels->images, cv::Size(rule.window_px, rule.window_px), rule.levels, true,
                              cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
  levels_ = std::move(levels);
}

std::vector<std::optional<Eigen::Vector2f>> follow(const Pyramid& from, const Pyramid& to,
                                                   std::span<const Eigen::Vector2f> points,
                                                   std::span<const Eigen::Vector2f> guesses, const FlowRule& rule) {
  TUTTI_CHECK(guesses.size() == points.size(), "{} guesses for {} points", guesses.size(), points.size());
  std::vector<std::optional<Eigen::Vector2f>> out(points.size());
  if (points.empty()) return out;
  const std::vector<cv::Point2f> begin = to_opencv(points);
  const Flow there = flow(from, to, begin, to_opencv(guesses), rule.window_px, rule.levels);
  // Only what was found is followed back: that is half of the work.
  std::vector<std::size_t> which;
  std::vector<cv::Point2f> end, home;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f& p = there.points[i];
    if (there.found[i] == 0 || p.x < 0.0F || p.y < 0.0F || p.x > static_cast<float>(to.width_px() - 1) ||
        p.y > static_cast<float>(to.height_px() - 1))
      continue;
    which.push_back(i);
    end.push_back(p);
    home.push_back(begin[i]);
  }
  if (which.empty()) return out;
  // From where it should end, so that the coarse levels have nothing to find.
  const Flow back = flow(to, from, end, home, rule.window_px, std::min(rule.levels, 1));
  for (std::size_t k = 0; k < which.size(); ++k)
    if (back.found[k] != 0 && cv::norm(back.points[k] - home[k]) <= rule.agreement_px)
      out[which[k]] = Eigen::Vector2f(end[k].x, end[k].y);
  return out;
}

std::vector<Candidate> find_corners(const Image& image, int threshold, int border_px) {
  keep_opencv_to_one_thread();
  std::vector<cv::KeyPoint> corners;
  if (image.width_px > 2 * border_px && image.height_px > 2 * border_px)
    cv::FAST(
        view(image)(cv::Rect(border_px, border_px, image.width_px - 2 * border_px, image.height_px - 2 * border_px)),
        corners, threshold, true);
  std::vector<Candidate> out;
  out.reserve(corners.size());
  const auto border = static_cast<float>(border_px);
  for (const cv::KeyPoint& it : corners) out.push_back({{it.pt.x + border, it.pt.y + border}, it.response});
  return out;
}

}  // namespace tutti::visual::internal
