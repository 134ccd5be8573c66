// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/birds_eye_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

namespace tutti::lidar {
namespace {

constexpr std::size_t kMinWallCells = 30;
constexpr float kMaxWallTilt = 0.35F;   // |n_z| of a wall: within 20 degrees of vertical
constexpr float kMinFloorTilt = 0.94F;  // |n_z| of a floor or ceiling: within 20 degrees of level
constexpr float kFloorLayer = 0.25F;    // m; floors at different heights are kept apart

constexpr int kBins = 360;  // of half a degree
constexpr double kBinsPerRad = kBins / std::numbers::pi;
constexpr int kBlurBins = 3;    // standard deviation: what bumps and bent walls scatter
constexpr int kApartBins = 30;  // two directions differ by at least this

/// How much wall faces every direction, up to its sign.
std::array<double, kBins> facing(const BirdsEyeView& view) {
  std::array<double, kBins> sharp{}, blurred{};
  for (const auto& wall : view.walls) {
    const double angle = std::atan2(double{wall.normal.y()}, double{wall.normal.x()});
    const double at = (angle < 0.0 ? angle + std::numbers::pi : angle) * kBinsPerRad;
    const int bin = static_cast<int>(at);
    const double beyond = at - bin, weight = wall.normal.squaredNorm();
    sharp[bin % kBins] += weight * (1.0 - beyond);
    sharp[(bin + 1) % kBins] += weight * beyond;
  }
  for (int k = -3 * kBlurBins; k <= 3 * kBlurBins; ++k) {
    const double weight = std::exp(-0.5 * k * k / (kBlurBins * kBlurBins));
    for (int bin = 0; bin < kBins; ++bin) blurred[bin] += weight * sharp[(bin + k + kBins) % kBins];
  }
  return blurred;
}

/// Image of the wall normals (x + i y) of a view turned by `yaw`. Walls outside the image are left out: wrapped around
/// they would stand in a wrong place.
ComplexImage draw(const BirdsEyeView& view, double yaw, double cell_m) {
  constexpr int kMask = kImageSize - 1;
  constexpr float kReach = 0.5F * kImageSize - 1.0F;
  ComplexImage image = ComplexImage::Zero(kImageSize, kImageSize);
  const Eigen::Matrix2f R = Eigen::Rotation2Df(static_cast<float>(yaw)).toRotationMatrix();
  for (const auto& wall : view.walls) {
    const Eigen::Vector2f p = R * wall.position / static_cast<float>(cell_m), n = R * wall.normal;
    if (p.squaredNorm() > kReach * kReach) continue;
    const float x0 = std::floor(p.x()), y0 = std::floor(p.y()), fx = p.x() - x0, fy = p.y() - y0;
    for (int corner = 0; corner < 4; ++corner) {  // bilinear
      const int dx = corner & 1, dy = corner >> 1;
      const float w = (dx ? fx : 1.0F - fx) * (dy ? fy : 1.0F - fy);
      image((static_cast<int>(y0) + dy) & kMask, (static_cast<int>(x0) + dx) & kMask) +=
          std::complex<float>(w * n.x(), w * n.y());
    }
  }
  return image;
}

/// Gives all wavelengths the same amplitude, fading out towards the shortest, and the whole the sum of squares 1. False
/// when there is nothing to scale.
bool whiten(ComplexImage& spectrum) {
  constexpr float kFade = 0.25F * kImageSize;
  const Eigen::ArrayXXf size = spectrum.abs();
  const float strongest = size.maxCoeff();
  if (strongest == 0.0F) return false;
  for (int row = 0; row < kImageSize; ++row)
    for (int column = 0; column < kImageSize; ++column) {
      const int y = std::min(row, kImageSize - row), x = std::min(column, kImageSize - column);
      const float fade = std::exp(-0.5F * static_cast<float>(y * y + x * x) / (kFade * kFade));
      spectrum(row, column) *= size(row, column) > 1e-6F * strongest ? fade / size(row, column) : 0.0F;
    }
  spectrum /= static_cast<float>(std::sqrt(spectrum.abs2().cast<double>().sum()));
  return true;
}

}  // namespace

/// Walls are summed per half cell, floors per cell and layer, both in a deterministic order.
BirdsEyeView make_view(const OrientedCloud& cloud, const Eigen::Quaterniond& R_level_submap, double cell_m) {
  struct Sum {
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
    Eigen::Vector2f normal = Eigen::Vector2f::Zero();
    float count = 0.0F;
    void add(const Eigen::Vector3f& p, const Eigen::Vector3f& n) {
      point += p;
      normal += n.head<2>();
      count += 1.0F;
    }
  };
  std::map<std::pair<int, int>, Sum> walls;
  std::map<std::tuple<int, int, int>, Sum> floors;
  const Eigen::Matrix3f R = R_level_submap.toRotationMatrix().cast<float>();
  const auto wall_cell = static_cast<float>(0.5 * cell_m);
  const auto floor_cell = static_cast<float>(cell_m);
  const auto bin = [](float x, float size) { return static_cast<int>(std::floor(x / size)); };
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.normal(i) == Eigen::Vector3f::Zero()) continue;
    const Eigen::Vector3f p = R * cloud.point(i), n = R * cloud.normal(i);
    if (std::abs(n.z()) < kMaxWallTilt)
      walls[{bin(p.x(), wall_cell), bin(p.y(), wall_cell)}].add(p, n);
    else if (std::abs(n.z()) > kMinFloorTilt)
      floors[{bin(p.x(), floor_cell), bin(p.y(), floor_cell), 2 * bin(p.z(), kFloorLayer) + (n.z() > 0.0F)}].add(p, n);
  }
  BirdsEyeView view;
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();
  for (const auto& [key, sum] : walls) centre += sum.point.head<2>() / sum.count;
  if (!walls.empty()) centre /= static_cast<float>(walls.size());
  view.centre = centre.cast<double>();
  for (const auto& [key, sum] : walls)
    view.walls.push_back({sum.point.head<2>() / sum.count - centre, sum.normal / std::sqrt(sum.count)});
  for (const auto& [key, sum] : floors) {
    const Eigen::Vector2f position = sum.point.head<2>() / sum.count - centre;
    const bool faces_up = (std::get<2>(key) & 1) != 0;
    view.floors.push_back({position, sum.point.z() / sum.count, floor_patch(position, faces_up, cell_m)});
  }
  std::ranges::stable_sort(view.floors, {}, &FloorCell::patch);
  return view;
}

FloorPatch floor_patch(const Eigen::Vector2f& position, bool faces_up, double cell_m) {
  const auto size = static_cast<float>(2.0 * cell_m);
  return {static_cast<int>(std::floor(position.x() / size)), static_cast<int>(std::floor(position.y() / size)),
          faces_up};
}

bool has_enough_walls(const BirdsEyeView& view) { return view.walls.size() >= kMinWallCells; }

std::vector<double> wall_directions(const BirdsEyeView& view, int count) {
  auto walls = facing(view);
  std::vector<double> directions;
  while (directions.size() < static_cast<std::size_t>(count)) {
    const int best = static_cast<int>(std::ranges::max_element(walls) - walls.begin());
    const double left = walls[(best + kBins - 1) % kBins], top = walls[best], right = walls[(best + 1) % kBins];
    if (top <= 0.0) break;
    const double bend = left - 2.0 * top + right;  // vertex of the parabola through the three
    const double vertex = bend < 0.0 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
    const double bin = best + vertex;
    directions.push_back((bin < 0.0 ? bin + kBins : bin) / kBinsPerRad);
    for (int k = -kApartBins; k <= kApartBins; ++k) walls[(best + k + kBins) % kBins] = 0.0;
  }
  return directions;
}

std::vector<TurnedView> turn_views(const BirdsEyeView& view, const CandidateConfig& config) {
  std::vector<TurnedView> out;
  for (const double direction : wall_directions(view, config.wall_directions)) {
    TurnedView turned{direction, forward_fft(draw(view, -direction, config.cell_m))};
    if (whiten(turned.spectrum)) out.push_back(std::move(turned));
  }
  return out;
}

}  // namespace tutti::lidar
