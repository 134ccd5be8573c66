// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/hall.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace tutti::simulation {
namespace {

using AlignedBox = Eigen::AlignedBox3d;

/// One in [-0.5, 0.5] for each patch of each texture.
float patch(std::uint64_t texture, int x, int y) {
  const std::uint64_t place =
      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32U) ^ static_cast<std::uint32_t>(y);
  return static_cast<float>(mixed(place ^ texture) >> 40U) * 0x1p-24F - 0.5F;
}

/// std::floor of a number that fits an int; without SSE 4.1 that is a function of the C library.
int floor_of(float x) {
  const int towards_zero = static_cast<int>(x);
  return towards_zero - (x < static_cast<float>(towards_zero) ? 1 : 0);
}

/// Patches of size 1 with edges `edge` wide, at most 1.
float patches(std::uint32_t number, float x, float y, float edge) {
  const std::uint64_t texture = mixed(number);
  const int ix = floor_of(x - 0.5F), iy = floor_of(y - 0.5F);
  const float cell_x = static_cast<float>(ix), cell_y = static_cast<float>(iy);
  const auto share = [&](float from_centre) { return std::clamp((from_centre - 0.5F) / edge + 0.5F, 0.0F, 1.0F); };
  const float sx = share(x - 0.5F - cell_x), sy = share(y - 0.5F - cell_y);
  float sum = 0.0F;
  if (sx < 1.0F && sy < 1.0F) sum += (1.0F - sx) * (1.0F - sy) * patch(texture, ix, iy);
  if (sx > 0.0F && sy < 1.0F) sum += sx * (1.0F - sy) * patch(texture, ix + 1, iy);
  if (sx < 1.0F && sy > 0.0F) sum += (1.0F - sx) * sy * patch(texture, ix, iy + 1);
  if (sx > 0.0F && sy > 0.0F) sum += sx * sy * patch(texture, ix + 1, iy + 1);
  return sum;
}

/// The six sides of a box, seen from outside, or from inside.
void add_box(Hall& hall, const AlignedBox& box, bool from_inside, double plain_share, Rng& rng) {
  for (int axis = 0; axis < 3; ++axis)
    for (const bool high : {false, true}) {
      const int u = (axis + 1) % 3, w = (axis + 2) % 3;
      std::array<Eigen::Vector3d, 4> corners;
      for (int i = 0; i < 4; ++i) {
        Eigen::Vector3d& p = corners[static_cast<std::size_t>(i)];
        p[axis] = high ? box.max()[axis] : box.min()[axis];
        p[u] = i == 1 || i == 2 ? box.max()[u] : box.min()[u];
        p[w] = i >= 2 ? box.max()[w] : box.min()[w];
      }
      if (high == from_inside) std::reverse(corners.begin(), corners.end());
      const auto first = static_cast<std::uint32_t>(hall.mesh.vertices.size());
      for (const Eigen::Vector3d& p : corners) hall.mesh.vertices.push_back(p.cast<float>());
      hall.mesh.triangles.push_back({first, first + 1, first + 2});
      hall.mesh.triangles.push_back({first, first + 2, first + 3});
      // Turned, so that patches of neighbouring faces never continue each other.
      const double angle = rng.uniform(0.2, 1.3);
      const Eigen::Vector3d a = Eigen::Vector3d::Unit(u), b = Eigen::Vector3d::Unit(w);
      hall.faces.push_back(
          {.corner = corners[0].cast<float>(),
           .along = (std::cos(angle) * a + std::sin(angle) * b).cast<float>(),
           .across = (std::cos(angle) * b - std::sin(angle) * a).cast<float>(),
           .texture = rng.bernoulli(plain_share) ? 0U : 1U + static_cast<std::uint32_t>(rng.index(1U << 30U)),
           .light = static_cast<float>(rng.uniform(0.75, 1.0))});
    }
}

}  // namespace

Hall make_hall(const HallConfig& config, Rng rng) {
  constexpr double kAlongWalls_m = 1.5;  // boxes reach this far into the hall,
  constexpr double kMiddle = 0.2;        // and this share of it away from its middle
  const Eigen::Vector3d half(config.length_m / 2.0, config.width_m / 2.0, 0.0);
  Hall hall;
  add_box(hall, AlignedBox(-half, half + Eigen::Vector3d(0.0, 0.0, config.height_m)), true, 0.0, rng);
  for (int i = 0; i < config.boxes; ++i) {
    Eigen::Vector3d size, low(0.0, 0.0, 0.0);
    for (const int axis : {2, 1, 0}) size[axis] = rng.uniform(0.3, axis == 2 ? 3.0 : kAlongWalls_m);
    for (const int axis : {1, 0}) low[axis] = rng.uniform(-half[axis], half[axis] - size[axis]);
    if (i % 4 == 0) {
      low.head<2>() *= kMiddle;
    } else {
      const int across = i % 2;  // to which walls
      low[across] = rng.bernoulli(0.5) ? -half[across] : half[across] - size[across];
    }
    add_box(hall, AlignedBox(low, low + size), false, config.plain_share, rng);
  }
  return hall;
}

float brightness(const Face& face, const Eigen::Vector3f& point, float footprint_m) {
  constexpr std::array<float, 4> kSizes_m = {0.9F, 0.3F, 0.1F, 0.03F};
  constexpr std::array<float, 4> kContrast = {0.3F, 0.4F, 0.35F, 0.25F};
  float sum = 0.5F;
  if (face.texture != 0) {
    const float x = (point - face.corner).dot(face.along), y = (point - face.corner).dot(face.across);
    for (std::size_t i = 0; i < kSizes_m.size(); ++i) {
      const float edge = std::max(footprint_m / kSizes_m[i], 1e-3F);
      if (edge >= 2.0F) break;
      const float fade = std::min(1.0F, 2.0F - edge);
      sum +=
          fade * kContrast[i] *
          patches(face.texture + static_cast<std::uint32_t>(i), x / kSizes_m[i], y / kSizes_m[i], std::min(edge, 1.0F));
    }
  }
  return face.light * std::clamp(sum, 0.0F, 1.0F);
}

}  // namespace tutti::simulation
