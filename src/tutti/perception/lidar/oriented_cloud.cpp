// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/oriented_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/model/kdtree_points.hpp"

namespace tutti::lidar {
namespace {

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, KdTreePoints>, KdTreePoints, 3,
                                                   std::int32_t>;

/// nanoflann result set: the nearest point within a radius. The bound prunes the search from its first step.
class NearestWithin {
 public:
  using DistanceType = float;
  NearestWithin(float squared_distance, std::int32_t index) : squared_distance_(squared_distance), index_(index) {}
  bool addPoint(float squared_distance, std::int32_t index) {
    if (squared_distance < squared_distance_) {
      squared_distance_ = squared_distance;
      index_ = index;
    }
    return true;
  }
  [[nodiscard]] float worstDist() const { return squared_distance_; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] std::size_t size() const { return index_ == NeighbourIndex::kNone ? 0 : 1; }
  void sort() {}  ///< Asked for from nanoflann 1.5 on.
  [[nodiscard]] std::int32_t index() const { return index_; }

 private:
  float squared_distance_;
  std::int32_t index_;
};

/// Unit normal of the plane through the neighbours, of either sign; zero when they are not flat.
Eigen::Vector3f fit_normal(const NeighbourIndex& index, std::span<const std::int32_t> neighbours, double max_ratio) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto i : neighbours) mean += index.points()[static_cast<std::size_t>(i)].cast<double>();
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto i : neighbours) {
    const Eigen::Vector3d d = index.points()[static_cast<std::size_t>(i)].cast<double>() - mean;
    scatter += d * d.transpose();
  }
  const auto [values, vectors] = quick_eigen_of(scatter);
  if (!(values[0] <= max_ratio * values[1])) return Eigen::Vector3f::Zero();
  return vectors.col(0).cast<float>().normalized();
}

Eigen::Vector3f nearest_viewpoint(std::span<const Eigen::Vector3f> viewpoints, const Eigen::Vector3f& p) {
  if (viewpoints.empty()) return Eigen::Vector3f::Zero();
  return *std::min_element(viewpoints.begin(), viewpoints.end(),
                           [&](const auto& a, const auto& b) { return (a - p).squaredNorm() < (b - p).squaredNorm(); });
}

}  // namespace

struct NeighbourIndex::Tree {
  static constexpr std::size_t kLeafSize = 10;
  explicit Tree(std::vector<Eigen::Vector3f> points)
      : source{std::move(points)}, kd_tree(3, source, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {}
  KdTreePoints source;
  KdTree kd_tree;
};

NeighbourIndex::NeighbourIndex(std::vector<Eigen::Vector3f> points)
    : tree_(std::make_unique<Tree>(std::move(points))) {}
NeighbourIndex::~NeighbourIndex() = default;

const std::vector<Eigen::Vector3f>& NeighbourIndex::points() const { return tree_->source.points; }

std::size_t NeighbourIndex::bytes() const {
  return sizeof(Tree) + points().capacity() * sizeof(Eigen::Vector3f) + tree_->kd_tree.usedMemory(tree_->kd_tree);
}

std::int32_t NeighbourIndex::nearest(const Eigen::Vector3f& query, float max_distance, std::int32_t guess) const {
  if (points().empty()) return kNone;
  const float most = max_distance * max_distance;
  const float guessed = guess == kNone ? most : (points()[static_cast<std::size_t>(guess)] - query).squaredNorm();
  const float squared_m = std::min(most, guessed);
  const std::int32_t otherwise = guessed < most ? guess : kNone;
  NearestWithin result(squared_m, otherwise);
  tree_->kd_tree.findNeighbors(result, query.data(), {});
  return result.index();
}

std::size_t NeighbourIndex::nearest_k(const Eigen::Vector3f& query, std::span<std::int32_t> out) const {
  if (points().empty()) return 0;
  std::vector<float> squared_distances(out.size());
  return tree_->kd_tree.knnSearch(query.data(), out.size(), out.data(), squared_distances.data());
}

OrientedCloud orient(std::vector<Eigen::Vector3f> points, std::span<const Eigen::Vector3f> viewpoints,
                     const NormalConfig& config) {
  auto index = std::make_shared<const NeighbourIndex>(std::move(points));
  const auto& stored = index->points();
  auto normals = std::make_shared<std::vector<Eigen::Vector3f>>(stored.size(), Eigen::Vector3f::Zero());
  std::vector<std::int32_t> neighbours(static_cast<std::size_t>(config.neighbours));
  const auto max_squared = static_cast<float>(config.max_radius_m * config.max_radius_m);
  for (std::size_t i = 0; i < stored.size(); ++i) {
    std::size_t count = index->nearest_k(stored[i], neighbours);
    while (count > 0 &&
           (stored[static_cast<std::size_t>(neighbours[count - 1])] - stored[i]).squaredNorm() > max_squared)
      --count;
    if (count < 4) continue;  // a plane fit needs more than the three points that any plane passes through
    Eigen::Vector3f normal = fit_normal(*index, std::span(neighbours).first(count), config.max_surface_ratio);
    if (normal.dot(nearest_viewpoint(viewpoints, stored[i]) - stored[i]) < 0.0F) normal = -normal;
    (*normals)[i] = normal;
  }
  auto surface = std::make_shared<std::vector<std::uint32_t>>();
  for (std::size_t i = 0; i < normals->size(); ++i)
    if ((*normals)[i] != Eigen::Vector3f::Zero()) surface->push_back(static_cast<std::uint32_t>(i));
  return {std::move(index), std::move(normals), std::move(surface), nullptr};
}

OrientedCloud joined(std::span<const PosedOriented> clouds) {
  std::vector<Eigen::Vector3f> points;
  auto normals = std::make_shared<std::vector<Eigen::Vector3f>>();
  auto surface = std::make_shared<std::vector<std::uint32_t>>();
  auto roughness = std::make_shared<std::vector<float>>();
  for (const auto& [T_frame_cloud, cloud] : clouds) {
    const Eigen::Matrix3f R = T_frame_cloud.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f t = T_frame_cloud.translation.cast<float>();
    const auto offset = static_cast<std::uint32_t>(points.size());
    for (std::size_t i = 0; i < cloud->size(); ++i) {
      points.emplace_back(R * cloud->point(i) + t);
      normals->emplace_back(R * cloud->normal(i));
      roughness->push_back(cloud->roughness ? (*cloud->roughness)[i] : std::numeric_limits<float>::quiet_NaN());
    }
    for (const std::uint32_t i : *cloud->surface) surface->push_back(offset + i);
  }
  return {std::make_shared<const NeighbourIndex>(std::move(points)), std::move(normals), std::move(surface),
          std::move(roughness)};
}

}  // namespace tutti::lidar
