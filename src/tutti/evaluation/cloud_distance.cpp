// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/cloud_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/model/kdtree_points.hpp"

namespace tutti::evaluation {
namespace {

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, KdTreePoints>, KdTreePoints, 3,
                                                   std::uint32_t>;

constexpr std::size_t kNeighbours = 8;     // the point itself included
constexpr double kFlat = 0.05;             // smallest over middle eigenvalue of their scatter
constexpr std::size_t kLeastOfAPlane = 4;  // any three points are flat

/// The surface at a point, as it and its neighbours determine it.
struct Patch {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< Zero: not flat.
  float offset = 0.0F;                               ///< normal . x = offset on the plane.
  float reach = 0.0F;                                ///< From the point to its farthest neighbour.
};

Patch fit_patch(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& point,
                std::span<const std::uint32_t> neighbours) {
  if (neighbours.size() < kLeastOfAPlane) return {};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto i : neighbours) mean += points[i].cast<double>();
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto i : neighbours) {
    const Eigen::Vector3d d = points[i].cast<double>() - mean;
    scatter += d * d.transpose();
  }
  const auto [spread, axes] = quick_eigen_of(scatter);
  // On one line a plane could have any tilt.
  if (!(spread[0] <= kFlat * spread[1]) || !(spread[1] >= kFlat * spread[2])) return {};
  const Eigen::Vector3d normal = axes.col(0).normalized();
  return {normal.cast<float>(), static_cast<float>(normal.dot(mean)), (points[neighbours.back()] - point).norm()};
}

float distance(const Eigen::Vector3f& p, const Eigen::Vector3f& nearest, float squared, const Patch& patch) {
  const float to_point = std::sqrt(squared);
  if (patch.normal.isZero()) return to_point;
  const float height = patch.normal.dot(p) - patch.offset;
  const float along = patch.normal.dot(p - nearest);
  const float sideways = std::sqrt(std::max(0.0F, squared - along * along));
  return std::min(to_point, std::hypot(height, std::max(0.0F, sideways - patch.reach)));
}

KdTreePoints finite_points(const PointCloud& cloud) {
  KdTreePoints source;
  source.points.reserve(cloud.points.size());
  std::copy_if(cloud.points.begin(), cloud.points.end(), std::back_inserter(source.points),
               [](const Eigen::Vector3f& p) { return p.allFinite(); });
  return source;
}

}  // namespace

struct CloudIndex::Tree {
  static constexpr std::size_t kLeafSize = 10;
  explicit Tree(KdTreePoints from)
      : source(std::move(from)), kd_tree(3, source, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {
    if (source.points.empty()) return;
    patches.reserve(source.points.size());
    std::array<std::uint32_t, kNeighbours> neighbours{};
    std::array<float, kNeighbours> squared{};
    for (const Eigen::Vector3f& p : source.points) {
      const std::size_t count = kd_tree.knnSearch(p.data(), kNeighbours, neighbours.data(), squared.data());
      patches.push_back(fit_patch(source.points, p, std::span(neighbours).first(count)));
    }
  }
  KdTreePoints source;
  KdTree kd_tree;
  std::vector<Patch> patches;  // one per point
};

CloudIndex::CloudIndex(const PointCloud& cloud_a) : tree_(std::make_unique<Tree>(finite_points(cloud_a))) {}
CloudIndex::~CloudIndex() = default;

std::vector<float> CloudIndex::distances(const PointCloud& cloud_b, const Pose3& T_a_b) const {
  std::vector<float> out(cloud_b.points.size(), std::numeric_limits<float>::quiet_NaN());
  if (tree_->source.points.empty()) return out;
  const Eigen::Isometry3d T(T_a_b.matrix());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!cloud_b.points[i].allFinite()) continue;
    const Eigen::Vector3f p_a = (T * cloud_b.points[i].cast<double>()).cast<float>();
    std::uint32_t nearest = 0;
    float squared = 0.0F;
    tree_->kd_tree.knnSearch(p_a.data(), 1, &nearest, &squared);
    out[i] = distance(p_a, tree_->source.points[nearest], squared, tree_->patches[nearest]);
  }
  return out;
}

std::optional<CloudDistance> summarise(std::span<const float> distances_m) {
  std::vector<float> finite;
  finite.reserve(distances_m.size());
  std::copy_if(distances_m.begin(), distances_m.end(), std::back_inserter(finite),
               [](float d) { return std::isfinite(d); });
  if (finite.empty()) return std::nullopt;
  std::sort(finite.begin(), finite.end());
  const auto n = static_cast<double>(finite.size());
  const auto within = [&](float limit_m) {
    return static_cast<double>(std::upper_bound(finite.begin(), finite.end(), limit_m) - finite.begin()) / n;
  };
  CloudDistance out{.points = finite.size()};
  double sum = 0.0;
  double squares = 0.0;
  for (const double d : finite) {
    sum += d;
    squares += d * d;
  }
  out.mean_m = sum / n;
  out.rms_m = std::sqrt(squares / n);
  out.p95_m = finite[static_cast<std::size_t>(std::ceil(0.95 * n)) - 1];
  out.within_10cm = within(0.1F);
  out.within_30cm = within(0.3F);
  out.within_1m = within(1.0F);
  return out;
}

}  // namespace tutti::evaluation
