// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tutti::mission {
namespace {

constexpr std::array<float, 3> kDark = {14.0F, 18.0F, 26.0F};

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 255.0F))); }

}  // namespace

PointRaster::PointRaster(std::size_t width, std::size_t height)
    : width_(width), height_(height), pixels_(width * height) {}

void PointRaster::add(const CloudLayer& layer, const Projection& project, int point_px) {
  const Eigen::Isometry3d T(layer.T_display_cloud.matrix());
  const double half = 0.5 * point_px;
  for (std::size_t i = 0; i < layer.cloud->points.size(); ++i) {
    const auto centre = project(T * layer.cloud->points[i].cast<double>());
    if (!centre || !centre->allFinite()) continue;
    const Eigen::Vector2d corner = (*centre).array() - half;
    if (!(corner.x() > -point_px && corner.y() > -point_px && corner.x() < static_cast<double>(width_) &&
          corner.y() < static_cast<double>(height_)))
      continue;
    const formats::Rgb colour = layer.distance_m != nullptr ? distance_colour((*layer.distance_m)[i]) : layer.colour;
    const auto left = static_cast<int>(std::lround(corner.x()));
    const auto top = static_cast<int>(std::lround(corner.y()));
    for (int y = std::max(top, 0); y < std::min(top + point_px, static_cast<int>(height_)); ++y)
      for (int x = std::max(left, 0); x < std::min(left + point_px, static_cast<int>(width_)); ++x) {
        Pixel& pixel = pixels_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
        pixel.red += colour.red;
        pixel.green += colour.green;
        pixel.blue += colour.blue;
        pixel.count += 1.0F;
      }
  }
}

RgbaImage PointRaster::on_dark() const { return shaded(true); }
RgbaImage PointRaster::transparent() const { return shaded(false); }

RgbaImage PointRaster::shaded(bool opaque) const {
  std::vector<float> counts;
  for (const Pixel& pixel : pixels_)
    if (pixel.count > 0.0F) counts.push_back(pixel.count);
  // The brightest 2 % look alike, and half of the light is there from the first point on.
  constexpr float kFirstPoint = 0.45F;
  constexpr float kShades = 6.0F;  // few shades make small files
  constexpr float kInkStep = 32.0F;
  float dense = 2.0F;
  if (!counts.empty()) {
    const auto nth = counts.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(counts.size() - 1));
    std::nth_element(counts.begin(), nth, counts.end());
    dense = std::max(dense, *nth);
  }
  RgbaImage image{width_, height_, {}};
  image.rgba.reserve(4 * pixels_.size());
  for (const Pixel& pixel : pixels_) {
    const float share_of_dense = std::min(1.0F, std::log(std::max(pixel.count, 1.0F)) / std::log(dense));
    const float strength =
        pixel.count > 0.0F ? kFirstPoint + (1.0F - kFirstPoint) * std::round(kShades * share_of_dense) / kShades : 0.0F;
    const float share = pixel.count > 0.0F ? 1.0F / pixel.count : 0.0F;
    std::array<float, 3> ink = {pixel.red * share, pixel.green * share, pixel.blue * share};
    for (float& c : ink) c = kInkStep * std::round(c / kInkStep);
    for (std::size_t c = 0; c < 3; ++c)
      image.rgba.push_back(to_byte(opaque ? kDark[c] + strength * (ink[c] - kDark[c]) : ink[c]));
    image.rgba.push_back(opaque ? 255 : to_byte(255.0F * strength));
  }
  return image;
}

formats::Rgb distance_colour(double distance_m) {
  static constexpr std::array<std::array<double, 3>, 5> kStops{
      {{72, 132, 214}, {92, 204, 190}, {240, 226, 96}, {250, 140, 60}, {240, 52, 76}}};
  if (!std::isfinite(distance_m)) return {110, 118, 130};
  const double s = std::clamp(distance_m / kWorstShown_m, 0.0, 1.0) * static_cast<double>(kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(s), kStops.size() - 2);
  const auto mix = [&](std::size_t c) {
    return static_cast<std::uint8_t>(
        std::lround(kStops[i][c] + (s - static_cast<double>(i)) * (kStops[i + 1][c] - kStops[i][c])));
  };
  return {mix(0), mix(1), mix(2)};
}

}  // namespace tutti::mission
