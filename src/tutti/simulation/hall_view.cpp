// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/hall_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

constexpr int kWidth_px = 16, kHeight_px = 8;  // of a tile
constexpr std::size_t kRays = kWidth_px * kHeight_px;
constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr float kEdge = 1e-5F;      // of a face's size, as in bvh.cpp
constexpr float kRounding = 1e-6F;  // of a cosine

/// Neighbouring rays, row by row; those beyond the image's edge are zero.
struct Tile {
  std::array<float, kRays> dx{}, dy{}, dz{};
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();  ///< Axis of the cone round them, unit,
  float cosine = 1.0F, sine = 0.0F;                ///< and half of its opening angle.

  Tile(std::span<const Eigen::Vector3f> rays, int width_px, int x_px, int y_px) {
    const int height_px = static_cast<int>(rays.size()) / width_px;
    for (int y = y_px; y < std::min(height_px, y_px + kHeight_px); ++y)
      for (int x = x_px; x < std::min(width_px, x_px + kWidth_px); ++x) {
        const Eigen::Vector3f& ray = rays[static_cast<std::size_t>(y * width_px + x)];
        const auto i = static_cast<std::size_t>((y - y_px) * kWidth_px + x - x_px);
        dx[i] = ray.x(), dy[i] = ray.y(), dz[i] = ray.z();
        axis += ray;
      }
    axis.normalize();
    for (std::size_t i = 0; i < kRays; ++i) {
      const Eigen::Vector3f ray(dx[i], dy[i], dz[i]);
      if (!ray.isZero()) cosine = std::min(cosine, axis.dot(ray));
    }
    cosine -= kRounding;
    sine = std::sqrt(std::max(0.0F, 1.0F - cosine * cosine));
  }
};

/// A rectangle in the camera frame: a ray d meets its plane at t = to_plane / (normal . d), there the share
/// a0 + t (a . d) along one side and b0 + t (b . d) along the other.
struct Rectangle {
  Eigen::Vector3f normal, a, b, centre;
  float to_plane, a0, b0, radius_m;

  Rectangle(const Eigen::Vector3f& corner, const Eigen::Vector3f& along, const Eigen::Vector3f& across)
      : normal(along.cross(across)),
        a(along / along.squaredNorm()),
        b(across / across.squaredNorm()),
        centre(corner + 0.5F * (along + across)),
        to_plane(normal.dot(corner)),
        a0(-a.dot(corner)),
        b0(-b.dot(corner)),
        radius_m(0.5F * (along + across).norm()) {}

  /// May a ray of the cone meet its bounding sphere? Then the angle between axis and centre is at most half the cone's
  /// opening angle and half of that under which the sphere is seen.
  [[nodiscard]] bool reaches(const Tile& tile) const {
    const float squared = centre.squaredNorm() - radius_m * radius_m;
    if (squared <= 0.0F) return true;
    return tile.axis.dot(centre) >= tile.cosine * std::sqrt(squared) - tile.sine * radius_m;
  }
};

std::vector<Rectangle> place(const Hall& hall, const Pose3& T_world_camera) {
  const Eigen::Matrix3f R_camera_world = T_world_camera.rotation.conjugate().toRotationMatrix().cast<float>();
  const Eigen::Vector3f camera = T_world_camera.translation.cast<float>();
  std::vector<Rectangle> out;
  out.reserve(hall.faces.size());
  for (std::size_t i = 0; i < hall.faces.size(); ++i) {
    const auto& first = hall.mesh.triangles[2 * i];
    const Eigen::Vector3f& corner = hall.mesh.vertices[first[0]];
    const Eigen::Vector3f& next = hall.mesh.vertices[first[1]];
    const Eigen::Vector3f& last = hall.mesh.vertices[hall.mesh.triangles[2 * i + 1][2]];
    out.emplace_back(R_camera_world * (corner - camera), R_camera_world * (next - corner),
                     R_camera_world * (last - corner));
  }
  return out;
}

struct Nearest {
  std::array<float, kRays> distance;
  std::array<std::uint32_t, kRays> face;
  Nearest() {
    distance.fill(kNothing);
    face.fill(kNoFace);
  }

  /// Without branches, so that compilers make it work on several rays at once. A ray along the plane, and one that is
  /// zero, makes infinities and NaNs, which fail the comparisons.
  void meet(const Rectangle& with, std::uint32_t number, const Tile& tile) {
    const float nx = with.normal.x(), ny = with.normal.y(), nz = with.normal.z();
    const float ax = with.a.x(), ay = with.a.y(), az = with.a.z();
    const float bx = with.b.x(), by = with.b.y(), bz = with.b.z();
    const float to_plane = with.to_plane, a0 = with.a0, b0 = with.b0;
    for (std::size_t i = 0; i < kRays; ++i) {
      const float x = tile.dx[i], y = tile.dy[i], z = tile.dz[i];
      const float t = to_plane / (nx * x + ny * y + nz * z);
      const float a = a0 + t * (ax * x + ay * y + az * z), b = b0 + t * (bx * x + by * y + bz * z);
      const bool inside = (a >= -kEdge) & (a <= 1.0F + kEdge) & (b >= -kEdge) & (b <= 1.0F + kEdge);
      const bool nearer = inside & (t > 0.0F) & (t < distance[i]);
      distance[i] = nearer ? t : distance[i];
      face[i] = nearer ? number : face[i];
    }
  }
};

}  // namespace

std::vector<SeenFace> view_of(const Hall& hall, std::span<const Eigen::Vector3f> rays, int width_px,
                              const Pose3& T_world_camera) {
  TUTTI_CHECK(hall.mesh.triangles.size() == 2 * hall.faces.size(), "{} triangles of {} faces",
              hall.mesh.triangles.size(), hall.faces.size());
  const std::vector<Rectangle> rectangles = place(hall, T_world_camera);
  const int height_px = static_cast<int>(rays.size()) / width_px;
  std::vector<SeenFace> out(rays.size());
  for (int y_px = 0; y_px < height_px; y_px += kHeight_px)
    for (int x_px = 0; x_px < width_px; x_px += kWidth_px) {
      const Tile tile(rays, width_px, x_px, y_px);
      Nearest nearest;
      for (std::uint32_t i = 0; i < rectangles.size(); ++i)
        if (rectangles[i].reaches(tile)) nearest.meet(rectangles[i], i, tile);
      for (int y = y_px; y < std::min(height_px, y_px + kHeight_px); ++y)
        for (int x = x_px; x < std::min(width_px, x_px + kWidth_px); ++x) {
          const auto i = static_cast<std::size_t>((y - y_px) * kWidth_px + x - x_px);
          out[static_cast<std::size_t>(y * width_px + x)] = {nearest.distance[i], nearest.face[i]};
        }
    }
  return out;
}

}  // namespace tutti::simulation
