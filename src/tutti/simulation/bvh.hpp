// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/simulation/triangle_mesh.hpp"

namespace tutti::simulation {

struct RayHit {
  float distance = 0.0F;  ///< In lengths of the direction.
  std::uint32_t triangle = 0;
};

/// Closest-hit ray casting: bounding volume hierarchy split at the median, triangles by Moeller and Trumbore (1997).
/// Single precision, immutable, safe to use from several threads.
class Bvh {
 public:
  explicit Bvh(const TriangleMesh& mesh);

  /// Nearest triangle, from either side, at 0 < distance <= max_distance. `direction` need not be of unit length; a
  /// zero direction hits nothing.
  [[nodiscard]] std::optional<RayHit> cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                           float max_distance) const;

  /// Unit normal, to the side from which the triangle's corners run counter-clockwise; zero for a degenerate one.
  [[nodiscard]] Eigen::Vector3f normal(std::uint32_t triangle) const;
  [[nodiscard]] std::size_t size() const { return place_.size(); }  ///< Triangles.

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
    std::uint32_t triangle[kWidth];  ///< Of the mesh.
  };
  struct Builder;
  struct Ray;

  std::vector<Node> nodes_;
  std::vector<Packet> packets_;
  std::vector<std::uint32_t> place_;  ///< Of each triangle of the mesh: kWidth * packet + lane.
};

}  // namespace tutti::simulation
