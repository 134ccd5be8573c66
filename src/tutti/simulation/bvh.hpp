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

/// Closest-hit ray casting: bounding volume hierarchy by the binned surface area heuristic (Wald, "On fast Construction
/// of SAH-based Bounding Volume Hierarchies", 2007), triangles by Moeller and Trumbore (1997). Single precision,
/// immutable, safe to use from several threads.
class Bvh {
 public:
  explicit Bvh(const TriangleMesh& mesh);

  /// Nearest triangle, from either side, at 0 < distance <= max_distance. `direction` need not be of unit length; a
  /// zero direction hits nothing.
  [[nodiscard]] std::optional<RayHit> cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                           float max_distance) const;

  /// Unit normal, to the side from which the triangle's corners run counter-clockwise; zero for a degenerate one.
  [[nodiscard]] Eigen::Vector3f normal(std::uint32_t triangle) const;
  [[nodiscard]] std::size_t size() const { return triangles_.size(); }

 private:
  /// Both children's boxes in one cache line. A child with count 0 is the node `index`, otherwise `count` triangles
  /// from place `index` on.
  struct alignas(64) Node {
    float low[2][3];
    float high[2][3];
    std::uint32_t index[2];
    std::uint32_t count[2];
  };
  struct Triangle {
    Eigen::Vector3f corner, edge1, edge2;
  };
  struct Builder;
  struct Ray;

  std::vector<Node> nodes_;
  std::vector<Triangle> triangles_;        ///< In the order of the leaves.
  std::vector<std::uint32_t> mesh_index_;  ///< Of each of these.
  std::vector<std::uint32_t> place_;       ///< Of each triangle of the mesh.
};

}  // namespace tutti::simulation
