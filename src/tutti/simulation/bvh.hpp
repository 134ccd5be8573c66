// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/simulation/triangle_mesh.hpp"

namespace tutti::simulation {

/// Where a ray hits a mesh first.
struct RayHit {
  float distance = 0.0F;  ///< In multiples of the length of the ray's direction.
  std::uint32_t triangle = 0;
};

/// Closest-hit ray casting with a bounding volume hierarchy; triangles are intersected after Moeller and Trumbore
/// (1997). Single precision, immutable, may be used from several threads.
class Bvh {
 public:
  explicit Bvh(const TriangleMesh& mesh);

  /// The nearest triangle, hit from either side, at 0 < distance <= max_distance (in lengths of `direction`). A zero
  /// direction hits nothing.
  [[nodiscard]] std::optional<RayHit> cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                           float max_distance) const;

  /// Unit normal, on the side from which the triangle's corners are counter-clockwise; zero for a degenerate triangle.
  [[nodiscard]] Eigen::Vector3f normal(std::uint32_t triangle) const;
  [[nodiscard]] std::size_t size() const { return place_.size(); }  ///< Number of triangles.

 private:
  static constexpr int kWidth = 4;                       ///< Boxes or triangles tested at once,
  typedef float Lanes __attribute__((vector_size(16)));  ///< in a SIMD register (GCC's and Clang's vector extension).

  /// A box is [low, high] per axis; a child that is not there has an empty one. children: index of a node, or ~index of
  /// a packet.
  struct alignas(64) Node {
    Lanes bounds[2][3];
    std::int32_t children[kWidth];
  };
  struct Packet {
    Lanes corner[3], edge1[3], edge2[3];
    std::uint32_t triangle[kWidth];  ///< Indices in the mesh.
  };
  struct Builder;
  struct Ray;

  std::vector<Node> nodes_;
  std::vector<Packet> packets_;
  std::vector<std::uint32_t> place_;  ///< Position of each triangle of the mesh: kWidth * packet + lane.
};

}  // namespace tutti::simulation
