// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/voxel_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::lidar {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t kHalfRange = 1048576;  // 2^20 voxels: 21 bits per axis fit one 63-bit Morton code
constexpr auto kFarthest = static_cast<double>(kHalfRange);

struct KeyedPoint {
  std::uint64_t key;
  Eigen::Vector3f point;
};

/// Spreads the low 21 bits to every third bit.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | (x << 32U)) & 0x1f00000000ffffULL;
  x = (x | (x << 16U)) & 0x1f0000ff0000ffULL;
  x = (x | (x << 8U)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4U)) & 0x10c30c30c30c30c3ULL;
  return (x | (x << 2U)) & 0x1249249249249249ULL;
}

/// Where the point is in the grid, in voxels.
Eigen::Array3d place_of(const Eigen::Vector3f& p, double voxel_m) { return p.cast<double>().array() / voxel_m; }

bool is_in_range(const Eigen::Array3d& place) {
  return (place >= -kFarthest).all() && (place < kFarthest).all();  // also false for NaN
}

/// floor(place), which takes a call without SSE 4, counted from the far corner of the range.
std::uint64_t cell_of(double place) {
  const auto whole = static_cast<std::int64_t>(place);
  return static_cast<std::uint64_t>(whole - (static_cast<double>(whole) > place ? 1 : 0) + kHalfRange);
}

/// Appends the point unless it is not finite or out of range.
void append(std::vector<KeyedPoint>& out, const Eigen::Vector3f& p, double voxel_m) {
  const Eigen::Array3d place = place_of(p, voxel_m);
  if (!is_in_range(place)) return;
  const auto axis = [&](int i) { return spread_bits(cell_of(place[i])); };
  out.push_back({axis(0) | (axis(1) << 1U) | (axis(2) << 2U), p});
}

/// The sum of a voxel's points.
struct VoxelSum {
  std::uint64_t key;
  std::uint32_t count = 0;
  float least = kInfinity, most = 0.0F;  ///< Smallest size of a coordinate that is not zero, and largest one.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3f& point) {
    const Eigen::Array3f size = point.array().abs();
    ++count;
    sum += point.cast<double>();
    least = std::min(least, (size == 0.0F).select(kInfinity, size).minCoeff());
    most = std::max(most, size.maxCoeff());
  }
  /// Whether no order of the points gives another sum, as none is rounded: a float is a multiple of 2^-24 of its size
  /// at least, and a double holds 2^53 multiples; half of that, as this product is rounded, too.
  [[nodiscard]] bool is_exact() const { return most * static_cast<float>(count) <= 0x1p28F * least; }
  [[nodiscard]] Eigen::Vector3f centroid() const { return (sum / static_cast<double>(count)).cast<float>(); }
};

/// The voxels of points in any order, by a table of their keys (open addressing).
class VoxelTable {
 public:
  explicit VoxelTable(std::size_t most_voxels) : most_voxels_(most_voxels) {}
  /// False when there are more voxels than that, or keys crowd in the table, as somebody may have made them to.
  bool add(const KeyedPoint& point) {
    if (2 * voxels_.size() >= slots_.size() && !grow()) return false;
    const std::size_t slot = slot_of(point.key);
    if (slot == slots_.size()) return false;
    if (slots_[slot] == kFree) {
      if (voxels_.size() == most_voxels_) return false;
      slots_[slot] = static_cast<std::uint32_t>(voxels_.size());
      voxels_.push_back({.key = point.key});
    }
    voxels_[slots_[slot]].add(point.point);
    return true;
  }
  [[nodiscard]] VoxelSum& voxel(std::uint64_t key) { return voxels_[slots_[slot_of(key)]]; }  ///< One that was added.
  [[nodiscard]] std::vector<VoxelSum>& voxels() { return voxels_; }

 private:
  static constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kMostProbes = 64;

  /// Where the key is or would be; the table's size when there is no place for it nearby.
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = (key * 0x9e3779b97f4a7c15ULL) >> shift_;  // Knuth's multiplicative hashing
    for (std::size_t probe = 0; probe < kMostProbes; ++probe, slot = (slot + 1) & mask)
      if (slots_[slot] == kFree || voxels_[slots_[slot]].key == key) return slot;
    return slots_.size();
  }

  /// False where add() is.
  bool grow() {
    --shift_;
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
      const std::size_t slot = slot_of(voxels_[i].key);
      if (slot == slots_.size()) return false;
      slots_[slot] = i;
    }
    return true;
  }

  std::size_t most_voxels_;
  std::vector<VoxelSum> voxels_;
  unsigned shift_ = 52;
  std::vector<std::uint32_t> slots_ = std::vector<std::uint32_t>(std::size_t{1} << (64U - shift_), kFree);
};

/// The voxels of points, by key. They are added in an order that is not the input's.
template <class Visit>
void visit_in_order(std::vector<KeyedPoint> points, const Visit& visit) {
  std::sort(points.begin(), points.end(), [](const KeyedPoint& a, const KeyedPoint& b) {
    return std::tie(a.key, a.point.x(), a.point.y(), a.point.z()) <
           std::tie(b.key, b.point.x(), b.point.y(), b.point.z());
  });
  for (auto begin = points.begin(); begin != points.end();) {
    VoxelSum voxel{.key = begin->key};
    for (; begin != points.end() && begin->key == voxel.key; ++begin) voxel.add(begin->point);
    visit(voxel);
  }
}

/// The same by a table, where most points need no order and share their voxel with others; nothing if it is no use.
std::optional<std::vector<VoxelSum>> sums_by_table(const std::vector<KeyedPoint>& points) {
  VoxelTable table(points.size() / 2);
  for (const KeyedPoint& point : points)
    if (!table.add(point)) return std::nullopt;
  if (!std::ranges::all_of(table.voxels(), &VoxelSum::is_exact)) {  // as where rays run along an axis: x is 1e-17
    std::vector<KeyedPoint> rounded;
    for (const KeyedPoint& point : points)
      if (!table.voxel(point.key).is_exact()) rounded.push_back(point);
    visit_in_order(std::move(rounded), [&](const VoxelSum& ordered) { table.voxel(ordered.key) = ordered; });
  }
  std::ranges::sort(table.voxels(), {}, &VoxelSum::key);
  return std::move(table.voxels());
}

/// The result, to the bit, does not depend on the order of the input. Sorting all of a submap's million points takes
/// several times as long as the table.
PointCloud centroids(std::vector<KeyedPoint> points) {
  PointCloud out;
  const auto keep = [&out](const VoxelSum& voxel) { out.points.push_back(voxel.centroid()); };
  if (const auto voxels = sums_by_table(points))
    std::ranges::for_each(*voxels, keep);
  else
    visit_in_order(std::move(points), keep);
  return out;
}

}  // namespace

PointCloud voxel_downsample(const PointCloud& cloud, double voxel_m) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  std::vector<KeyedPoint> keyed;
  keyed.reserve(cloud.points.size());
  for (const auto& p : cloud.points) append(keyed, p, voxel_m);
  return centroids(std::move(keyed));
}

const Eigen::Vector3f* first_skipped(const PointCloud& cloud, double voxel_m) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  const auto found = std::find_if(cloud.points.begin(), cloud.points.end(),
                                  [&](const Eigen::Vector3f& p) { return !is_in_range(place_of(p, voxel_m)); });
  return found == cloud.points.end() ? nullptr : &*found;
}

PointCloud merge_scans(std::span<const PosedCloud> scans, double voxel_m, RangeLimits limits) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  std::size_t count = 0;
  for (const auto& scan : scans) count += scan.cloud ? scan.cloud->points.size() : 0;
  std::vector<KeyedPoint> keyed;
  keyed.reserve(count);
  for (const auto& scan : scans) {
    if (!scan.cloud) continue;
    const Eigen::Matrix3d R = scan.T_submap_body.rotation.toRotationMatrix();
    for (const auto& p : scan.cloud->points) {
      const double range = p.cast<double>().norm();
      if (!(range >= limits.min_m && range <= limits.max_m)) continue;
      append(keyed, (R * p.cast<double>() + scan.T_submap_body.translation).cast<float>(), voxel_m);
    }
  }
  return centroids(std::move(keyed));
}

}  // namespace tutti::lidar
