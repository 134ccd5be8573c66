// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/describe_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/visual/frontend/internal/optical_flow.hpp"
#include "tutti/perception/visual/frontend/internal/spread.hpp"

namespace tutti::visual {
namespace {

constexpr int kSmallest_px = 64;  ///< No scales are left of smaller images.
constexpr int kMargin_px = 80;    ///< Mirrored round the image: more than any pattern reaches.

/// Detector and descriptor of one kind. Their patterns take longer to compute than an image: one of each a thread.
struct Method {
  cv::Ptr<cv::Feature2D> algorithm;
  DescriptorKind kind = DescriptorKind::none;
  float size_px = 0.0F;  ///< Diameter of a keypoint of the finest scale.
};

Method brisk(const DescriptorConfig& config) {
  constexpr int kOctaves = 3;
  static thread_local const cv::Ptr<cv::BRISK> algorithm = cv::BRISK::create(config.threshold, kOctaves);
  algorithm->setThreshold(config.threshold);
  return {algorithm, DescriptorKind::brisk, 12.0F};
}

Method orb(const DescriptorConfig& config) {
  static thread_local const cv::Ptr<cv::ORB> algorithm = cv::ORB::create();
  constexpr int kSurplus = 4;  // before they are spread
  algorithm->setMaxFeatures(kSurplus * config.keypoints);
  algorithm->setFastThreshold(config.threshold);
  return {algorithm, DescriptorKind::orb, 31.0F};
}

/// The direction to the intensity centroid of a patch (Rosin 1999), degrees: what ORB turns its pattern by.
float centroid_angle_deg(const cv::Mat& grey, const cv::Point2f& at) {
  constexpr int kRadius_px = 15;
  const int column = cvRound(at.x), row = cvRound(at.y);
  double moment_x = 0.0, moment_y = 0.0;
  for (int y = -kRadius_px; y <= kRadius_px; ++y)
    for (int x = -kRadius_px; x <= kRadius_px; ++x) {
      if (x * x + y * y > kRadius_px * kRadius_px) continue;
      const double value = grey.at<std::uint8_t>(row + y, column + x);
      moment_x += x * value;
      moment_y += y * value;
    }
  const double angle = std::atan2(moment_y, moment_x) / kRadPerDeg;
  return static_cast<float>(angle < 0.0 ? angle + 360.0 : angle);
}

/// The tracked keypoints, then the detected ones, in the image with its margin.
std::vector<cv::KeyPoint> find_keypoints(const Method& method, const cv::Mat& grey, const cv::Mat& with_margin,
                                         const DescriptorConfig& config, std::span<const TrackedKeypoint> tracked) {
  const auto most = static_cast<std::size_t>(config.keypoints);
  std::vector<cv::KeyPoint> detected;
  if (tracked.size() < most) method.algorithm->detect(grey, detected);
  std::vector<internal::Candidate> candidates;
  for (const cv::KeyPoint& keypoint : detected)
    candidates.push_back({{keypoint.pt.x, keypoint.pt.y}, keypoint.response});
  std::vector<Eigen::Vector2f> taken;
  for (const TrackedKeypoint& keypoint : tracked) taken.push_back(keypoint.pixel);
  const internal::SpreadRule rule{.width_px = grey.cols,
                                  .height_px = grey.rows,
                                  .cell_px = config.cell_px,
                                  .distance_px = config.distance_px,
                                  .most = most - std::min(most, tracked.size())};

  std::vector<cv::KeyPoint> keypoints;
  for (const Eigen::Vector2f& pixel : taken) keypoints.emplace_back(pixel.x(), pixel.y(), method.size_px);
  for (const std::size_t i : internal::spread(candidates, taken, rule)) keypoints.push_back(detected[i]);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    keypoints[i].pt += cv::Point2f(kMargin_px, kMargin_px);
    keypoints[i].class_id = static_cast<int>(i);
    if (method.kind == DescriptorKind::orb && i < tracked.size())
      keypoints[i].angle = centroid_angle_deg(with_margin, keypoints[i].pt);
  }
  return keypoints;
}

Descriptors packed(const cv::Mat& rows, DescriptorKind kind) {
  Descriptors out{.kind = kind, .words = static_cast<std::uint32_t>(rows.cols) / 8, .bits = {}};
  out.bits.resize(static_cast<std::size_t>(rows.rows) * out.words);
  for (int i = 0; i < rows.rows; ++i)
    std::memcpy(out.bits.data() + static_cast<std::size_t>(i) * out.words, rows.ptr(i),
                static_cast<std::size_t>(rows.cols));
  return out;
}

}  // namespace

TrackedImage describe_image(const Image& image, const DescriptorConfig& config,
                            std::span<const TrackedKeypoint> tracked) {
  if (std::min(image.width_px, image.height_px) < kSmallest_px) return {};
  internal::keep_opencv_to_one_thread();
  const Method method = config.kind == "orb" ? orb(config) : brisk(config);
  // OpenCV only reads from it.
  const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.grey.data()));
  cv::Mat with_margin;
  cv::copyMakeBorder(grey, with_margin, kMargin_px, kMargin_px, kMargin_px, kMargin_px, cv::BORDER_REFLECT_101);
  std::vector<cv::KeyPoint> keypoints = find_keypoints(method, grey, with_margin, config, tracked);
  TrackedImage out;
  if (keypoints.empty()) return out;
  const std::size_t wanted = keypoints.size();
  cv::Mat rows;
  method.algorithm->compute(with_margin, keypoints, rows);
  // Whatever it reordered; nothing is left out, because the margin is wider than any pattern.
  TUTTI_CHECK(keypoints.size() == wanted, "{} of {} keypoints were described", keypoints.size(), wanted);
  out.keypoints.resize(wanted);
  cv::Mat ordered(rows.size(), rows.type());
  for (std::size_t row = 0; row < keypoints.size(); ++row) {
    const cv::KeyPoint& keypoint = keypoints[row];
    const auto i = static_cast<std::size_t>(keypoint.class_id);
    rows.row(static_cast<int>(row)).copyTo(ordered.row(keypoint.class_id));
    out.keypoints[i] = i < tracked.size()
                           ? tracked[i]
                           : TrackedKeypoint{.pixel = {keypoint.pt.x - kMargin_px, keypoint.pt.y - kMargin_px},
                                             .sigma_px = std::max(1.0F, keypoint.size / method.size_px)};
  }
  out.descriptors = packed(ordered, method.kind);
  return out;
}

}  // namespace tutti::visual
