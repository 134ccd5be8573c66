// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/lidar/closure_config.hpp"

namespace tutti::lidar {

/// Finds nearest points. Immutable after construction, safe to share between threads, deterministic.
class NeighbourIndex {
 public:
  static constexpr std::int32_t kNone = -1;

  explicit NeighbourIndex(std::vector<Eigen::Vector3f> points);
  ~NeighbourIndex();
  NeighbourIndex(const NeighbourIndex&) = delete;
  NeighbourIndex& operator=(const NeighbourIndex&) = delete;

  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const;
  /// Index of the point nearest to `query` and closer than `max_distance`, m, or kNone. `guess`: index of a point that
  /// may be the nearest, which makes the search shorter and changes nothing else.
  [[nodiscard]] std::int32_t nearest(const Eigen::Vector3f& query, float max_distance,
                                     std::int32_t guess = kNone) const;
  /// Writes the indices of the nearest points, at most out.size(), nearest first; returns how many there are.
  std::size_t nearest_k(const Eigen::Vector3f& query, std::span<std::int32_t> out) const;
  [[nodiscard]] std::size_t bytes() const;  ///< Memory used.

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// A cloud with normals: every point has a unit normal that faces the place it was seen from, or a zero one where its
/// neighbourhood is not flat. Copies share the data.
struct OrientedCloud {
  std::shared_ptr<const NeighbourIndex> index;
  std::shared_ptr<const std::vector<Eigen::Vector3f>> normals;
  /// Indices of the points that have a normal, in storage order.
  std::shared_ptr<const std::vector<std::uint32_t>> surface;
  /// How far each point may be off the plane of a point in another cloud of the same place, m; NaN where unknown. Null
  /// when not computed.
  std::shared_ptr<const std::vector<float>> roughness;

  [[nodiscard]] std::size_t size() const { return normals ? normals->size() : 0; }
  [[nodiscard]] const Eigen::Vector3f& point(std::size_t i) const { return index->points()[i]; }
  [[nodiscard]] const Eigen::Vector3f& normal(std::size_t i) const { return (*normals)[i]; }
};

/// Gives points normals by principal components of their nearest neighbours, turned towards the nearest viewpoint, or
/// towards the origin without viewpoints. Points and viewpoints are in one frame, m. Deterministic.
OrientedCloud orient(std::vector<Eigen::Vector3f> points, std::span<const Eigen::Vector3f> viewpoints,
                     const NormalConfig& config);

/// A cloud that lies somewhere in another frame; the cloud must not be null.
struct PosedOriented {
  Pose3 T_frame_cloud;
  const OrientedCloud* cloud = nullptr;
};
/// The clouds in one frame, one after the other, with the normals and the roughness that they have.
OrientedCloud joined(std::span<const PosedOriented> clouds);

}  // namespace tutti::lidar
