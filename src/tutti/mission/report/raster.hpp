// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "tutti/formats/ply.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/mission/report/png.hpp"
#include "tutti/model/point_cloud.hpp"

/// Draws clouds of millions of points, which are too many for SVG.
namespace tutti::mission {

/// A cloud to be drawn; does not own it.
struct CloudLayer {
  const PointCloud* cloud = nullptr;
  Pose3 T_display_cloud;
  formats::Rgb colour;
  /// If set, points have the colours of distance_colour() instead; one per point.
  const std::vector<float>* distance_m = nullptr;
};

/// Maps a point of the display frame to pixels (y down); nothing when it is not shown.
using Projection = std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)>;

/// Each pixel has the mean colour of its points, and is brighter with the logarithm of their number.
class PointRaster {
 public:
  PointRaster(std::size_t width, std::size_t height);
  /// Draws every point as a square of `point_px` pixels.
  void add(const CloudLayer& layer, const Projection& project, int point_px);
  /// The image on a dark ground, for pictures that stand alone.
  [[nodiscard]] RgbaImage on_dark() const;
  /// The points only, more opaque where there are many, to lie under other shapes.
  [[nodiscard]] RgbaImage transparent() const;

 private:
  struct Pixel {
    float red = 0.0F, green = 0.0F, blue = 0.0F, count = 0.0F;
  };
  [[nodiscard]] RgbaImage shaded(bool opaque) const;
  std::size_t width_;
  std::size_t height_;
  std::vector<Pixel> pixels_;
};

inline constexpr double kWorstShown_m = 0.5;  ///< From this distance on the colour is the same.
/// From blue (0) to red (kWorstShown_m and more).
formats::Rgb distance_colour(double distance_m);

}  // namespace tutti::mission
